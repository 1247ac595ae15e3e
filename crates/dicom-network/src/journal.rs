//! What a peer has acknowledged, so that it is not sent twice.
//!
//! A hidden text file beside the data: a line for each object, with the peer, the SOP Instance UID,
//! the length of the data set and the date. It is written after each acknowledgement; a line that
//! was cut short counts as none, so at worst an object is sent again.

use crate::node::Node;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use supine_dicom::ObjectFile;

/// Name of the file.
pub const JOURNAL: &str = ".supine-sent";
/// Longest journal that is read, bytes: some 500,000 objects.
const MAX_BYTES: u64 = 64 << 20;

/// The journal of a folder and a peer.
#[derive(Debug)]
pub(crate) struct Journal {
    pub(crate) path: PathBuf,
    peer: String,
    /// SOP Instance UID and length, with the date of the acknowledgement.
    known: BTreeMap<(String, u64), String>,
    file: Option<File>,
}

impl Journal {
    /// The journal beside what is sent: in the folder, or in that of the file. One that cannot be
    /// read knows nothing.
    pub(crate) fn open(sent: &Path, peer: &Node) -> Self {
        let parent = || sent.parent().filter(|p| !p.as_os_str().is_empty());
        let folder = if sent.is_dir() { sent } else { parent().unwrap_or(Path::new(".")) };
        let (path, peer) = (folder.join(JOURNAL), peer.to_string());
        let small = std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() <= MAX_BYTES);
        let text = if small { std::fs::read(&path).unwrap_or_default() } else { Vec::new() };
        let known = known(&String::from_utf8_lossy(&text), &peer);
        Self { path, peer, known, file: None }
    }

    /// When the peer has acknowledged the object, `YYYY-MM-DD` by the clock here; `None` when it
    /// has not.
    pub(crate) fn acknowledged(&self, object: &ObjectFile) -> Option<&str> {
        let of = (object.instance.clone(), object.data_bytes);
        self.known.get(&of).map(String::as_str)
    }

    /// Notes that the peer has the object.
    pub(crate) fn note(&mut self, object: &ObjectFile) -> std::io::Result<()> {
        let date = chrono::Local::now().format("%Y-%m-%d").to_string();
        let of = (object.instance.clone(), object.data_bytes);
        let mut line = format!("{}\t{}\t{}\t{date}\n", self.peer, of.0, of.1);
        if self.known.insert(of, date.clone()).is_some_and(|before| before == date) {
            return Ok(());
        }
        let file = match &mut self.file {
            Some(file) => file,
            None => {
                let file = File::options().append(true).create(true).open(&self.path)?;
                // Ends a line that was cut short.
                if file.metadata()?.len() > 0 {
                    line.insert(0, '\n');
                }
                self.file.insert(file)
            }
        };
        file.write_all(line.as_bytes())
    }
}

/// How many objects of a folder an archive has acknowledged, as its record says.
pub fn acknowledged(folder: &Path, archive: &Node) -> usize {
    Journal::open(folder, archive).known.len()
}

/// The objects that whole lines say this peer has.
fn known(text: &str, peer: &str) -> BTreeMap<(String, u64), String> {
    let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
    let entry = |line: &str| {
        let mut fields = line.split('\t');
        let ours = fields.next()? == peer;
        let (instance, length) = (fields.next()?, fields.next()?.parse().ok()?);
        let date = fields.next().filter(|date| is_date(date))?;
        let whole = ours && fields.next().is_none();
        whole.then(|| ((instance.to_owned(), length), date.to_owned()))
    };
    whole.lines().filter_map(entry).collect()
}

/// Whether a text, which is shown, has the form `YYYY-MM-DD`.
fn is_date(text: &str) -> bool {
    let form =
        |(n, b): (usize, u8)| if matches!(n, 4 | 7) { b == b'-' } else { b.is_ascii_digit() };
    text.len() == 10 && text.bytes().enumerate().all(form)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_dicom::Owner;

    impl Journal {
        fn knows(&self, object: &ObjectFile) -> bool {
            self.acknowledged(object).is_some_and(is_date)
        }
    }

    fn object(instance: &str) -> ObjectFile {
        ObjectFile {
            path: PathBuf::new(),
            name: String::new(),
            class: String::new(),
            instance: instance.into(),
            syntax: String::new(),
            data_start: 0,
            data_bytes: 10,
            owner: Owner::default(),
            number: None,
            own: false,
            not_usable: false,
        }
    }

    #[test]
    fn what_is_noted_is_known_to_the_next_and_for_that_peer_only() {
        let folder = tempfile::tempdir().unwrap();
        let (a, b): (Node, Node) = ("A@host:104".parse().unwrap(), "B@host:104".parse().unwrap());
        let mut journal = Journal::open(folder.path(), &a);
        journal.note(&object("1.2")).unwrap();
        journal.note(&object("1.3")).unwrap();
        let next = Journal::open(folder.path(), &a);
        assert!(next.knows(&object("1.2")) && next.knows(&object("1.3")));
        assert!(!next.knows(&ObjectFile { data_bytes: 11, ..object("1.2") }), "it was changed");
        assert!(!Journal::open(folder.path(), &b).knows(&object("1.2")));
    }

    #[test]
    fn a_line_cut_short_counts_as_none_and_spoils_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let peer: Node = "A@host:104".parse().unwrap();
        let whole = "A@host:104\t1.2\t10\t2026-03-10\nA@host:104\t1.3\t10\t2026-03-1";
        std::fs::write(folder.path().join(JOURNAL), whole).unwrap();
        let mut journal = Journal::open(folder.path(), &peer);
        assert!(journal.knows(&object("1.2")) && !journal.knows(&object("1.3")));
        journal.note(&object("1.4")).unwrap();
        let next = Journal::open(folder.path(), &peer);
        assert!(next.knows(&object("1.2")) && next.knows(&object("1.4")));
        assert!(!next.knows(&object("1.3")), "its date was cut");
    }
}

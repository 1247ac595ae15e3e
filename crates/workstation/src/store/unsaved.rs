//! Changes of a case that no file holds: each is kept on disk, and offered when the program is
//! started there again.
//!
//! They are kept with the user's own settings, not among the patient's files, which may be
//! read-only: names are random, and only the owner may read them. A file beside each is locked by
//! the program that has it open; the lock ends with that program, however it ends.

use crate::Error;
use crate::names::name_of;
use crate::roots::Roots;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};
use supine_flow::CaseFile;

/// Which form the files have.
const FORM: u32 = 1;

/// What is kept of a case.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct Record {
    form: u32,
    /// The folder of the series or of the run that the case was made from.
    place: PathBuf,
    /// From where paths of the case lead.
    folder: PathBuf,
    /// The case, TOML.
    text: String,
    /// When it was changed last, seconds since 1970.
    changed: u64,
}

impl Record {
    pub(crate) fn case(&self) -> CaseFile {
        CaseFile::new(self.text.clone(), self.folder.clone())
    }

    pub(crate) fn place(&self) -> &Path {
        &self.place
    }

    fn read(path: &Path) -> Option<Self> {
        let record: Self = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        (record.form == FORM).then_some(record)
    }
}

/// The case that is open, as long as no file holds it.
#[derive(Debug)]
pub(crate) struct Draft {
    place: PathBuf,
    /// What it was when it was opened: without changes nothing is kept. None of a case that was
    /// kept before.
    first: Option<String>,
    file: Option<Locked>,
    /// Whether the file holds the case as it is now.
    is_current: bool,
}

/// A file that this program alone writes.
#[derive(Debug)]
struct Locked {
    path: PathBuf,
    _lock: File,
}

impl Draft {
    /// Nothing yet, of a case made from a series or a run.
    pub(crate) fn new(place: PathBuf, case: &CaseFile) -> Self {
        Self { place, first: Some(case.text().into()), file: None, is_current: false }
    }

    /// Whether the case as it is now is kept.
    pub(super) fn is_there(&self) -> bool {
        self.file.is_some() && self.is_current
    }

    /// Keeps the case as it is now; what was kept goes when no change is left.
    ///
    /// # Errors
    /// When it cannot be written. What was kept before stays, as on a full disk an older state is
    /// better than none.
    pub(super) fn keep(&mut self, dir: &Path, case: &CaseFile) -> io::Result<()> {
        self.is_current = false;
        if self.first.as_deref() == Some(case.text()) {
            self.file.take().into_iter().for_each(Locked::remove);
            return Ok(());
        }
        let file = match self.file.take() {
            Some(file) => file,
            None => Locked::new(dir)?,
        };
        self.file.insert(file).write(&self.place, case)?;
        self.is_current = true;
        Ok(())
    }

    /// The case has a file now, or is thrown away.
    pub(super) fn end(self) {
        self.file.into_iter().for_each(Locked::remove);
    }
}

impl Locked {
    fn new(dir: &Path) -> io::Result<Self> {
        make_own(dir)?;
        let mut bytes = [0; 8];
        getrandom::fill(&mut bytes).map_err(io::Error::other)?;
        let name: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        let path = dir.join(name).with_extension("json");
        Self::take(path)?.ok_or_else(|| io::ErrorKind::AlreadyExists.into())
    }

    /// A file that is there; none when another program has it.
    fn take(path: PathBuf) -> io::Result<Option<Self>> {
        let mut options = OpenOptions::new();
        options.write(true).create(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let lock = options.open(path.with_extension("lock"))?;
        match lock.try_lock() {
            Ok(()) => Ok(Some(Self { path, _lock: lock })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn write(&self, place: &Path, case: &CaseFile) -> io::Result<()> {
        let folder = case.spec().map_err(io::Error::other)?.folder().to_path_buf();
        let changed = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let (place, text) = (place.to_path_buf(), case.text().to_owned());
        let record = Record { form: FORM, place, folder, text, changed };
        // Temporary files are their owner's alone.
        let dir = self.path.parent().unwrap_or(Path::new(""));
        let mut file = tempfile::NamedTempFile::new_in(dir)?;
        file.write_all(&serde_json::to_vec(&record)?)?;
        file.as_file().sync_all()?;
        file.persist(&self.path)?;
        Ok(())
    }

    fn remove(self) {
        for path in [self.path.clone(), self.path.with_extension("lock")] {
            // What is left is offered again, and can be thrown away then.
            let _left = std::fs::remove_file(path);
        }
    }
}

/// A folder that its owner alone may look into.
fn make_own(dir: &Path) -> io::Result<()> {
    let mut builder = std::fs::DirBuilder::new();
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder.recursive(true).create(dir)
}

/// Where programs keep such things of the user whose process this is; none where the system names
/// no place.
pub(crate) fn usual_folder() -> Option<PathBuf> {
    let named =
        |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = match cfg!(windows) {
        true => named("LOCALAPPDATA"),
        false => named("XDG_STATE_HOME").or_else(|| Some(named("HOME")?.join(".local/state"))),
    };
    base.map(|base| base.join("supine").join("unsaved"))
}

/// Most cases that are kept, and for how long, s: half a year.
const MOST: usize = 100;
const LONGEST: u64 = 183 * 24 * 3600;

/// Removes what is kept for too long or beyond so many, the oldest first, but for what a program
/// has open; how many that were.
fn prune(dir: &Path) -> usize {
    let since = |at: SystemTime| at.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let entries = std::fs::read_dir(dir).into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let paths = paths.filter(|path| path.extension().is_some_and(|e| e == "json"));
    // What is damaged goes by its file's own time.
    let changed = |path: &PathBuf| match Record::read(path) {
        Some(record) => Some(record.changed),
        None => Some(since(std::fs::metadata(path).ok()?.modified().ok()?)),
    };
    let mut all: Vec<(u64, PathBuf)> =
        paths.filter_map(|path| Some((changed(&path)?, path))).collect();
    all.sort_by(|a, b| b.cmp(a));
    let now = since(SystemTime::now());
    let too_old = |changed: u64| now.saturating_sub(changed) > LONGEST;
    let gone =
        all.into_iter().enumerate().filter(|(n, (changed, _))| *n >= MOST || too_old(*changed));
    let locked = gone.filter_map(|(_, (_, path))| Locked::take(path).ok().flatten());
    locked.map(Locked::remove).count()
}

/// A case that was changed before and is in no file.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct UnsavedShown {
    id: String,
    /// The folder of the series or run that it was made from.
    name: String,
    /// When it was changed last, seconds since 1970.
    changed: u64,
}

/// What is kept in a folder of cases made from what lies below the roots, and no program has open,
/// the newest first.
fn offered(dir: &Path, roots: &Roots) -> Vec<UnsavedShown> {
    let entries = std::fs::read_dir(dir).into_iter().flatten();
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let paths = paths.filter(|path| path.extension().is_some_and(|e| e == "json"));
    let shown = paths.filter_map(|path| {
        let record = Record::read(&path)?;
        let below = roots.holds(&record.place);
        let free = below && Locked::take(path.clone()).is_ok_and(|taken| taken.is_some());
        let id = path.file_stem()?.to_str()?.to_owned();
        let (name, changed) = (name_of(&record.place), record.changed);
        free.then_some(UnsavedShown { id, name, changed })
    });
    let mut all: Vec<UnsavedShown> = shown.collect();
    all.sort_by(|a, b| (b.changed, &a.id).cmp(&(a.changed, &b.id)));
    all
}

/// The cases that are kept.
#[derive(Debug, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Unsaved {
    /// Where; without a folder none is.
    #[serde(skip)]
    dir: Option<PathBuf>,
    /// Those that were changed here before and are in no file.
    unsaved: Vec<UnsavedShown>,
    /// How many went at this start, since they were too old or too many.
    unsaved_gone: usize,
}

impl Unsaved {
    /// Keeps what no file holds in a folder from now on, and offers what is there.
    pub(super) fn keep_in(&mut self, dir: Option<PathBuf>, roots: &Roots) {
        self.unsaved_gone = dir.as_deref().map(prune).unwrap_or_default();
        self.dir = dir;
        self.refresh(roots);
    }

    pub(super) fn dir(&self) -> Option<&Path> {
        self.dir.as_deref()
    }

    /// Offers what is kept now.
    pub(super) fn refresh(&mut self, roots: &Roots) {
        self.unsaved = self.dir().map(|dir| offered(dir, roots)).unwrap_or_default();
    }

    /// The file of something that is offered.
    fn path(&self, id: &str) -> Option<PathBuf> {
        let is_offered = self.unsaved.iter().any(|one| one.id == id);
        let dir = self.dir().filter(|_| is_offered)?;
        Some(dir.join(id).with_extension("json"))
    }

    /// The case of something that is offered.
    pub(crate) fn case(&self, id: &str) -> Option<CaseFile> {
        Some(Record::read(&self.path(id)?)?.case())
    }

    /// Something that is offered, by its number, with what writes it from now on.
    ///
    /// # Errors
    /// When it is not offered, or another program has opened it since.
    pub(crate) fn take(&self, id: &str) -> Result<(Record, Draft), Error> {
        let path = self.path(id).ok_or(Error::NotBelow)?;
        let record = Record::read(&path).ok_or(Error::NotBelow)?;
        let dir = path.parent().unwrap_or(&path).to_path_buf();
        let taken = Locked::take(path).map_err(|source| Error::unreadable(&dir, source))?;
        let file = Some(taken.ok_or(Error::Busy)?);
        let draft = Draft { place: record.place.clone(), first: None, file, is_current: true };
        Ok((record, draft))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_kept_stays_when_a_change_cannot_be_kept() {
        let dir = tempfile::tempdir().unwrap();
        let case = |text: &str| CaseFile::new(text.into(), dir.path().to_path_buf());
        let mut kept = Draft::new(dir.path().into(), &case("breast = 'left'"));
        kept.keep(dir.path(), &case("breast = 'right'")).unwrap();
        let path = kept.file.as_ref().unwrap().path.clone();
        assert!(kept.is_there() && Record::read(&path).is_some());
        kept.keep(dir.path(), &case("breast = ")).unwrap_err();
        assert!(!kept.is_there(), "the last change is not kept");
        assert_eq!(Record::read(&path).unwrap().text, "breast = 'right'");
        kept.keep(dir.path(), &case("breast = 'left'")).unwrap();
        assert!(!kept.is_there() && !path.exists(), "no change is left");
    }

    #[test]
    fn what_is_kept_is_bounded_by_number_and_age_and_the_oldest_go() {
        let dir = tempfile::tempdir().unwrap();
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs();
        let write = |name: &str, changed: u64| {
            let (place, text) = (dir.path().to_path_buf(), "breast = 'left'".to_owned());
            let record = Record { form: FORM, folder: place.clone(), place, text, changed };
            let path = dir.path().join(name).with_extension("json");
            std::fs::write(&path, serde_json::to_vec(&record).unwrap()).unwrap();
            path
        };
        let opened = write("opened", now - 2 * LONGEST);
        let _open = Locked::take(opened.clone()).unwrap().unwrap();
        let old = write("old", now - LONGEST - 60);
        let paths: Vec<PathBuf> =
            (0..=MOST as u64).map(|n| write(&format!("{n}"), now - 60 * n)).collect();
        assert_eq!(prune(dir.path()), 2, "one is too old, one too many");
        assert!(!old.exists() && !paths[MOST].exists() && paths[MOST - 1].exists());
        assert!(opened.exists(), "a program has it open");
        assert_eq!(prune(dir.path()), 0);
        std::fs::write(dir.path().join("damaged.json"), "").unwrap();
        assert_eq!(prune(dir.path()), 1, "the newest is the damaged one, and one is too many");
    }
}

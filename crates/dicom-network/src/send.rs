//! C-STORE: objects to an archive, each as it stands in its file (PS3.4 Annex B).

use crate::Call;
use crate::cancel::GoOn;
use crate::command::{Command, element, field};
use crate::contexts::{MAX_CONTEXTS, Proposal};
use crate::error::Error;
use crate::journal::Journal;
use crate::link::Link;
use crate::message::{Payload, Talk};
use crate::patience::pause;
use crate::{mixed, status, syntaxes};
use dicom_dictionary_std::uids;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek as _, SeekFrom};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use supine_dicom::{ObjectFile, class_name, implicit_data_set, object_files, syntax_name};
use supine_space::{Progress, Warning};

/// What is sent, and what is not.
#[derive(Clone, Copy, Debug, Default)]
pub struct SendParams {
    /// Objects of every SOP class, not only CT, registrations, doses, structure sets,
    /// segmentations, PDFs.
    pub all: bool,
    /// Objects too that the peer has acknowledged in an earlier call.
    pub again: bool,
}

/// An object that the peer does not have, and why.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Refused {
    /// Path of the file below the folder that was given.
    pub file: String,
    /// Why, in words.
    pub reason: String,
}

/// What became of the objects.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct SendInfo {
    /// Objects the peer has acknowledged in this call.
    pub stored: usize,
    /// Objects it had acknowledged before, which were not sent. Whether it still has them it was
    /// not asked.
    pub known: usize,
    /// The dates of these acknowledgements, `YYYY-MM-DD` by the clock here.
    pub known_on: BTreeSet<String>,
    /// Objects that were sent and of which it says that it has them already (status 0111H).
    pub present: usize,
    /// Objects that were not sent because the association broke; a further call sends them.
    pub left: usize,
    /// Of them, those that were converted to Implicit VR Little Endian, since the peer takes no
    /// other.
    pub converted: usize,
    /// Bytes of the data sets that were acknowledged, as they stand in their files.
    pub bytes: u64,
    /// Associations that were opened.
    pub associations: usize,
    /// Objects the peer refuses, or that are not sent, and why.
    pub refused: Vec<Refused>,
    /// Files that are not DICOM, and so were left out.
    pub foreign: usize,
    /// Objects that were kept with a warning, and other things one has to know.
    #[serde(serialize_with = "crate::texts")]
    pub warnings: Vec<Warning>,
    /// Why the rest did not get through, when some are left.
    pub broken: Option<String>,
}

impl SendInfo {
    /// In words what was not sent since it was acknowledged before; `None` where there is none.
    pub fn known_in_words(&self) -> Option<String> {
        let (first, last) = (self.known_on.first()?, self.known_on.last()?);
        let count = self.known;
        Some(if first == last {
            format!("{count} acknowledged on {first}")
        } else {
            format!("{count} acknowledged between {first} and {last}")
        })
    }

    /// How many objects nothing more is to be done about.
    fn settled(&self) -> usize {
        self.stored + self.present + self.refused.len()
    }
}

/// Sends the objects below folders, or in files, to an archive.
///
/// After a broken association a new one is opened and goes on with what is not acknowledged; when
/// that was tried in vain, the objects that are left are counted and the reason is told.
///
/// # Errors
/// When nothing can be sent, the peer rejects us for good, or the user asked to stop. What was
/// acknowledged until then is on record.
pub fn send(
    paths: &[PathBuf],
    call: &Call,
    params: &SendParams,
    progress: Progress<'_>,
) -> Result<SendInfo, Error> {
    let mut info = SendInfo::default();
    let mut load = Load::gather(paths, call, params, &mut info, progress.part(0.0, 0.05))?;
    let total: u64 = load.waiting.iter().map(|w| w.object.data_bytes).sum();
    let moved = AtomicU64::new(0);
    let progress = progress.part(0.05, 1.0);
    let go_on = || -> Result<(), Error> {
        let moved = moved.load(Ordering::Relaxed);
        Ok(progress.at(moved as f64 / total.max(1) as f64)?)
    };
    let mut vain = 0;
    while !load.waiting.is_empty() {
        let before = info.settled();
        let outcome = load.one_association(call, &mut info, &moved, &go_on);
        let Err(error) = outcome else { continue };
        if !error.of_the_peer() {
            return Err(error);
        }
        vain = if info.settled() > before { 0 } else { vain + 1 };
        if vain > call.retries {
            let nothing = info.stored + info.present == 0;
            let error = if nothing { error.in_vain(call, "store") } else { error };
            if !error.of_the_peer() {
                return Err(error);
            }
            info.broken = Some(error.to_string());
            break;
        }
        pause(vain, &go_on)?;
    }
    info.left = load.waiting.len();
    go_on()?;
    Ok(info)
}

/// An object on its way, with the number of the journal it is noted in.
struct Waiting {
    object: ObjectFile,
    journal: usize,
}

struct Load {
    waiting: Vec<Waiting>,
    journals: Vec<Journal>,
    /// Whether it was said that a journal cannot be written.
    unwritable: bool,
}

impl Load {
    /// Finds what is to be sent.
    fn gather(
        paths: &[PathBuf],
        call: &Call,
        params: &SendParams,
        info: &mut SendInfo,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let mut load = Self { waiting: Vec::new(), journals: Vec::new(), unwritable: false };
        let mut seen: BTreeMap<String, ObjectFile> = BTreeMap::new();
        for path in paths {
            let files = object_files(path, progress)?;
            if files.objects.is_empty() {
                let left = files.damaged.first().or(files.foreign.first());
                let reason = left.map_or("the folder is empty".into(), |l| l.reason.to_string());
                return Err(Error::NothingToSend { path: path.clone(), found: reason });
            }
            info.foreign += files.foreign.len();
            let refused = |file: &str, reason: String| Refused { file: file.to_owned(), reason };
            info.refused
                .extend(files.damaged.into_iter().map(|d| refused(&d.file, d.reason.to_string())));
            let journal = load.journal(Journal::open(path, &call.peer));
            for object in files.objects {
                if let Some(first) = seen.get(&object.instance) {
                    mixed::same(first, &object)?;
                    let text = format!(" is the same object as {}: it is sent once", first.name);
                    info.warnings.push(Warning::new("sent-once", "").name(&object.name).text(text));
                    continue;
                }
                seen.insert(object.instance.clone(), object.clone());
                if !params.all && !syntaxes::KINDS.contains(&object.class.as_str()) {
                    let reason = format!("{}: sent only with --all", class_name(&object.class));
                    info.refused.push(refused(&object.name, reason));
                    continue;
                }
                let known = load.journals[journal].acknowledged(&object).filter(|_| !params.again);
                if let Some(date) = known {
                    info.known += 1;
                    info.known_on.insert(date.to_owned());
                } else {
                    load.waiting.push(Waiting { object, journal });
                }
            }
        }
        info.warnings.extend(mixed::check(seen.values())?);
        Ok(load)
    }

    /// The number of a journal: files of one folder share it.
    fn journal(&mut self, journal: Journal) -> usize {
        let at = self.journals.iter().position(|j| j.path == journal.path);
        at.unwrap_or_else(|| {
            self.journals.push(journal);
            self.journals.len() - 1
        })
    }

    /// Sends what one association can take, and takes out of `waiting` what is settled.
    fn one_association(
        &mut self,
        call: &Call,
        info: &mut SendInfo,
        moved: &AtomicU64,
        go_on: GoOn<'_>,
    ) -> Result<(), Error> {
        let kinds = self.kinds();
        let proposals: Vec<Proposal> =
            std::iter::once(Proposal::new(uids::VERIFICATION, &syntaxes::IDENTIFIER))
                .chain(kinds.iter().map(|(class, syntax)| Proposal::new(class, &[syntax])))
                .chain(implicit_too(&kinds))
                .collect();
        let link = Link::open(call, &proposals, go_on)?;
        info.associations += 1;
        let mut talk = Talk::new(link);
        echo(&mut talk, call)?;
        let mut at = 0;
        while at < self.waiting.len() {
            let Waiting { object, journal } = &self.waiting[at];
            if !kinds.contains(&(object.class.clone(), object.syntax.clone())) {
                // Not proposed on this association: on the next.
                at += 1;
                continue;
            }
            let (object, journal) = (object.clone(), *journal);
            let reason = match Body::open(&object, &talk.link) {
                Ok(body) => {
                    let converted = body.is_converted();
                    let answer = store(&mut talk, body, &object, moved)?;
                    let before = info.stored;
                    let reason = self.settle(answer, &object, journal, call, info)?;
                    info.converted += usize::from(converted && info.stored > before);
                    reason
                }
                // Nothing was sent of it yet.
                Err(reason) => Some(reason),
            };
            if let Some(reason) = reason {
                info.refused.push(Refused { file: object.name.clone(), reason });
            }
            self.waiting.remove(at);
        }
        // All is acknowledged: how the association ends is no matter.
        let _best_effort = talk.link.release();
        Ok(())
    }

    /// The pairs of class and transfer syntax that are proposed: Explicit VR Little Endian first.
    fn kinds(&self) -> Vec<(String, String)> {
        let mut kinds = Vec::new();
        for Waiting { object, .. } in &self.waiting {
            let kind = (object.class.clone(), object.syntax.clone());
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        kinds.sort_by_key(|(_, syntax)| syntax != uids::EXPLICIT_VR_LITTLE_ENDIAN);
        // A place for each pair, for its class in Implicit VR, and for C-ECHO.
        kinds.truncate((MAX_CONTEXTS - 1) / 2);
        kinds
    }

    /// Notes what the peer answered; the reason when it refuses the object.
    fn settle(
        &mut self,
        answer: Answer,
        object: &ObjectFile,
        journal: usize,
        call: &Call,
        info: &mut SendInfo,
    ) -> Result<Option<String>, Error> {
        let Answer { status: answer, instance } = answer;
        let words = status::words(answer);
        if status::is_transient(answer) {
            let (node, what) = (call.peer.clone(), "keep an object");
            return Err(Error::Failed { node, what, status: words, transient: true });
        }
        if instance.is_some_and(|instance| instance != object.instance) {
            return Ok(Some("the archive answers for another object than was sent".into()));
        }
        let told = |code, text: String| Warning::new(code, "").name(&object.name).text(text);
        if answer == status::DUPLICATE {
            // Not on record: whether that is the same object nobody has said.
            let text = ": an object of its SOP Instance UID is there already and was kept as it is";
            info.warnings.push(told("there-already", format!("{text} ({words})")));
            info.present += 1;
            return Ok(None);
        }
        if answer == status::NOT_AUTHORISED {
            let own = &call.own;
            return Ok(Some(format!("{words}: is the AE title {own} permitted to store there?")));
        }
        if answer != status::SUCCESS && !status::is_warning(answer) {
            return Ok(Some(words));
        }
        if answer != status::SUCCESS {
            info.warnings.push(told("stored-with-warning", format!(": {words}")));
        }
        info.stored += 1;
        info.bytes += object.data_bytes;
        let journal = &mut self.journals[journal];
        if let (Err(error), false) = (journal.note(object), self.unwritable) {
            self.unwritable = true;
            let path = journal.path.display().to_string();
            let text = format!(" cannot be written ({error}): a further call will send all again");
            info.warnings.push(Warning::new("journal-unwritable", "").name(path).text(text));
        }
        Ok(None)
    }
}

/// The default transfer syntax, which every archive takes (PS3.5 10.1), for what can be converted
/// to it.
fn implicit_too(kinds: &[(String, String)]) -> Vec<Proposal> {
    let implicit = uids::IMPLICIT_VR_LITTLE_ENDIAN;
    let stored = |class: &String| kinds.iter().any(|(c, s)| c == class && s == implicit);
    let explicit = kinds.iter().filter(|(_, s)| s == uids::EXPLICIT_VR_LITTLE_ENDIAN);
    let classes = explicit.map(|(class, _)| class).filter(|class| !stored(class));
    classes.map(|class| Proposal::new(class, &[implicit])).collect()
}

/// The data set of an object as it is sent, and in which context.
enum Body {
    /// As it stands in the file.
    File(u8, BufReader<File>, u64),
    /// Converted to Implicit VR Little Endian.
    Converted(u8, Vec<u8>),
}

impl Body {
    /// The data set in a transfer syntax that the peer takes; why there is none, in words.
    fn open(object: &ObjectFile, link: &Link<'_>) -> Result<Self, String> {
        if let Some((context, _)) = link.context(&object.class, Some(&object.syntax)) {
            let mut file = File::open(&object.path).map_err(|e| format!("cannot be read: {e}"))?;
            let start = SeekFrom::Start(object.data_start);
            file.seek(start).map_err(|e| format!("cannot be read: {e}"))?;
            return Ok(Self::File(
                context,
                BufReader::with_capacity(256 << 10, file),
                object.data_bytes,
            ));
        }
        let convertible = object.syntax == uids::EXPLICIT_VR_LITTLE_ENDIAN;
        let implicit = link.context(&object.class, Some(uids::IMPLICIT_VR_LITTLE_ENDIAN));
        let (true, Some((context, _))) = (convertible, implicit) else {
            let (class, syntax) = (class_name(&object.class), syntax_name(&object.syntax));
            if link.untaken.contains(&object.class) {
                let default = syntax_name(uids::IMPLICIT_VR_LITTLE_ENDIAN);
                return Err(format!("{} takes no {class}, not even in {default}", link.peer));
            }
            return Err(format!("{} takes no {class} in {syntax}", link.peer));
        };
        let bytes = implicit_data_set(object).map_err(|why| {
            format!("{} wants it in Implicit VR Little Endian, which cannot be: {why}", link.peer)
        })?;
        Ok(Self::Converted(context, bytes))
    }

    fn is_converted(&self) -> bool {
        matches!(self, Self::Converted(..))
    }
}

/// C-ECHO (PS3.4 Annex A), where the peer offers it.
fn echo(talk: &mut Talk<'_>, call: &Call) -> Result<(), Error> {
    let Some((context, _)) = talk.link.context(uids::VERIFICATION, None) else { return Ok(()) };
    let id = talk.next_id();
    talk.send(context, &Command::request(field::ECHO, id, uids::VERIFICATION, false), None)?;
    let Answer { status: answer, .. } = answer_to(talk, field::ECHO, id)?;
    if answer == status::SUCCESS {
        return Ok(());
    }
    let (node, what) = (call.peer.clone(), "answer C-ECHO");
    Err(Error::Failed { node, what, status: status::words(answer), transient: false })
}

/// What a peer answers.
struct Answer {
    status: u16,
    /// The SOP Instance UID it answers for, where it says that.
    instance: Option<String>,
}

/// The answer to a request.
fn answer_to(talk: &mut Talk<'_>, asked: u16, id: u16) -> Result<Answer, Error> {
    let command = talk.answer()?.command;
    let of = command.get_number(element::MESSAGE_ID_RESPONDED_TO);
    let instance = command.get_text(element::AFFECTED_SOP_INSTANCE).to_owned();
    let instance = Some(instance).filter(|instance| !instance.is_empty());
    match command.get_number(element::STATUS) {
        Some(status) if command.field() == asked | field::ANSWER && of == Some(id) => {
            Ok(Answer { status, instance })
        }
        _ => Err(talk.link.protocol("an answer to something else than was asked")),
    }
}

/// Sends one object; the peer's answer.
fn store(
    talk: &mut Talk<'_>,
    body: Body,
    object: &ObjectFile,
    moved: &AtomicU64,
) -> Result<Answer, Error> {
    let (context, inner, length): (u8, Box<dyn Read>, u64) = match body {
        Body::File(context, file, length) => (context, Box::new(file), length),
        Body::Converted(context, bytes) => {
            let length = bytes.len() as u64;
            (context, Box::new(Cursor::new(bytes)), length)
        }
    };
    let mut data = Counted { inner, moved, read: 0 };
    let id = talk.next_id();
    let request = Command::request(field::STORE, id, &object.class, true)
        .number(element::PRIORITY, 0)
        .text(element::AFFECTED_SOP_INSTANCE, &object.instance);
    let outcome = talk
        .send(context, &request, Some(Payload { reader: &mut data, length }))
        .and_then(|()| answer_to(talk, field::STORE, id));
    if outcome.is_err() {
        // It will be sent from its beginning.
        moved.fetch_sub(data.read, Ordering::Relaxed);
    }
    outcome
}

/// Counts what is read.
struct Counted<'a, R> {
    inner: R,
    moved: &'a AtomicU64,
    read: u64,
}

impl<R: Read> Read for Counted<'_, R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.read += read as u64;
        self.moved.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

//! Objects that arrive: each under a temporary name until it is whole and sound (PS3.4 B, as SCP).

use crate::command::{Command, element};
use crate::contexts::Context;
use crate::error::Error;
use crate::expected::{Expected, Strangers};
use crate::message::{Message, Talk};
use crate::status;
use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use supine_dicom::{LeftOutReason, Owner, file_header, is_uid, object_files};
use supine_space::{Progress, Warning};
use tempfile::NamedTempFile;

/// Largest data set that is kept, bytes: what this software reads.
const MAX_OBJECT: u64 = 1 << 30;
/// Most problems that are told: a peer may make any number.
const MAX_PROBLEMS: usize = 100;
/// Name of a file while it comes in.
const TEMPORARY: &str = ".supine-incoming-";

/// The folder objects arrive in.
#[derive(Debug)]
pub(crate) struct Inbox {
    folder: PathBuf,
    /// Where what is asked for belongs.
    expected: Expected,
    /// SOP Instance UIDs that were asked for and are not here.
    pub(crate) missing: BTreeSet<String>,
    /// How many have arrived.
    pub(crate) received: usize,
    /// Bytes of their data sets.
    pub(crate) bytes: u64,
    /// What was not kept, and why.
    pub(crate) problems: Vec<Warning>,
    /// What came and belongs elsewhere.
    pub(crate) strangers: Vec<Strangers>,
    /// SOP Instance UIDs under which only that came: not asked for again, but taken where the right
    /// one comes too.
    refused: BTreeSet<String>,
}

/// The name of an instance's file, which carries nothing of the patient.
pub(crate) fn file_name(instance: &str) -> String {
    format!("{instance}.dcm")
}

/// Why a file is not kept.
enum Unfit {
    /// It is another instance than announced: why that is known.
    Another(String),
    /// It is no sound object: why.
    Unsound(String),
}

/// Where the object of a file belongs, if it is a sound one and this instance.
fn holds(path: &Path, instance: &str) -> Result<Owner, Unfit> {
    let files = object_files(path, Progress::none()).map_err(|e| Unfit::Unsound(e.to_string()))?;
    match (&files.objects[..], files.damaged.first().map(|damaged| &damaged.reason)) {
        ([object], _) if object.instance == instance => Ok(object.owner.clone()),
        ([_], _) => Err(Unfit::Another("it is another instance than announced".into())),
        // The file header is ours and names what was announced.
        (_, Some(reason @ LeftOutReason::TwoNames)) => Err(Unfit::Another(reason.to_string())),
        (_, Some(reason)) => Err(Unfit::Unsound(reason.to_string())),
        _ => Err(Unfit::Unsound("it is no object".into())),
    }
}

impl Inbox {
    /// An inbox of which nothing is missing yet.
    pub(crate) fn new(folder: &Path, expected: Expected) -> Self {
        Self {
            folder: folder.to_owned(),
            expected,
            missing: BTreeSet::new(),
            received: 0,
            bytes: 0,
            problems: Vec::new(),
            strangers: Vec::new(),
            refused: BTreeSet::new(),
        }
    }

    /// Whether the file of an instance is there and whole, and belongs where it was listed; else it
    /// is missing.
    pub(crate) fn is_here(&mut self, instance: &str) -> bool {
        let path = self.folder.join(file_name(instance));
        let owner = if path.is_file() { holds(&path, instance).ok() } else { None };
        match owner {
            Some(owner) if self.expected.elsewhere(instance, &owner).is_none() => {
                self.expected.kept(&owner);
                true
            }
            _ => {
                self.missing.insert(instance.to_owned());
                false
            }
        }
    }

    /// Tells of files that were there before, have the name of what was asked for and belong
    /// elsewhere.
    pub(crate) fn tell_strangers_in_the_folder(&mut self) {
        let mut told = Vec::new();
        for instance in self.refused.iter().chain(&self.missing) {
            let path = self.folder.join(file_name(instance));
            let Ok(owner) = holds(&path, instance) else { continue };
            if let Some(of) = self.expected.elsewhere(instance, &owner) {
                let name = path.display();
                let text = format!("{name} was there before and is of {of}: remove it");
                told.push(Warning::new("object-of-another", text));
            }
        }
        told.into_iter().for_each(|problem| self.tell(problem));
    }

    /// Notes what went wrong, once.
    pub(crate) fn tell(&mut self, problem: Warning) {
        if self.problems.len() < MAX_PROBLEMS && !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }

    fn is_wanted(&self, instance: &str) -> bool {
        self.missing.contains(instance) || self.refused.contains(instance)
    }

    /// What is answered to an object that is not wanted.
    fn unwanted(&mut self, instance: &str) -> u16 {
        // Sent twice is no fault of the peer's; anything else nobody asked for.
        if is_uid(instance) && self.folder.join(file_name(instance)).exists() {
            return status::SUCCESS;
        }
        let text = "an object came that was not asked for";
        self.tell(Warning::new("object-not-asked-for", text));
        status::NOT_AUTHORISED
    }

    /// Gives what came its name, if it is what was asked for; the status to answer with.
    fn keep(&mut self, instance: &str, came: Came) -> Result<u16, Error> {
        if !self.is_wanted(instance) {
            // It came on another association meanwhile.
            return Ok(self.unwanted(instance));
        }
        let owner = match holds(came.file.path(), instance) {
            Ok(owner) => owner,
            Err(unfit) => return Ok(self.refuse(instance, unfit)),
        };
        if let Some(of) = self.expected.elsewhere(instance, &owner) {
            // What an archive has under this name is not what was asked for: it is not asked for
            // again.
            self.missing.remove(instance);
            if self.refused.insert(instance.to_owned()) {
                Strangers::count(&mut self.strangers, of, instance, &owner);
            }
            return Ok(status::DOES_NOT_MATCH);
        }
        self.expected.kept(&owner);
        let path = self.folder.join(file_name(instance));
        came.file.persist(&path).map_err(|e| Error::Write { path, source: e.error })?;
        self.missing.remove(instance);
        self.refused.remove(instance);
        self.received += 1;
        self.bytes += came.bytes;
        Ok(status::SUCCESS)
    }

    /// Notes that an object is not kept; the status to answer with.
    fn refuse(&mut self, instance: &str, unfit: Unfit) -> u16 {
        let (reason, status) = match unfit {
            Unfit::Another(reason) => (reason, status::DOES_NOT_MATCH),
            Unfit::Unsound(reason) => (reason, status::CANNOT_UNDERSTAND),
        };
        let text = format!("{instance} is not kept: {reason}");
        self.tell(Warning::new("object-not-kept", text));
        status
    }
}

/// Takes the object of a C-STORE request and answers it; how many have arrived. The inbox is free
/// for others while the object comes in, which may take its sender as long as it likes.
pub(crate) fn take(
    inbox: &Mutex<&mut Inbox>,
    talk: &mut Talk<'_>,
    message: &Message,
) -> Result<usize, Error> {
    let instance = message.command.get_text(element::AFFECTED_SOP_INSTANCE).to_owned();
    let class = message.command.get_text(element::AFFECTED_SOP_CLASS).to_owned();
    let context = talk.link.contexts.get(&message.context).cloned();
    let context = context.filter(|c| c.class == class && message.command.has_data_set());
    let (folder, wanted) = {
        let inbox = lock(inbox);
        (inbox.folder.clone(), is_uid(&instance) && inbox.is_wanted(&instance))
    };
    let came = match context {
        Some(context) if wanted => Some(receive(&folder, talk, message, &context, &instance)?),
        _ => {
            if message.command.has_data_set() {
                talk.data(message, MAX_OBJECT, &mut |_| {})?;
            }
            None
        }
    };
    let (status, received) = {
        let mut inbox = lock(inbox);
        let status = match came {
            Some(came) => inbox.keep(&instance, came)?,
            None => inbox.unwanted(&instance),
        };
        (status, inbox.received)
    };
    talk.send(message.context, &Command::answer(&message.command, status), None)?;
    Ok(received)
}

/// What came, under a temporary name.
struct Came {
    file: NamedTempFile,
    /// Length of its data set.
    bytes: u64,
}

/// Writes an object to a file that is gone when it is dropped.
fn receive(
    folder: &Path,
    talk: &mut Talk<'_>,
    message: &Message,
    context: &Context,
    instance: &str,
) -> Result<Came, Error> {
    let write_error = |source| Error::Write { path: folder.to_owned(), source };
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // As files are that programs make: the user's mask decides, not the temporary file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(write_error)?;
    let header = file_header(&context.class, instance, &context.syntax);
    let mut written = file.write_all(&header);
    let bytes = talk.data(message, MAX_OBJECT, &mut |piece| {
        if written.is_ok() {
            written = file.write_all(piece);
        }
    })?;
    if let Err(source) = written.and_then(|()| file.flush()) {
        let refusal = Command::answer(&message.command, status::OUT_OF_RESOURCES);
        let _best_effort = talk.send(message.context, &refusal, None);
        return Err(write_error(source));
    }
    Ok(Came { file, bytes })
}

/// What a mutex guards; a thread that panicked leaves the inbox as whole as its files are.
pub(crate) fn lock<T>(guarded: &Mutex<T>) -> MutexGuard<'_, T> {
    guarded.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

//! C-GET and C-MOVE: the instances that are missing in a folder (PS3.4 C.4.2, C.4.3, Study Root).

use crate::Call;
use crate::command::{Command, element, field};
use crate::contexts::{MAX_CONTEXTS, Proposal};
use crate::error::Error;
use crate::expected::{Expected, Strangers};
use crate::find::{Finder, Found, InstanceEntry, QuerySpec};
use crate::go_on::GoOn;
use crate::inbox::Inbox;
use crate::link::Link;
use crate::listener::Listener;
use crate::message::{Payload, Talk};
use crate::node::Title;
use crate::send::pause;
use crate::{status, syntaxes};
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use std::collections::{BTreeMap, BTreeSet};
use std::net::IpAddr;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_dicom::Identifier;
use supine_space::{Progress, Warning};

/// Most instances that one request names, bytes of UIDs below what fits in one value (64 KiB).
const AT_ONCE: usize = 200;
/// Longest list of failed instances in an answer that is taken, bytes.
const MAX_FAILED_LIST: u64 = 16 << 20;

/// How objects come.
#[derive(Clone, Debug, Default)]
pub enum Way {
    /// On the association we open: no port is open here.
    #[default]
    Get,
    /// On an association the archive opens to us; it must know our title, address and port.
    Move {
        /// The title the archive knows us by as a receiver.
        title: Title,
        /// The address to listen on; by default the one by which the archive is reached.
        bind: Option<IpAddr>,
        /// The port to listen on.
        port: u16,
    },
}

/// What has arrived.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct FetchInfo {
    /// Study Instance UID.
    pub study: String,
    /// Instances that arrived in this call.
    pub received: usize,
    /// Instances that were in the folder before.
    pub known: usize,
    /// Bytes of the data sets that arrived.
    pub bytes: u64,
    /// SOP Instance UIDs that the archive lists and that did not arrive.
    pub missing: Vec<String>,
    /// What the archive sent in their place and belongs to another patient, study, series or date.
    pub strangers: Vec<Strangers>,
    /// Associations that were opened to retrieve, not counting those for queries.
    pub associations: usize,
    /// What was not kept, and other things one has to know.
    #[serde(serialize_with = "crate::texts")]
    pub warnings: Vec<Warning>,
    /// Why the rest did not arrive, when some are missing for a reason that may pass.
    pub broken: Option<String>,
}

/// The instances of one series that are meant.
#[derive(Debug)]
struct Part {
    study: String,
    series: String,
    instances: Vec<InstanceEntry>,
}

/// Retrieves what is meant and not yet in the folder `out`, each instance in a file of its own.
///
/// # Errors
/// When nothing or more than one study is meant, the peer does not offer what is needed, a file cannot
/// be written, or the user asked to stop. What arrived until then stays.
pub fn fetch(
    call: &Call,
    spec: &QuerySpec,
    way: &Way,
    out: &Path,
    progress: Progress<'_>,
) -> Result<FetchInfo, Error> {
    std::fs::create_dir_all(out).map_err(|source| Error::Write { path: out.into(), source })?;
    let (arrived, total) = (AtomicUsize::new(0), AtomicUsize::new(1));
    let go_on = || -> Result<(), Error> {
        let share = arrived.load(Ordering::Relaxed) as f64 / total.load(Ordering::Relaxed) as f64;
        Ok(progress.at(share)?)
    };
    let mut info = FetchInfo::default();
    let (parts, expected) = patiently(call, &go_on, || plan(call, spec, &go_on))?;
    info.study.clone_from(&expected.study);
    let mut inbox = Inbox::new(out, expected);
    for entry in parts.iter().flat_map(|part| &part.instances) {
        go_on()?;
        info.known += usize::from(inbox.is_here(&entry.instance));
    }
    total.store(inbox.missing.len().max(1), Ordering::Relaxed);
    let mut vain = 0;
    while !inbox.missing.is_empty() {
        let before = inbox.missing.len();
        let round = Round { call, parts: &parts, arrived: &arrived, go_on: &go_on };
        let outcome = match way {
            Way::Get => round.by_get(&mut inbox, &mut info),
            Way::Move { title, bind, port } => {
                round.by_move(&mut inbox, &mut info, title, *bind, *port)
            }
        };
        let progressed = inbox.missing.len() < before;
        info.broken = outcome.as_ref().err().map(ToString::to_string);
        vain = if progressed { 0 } else { vain + 1 };
        match outcome {
            Ok(()) if progressed => {}
            // Asked in good order and nothing came: it will not come.
            Ok(()) => break,
            // Archives end a request as failed when one object of it failed, or was refused here: the others on another
            // association.
            Err(Error::Failed { .. }) if progressed => {}
            Err(error) if !error.of_the_peer() => {
                return Err(because(error, &inbox.problems));
            }
            Err(_) if vain > call.retries => break,
            Err(_) => pause(vain, &go_on)?,
        }
    }
    inbox.tell_strangers_in_the_folder();
    (info.received, info.bytes) = (inbox.received, inbox.bytes);
    info.strangers = inbox.strangers;
    info.missing = inbox.missing.into_iter().collect();
    inbox.problems.dedup();
    info.warnings.extend(inbox.problems);
    Ok(info)
}

/// A failure with what went wrong here first, which may be why the archive fails.
fn because(error: Error, problems: &[Warning]) -> Error {
    match (error, problems.first()) {
        (Error::Failed { node, what, status, transient }, Some(problem)) => {
            Error::Failed { node, what, status: format!("{status}; here: {problem}"), transient }
        }
        (error, _) => error,
    }
}

/// Tries again what failed for a reason that may pass.
fn patiently<T>(
    call: &Call,
    go_on: GoOn<'_>,
    mut work: impl FnMut() -> Result<T, Error>,
) -> Result<T, Error> {
    let mut vain = 0;
    loop {
        match work() {
            Err(error) if error.of_the_peer() && vain < call.retries => vain += 1,
            outcome => return outcome,
        }
        pause(vain, go_on)?;
    }
}

/// What the archive lists of what is meant, and where that belongs.
fn plan(call: &Call, spec: &QuerySpec, go_on: GoOn<'_>) -> Result<(Vec<Part>, Expected), Error> {
    let mut finder = Finder::open(call, go_on)?;
    let studies = finder.studies(spec)?;
    let [Found { entry: study, patient }] = &studies[..] else {
        finder.close();
        return Err(Error::Query(not_one(call, spec, &studies)));
    };
    let asked = spec.patient_id.clone();
    let patient = asked.or_else(|| Some(patient.clone()).filter(|id| !id.is_empty()));
    let mut expected = Expected {
        patient,
        study: study.study.clone(),
        date: spec.date.clone(),
        series: BTreeMap::new(),
    };
    let mut parts = Vec::new();
    for entry in &study.series {
        let instances = finder.instances(&study.study, &entry.series)?;
        for InstanceEntry { instance, .. } in &instances {
            expected.series.entry(instance.clone()).or_default().push(entry.series.clone());
        }
        let (study, series) = (study.study.clone(), entry.series.clone());
        parts.push(Part { study, series, instances });
    }
    finder.close();
    if parts.iter().all(|part| part.instances.is_empty()) {
        return Err(Error::Query(format!("{} lists no instances of that", call.peer)));
    }
    Ok((parts, expected))
}

/// Why it is not clear which study is meant, and what to do.
fn not_one(call: &Call, spec: &QuerySpec, studies: &[Found]) -> String {
    let Some(first) = studies.first() else {
        let alone = spec.series.is_some() && spec.study.is_none();
        let advice = if alone { "; name its study too, with --study" } else { "" };
        return format!("{} lists nothing of that{advice}", call.peer);
    };
    let uid = &first.entry.study;
    if studies.iter().all(|found| found.entry.study == *uid) {
        let (peer, count) = (&call.peer, studies.len());
        return format!(
            "{peer} lists the study {uid} for {count} patients: name the one who is meant with --patient-id"
        );
    }
    let uids: Vec<String> =
        studies.iter().map(|f| format!("\n  {} of {}", f.entry.study, f.entry.date)).collect();
    format!("several studies, choose one with --study:{}", uids.concat())
}

/// One association that asks for what is missing.
struct Round<'a> {
    call: &'a Call,
    parts: &'a [Part],
    arrived: &'a AtomicUsize,
    go_on: GoOn<'a>,
}

impl Round<'_> {
    fn by_get(&self, inbox: &mut Inbox, info: &mut FetchInfo) -> Result<(), Error> {
        let model = uids::STUDY_ROOT_QUERY_RETRIEVE_INFORMATION_MODEL_GET;
        let mut proposals = vec![Proposal::new(model, &syntaxes::IDENTIFIER)];
        // A context for each class and syntax: one with several would leave us only one of them.
        for class in self.classes(&inbox.missing) {
            for syntax in syntaxes::OBJECT {
                let receives = true;
                proposals.push(Proposal { receives, ..Proposal::new(&class, &[syntax]) });
            }
        }
        proposals.truncate(MAX_CONTEXTS);
        let link = Link::open(self.call, &proposals, self.go_on)?;
        info.associations += 1;
        let receives = link.contexts.values().any(|c| c.class != model);
        let (Some((context, agreed)), true) = (link.context(model, None), receives) else {
            let what = "C-GET of these objects; try --move-to".into();
            return Err(Error::NotOffered { node: self.call.peer.clone(), what });
        };
        let explicit = agreed.syntax == uids::EXPLICIT_VR_LITTLE_ENDIAN;
        let mut talk = Talk::new(link);
        for keys in self.requests(&inbox.missing) {
            let request = Request { field: field::GET, model, context, explicit, keys: &keys };
            let id = request.send(&mut talk, None)?;
            loop {
                let message = talk.answer()?;
                if message.command.field() == field::STORE {
                    inbox.take(&mut talk, &message)?;
                    self.arrived.store(inbox.received, Ordering::Relaxed);
                } else if self.ended(&mut talk, &message, field::GET, id, info)? {
                    break;
                }
            }
        }
        let _best_effort = talk.link.release();
        Ok(())
    }

    fn by_move(
        &self,
        inbox: &mut Inbox,
        info: &mut FetchInfo,
        title: &Title,
        bind: Option<IpAddr>,
        port: u16,
    ) -> Result<(), Error> {
        let model = uids::STUDY_ROOT_QUERY_RETRIEVE_INFORMATION_MODEL_MOVE;
        let link =
            Link::open(self.call, &[Proposal::new(model, &syntaxes::IDENTIFIER)], self.go_on)?;
        info.associations += 1;
        let Some((context, agreed)) = link.context(model, None) else {
            let what = "C-MOVE in the Study Root model".into();
            return Err(Error::NotOffered { node: self.call.peer.clone(), what });
        };
        let explicit = agreed.syntax == uids::EXPLICIT_VR_LITTLE_ENDIAN;
        let address = match bind {
            Some(address) => address,
            None => link.local_address()?,
        };
        let requests = self.requests(&inbox.missing);
        let inbox = Mutex::new(inbox);
        let listener = Listener::open(address, port, title, self.call)?;
        listener.while_open(&inbox, self.arrived, self.go_on, |go_on| {
            let mut talk = Talk::new(link);
            for keys in &requests {
                let request = Request { field: field::MOVE, model, context, explicit, keys };
                let id = request.send(&mut talk, Some(title))?;
                loop {
                    go_on()?;
                    let message = talk.answer()?;
                    if self.ended(&mut talk, &message, field::MOVE, id, info)? {
                        break;
                    }
                }
            }
            let _best_effort = talk.link.release();
            Ok(())
        })
    }

    /// The SOP classes of what is missing; those of a planning CT where the archive does not say.
    fn classes(&self, missing: &BTreeSet<String>) -> Vec<String> {
        let entries = self.parts.iter().flat_map(|part| &part.instances);
        let mut classes: Vec<String> = entries
            .filter(|entry| missing.contains(&entry.instance))
            .map(|entry| entry.class.clone())
            .collect();
        classes.sort();
        classes.dedup();
        if classes.iter().any(String::is_empty) {
            classes.retain(|class| !class.is_empty());
            classes.extend(syntaxes::KINDS.map(String::from));
            classes.sort();
            classes.dedup();
        }
        classes
    }

    /// The keys of each request: a series of which nothing is here as a whole, else single instances.
    fn requests(&self, missing: &BTreeSet<String>) -> Vec<Vec<(Tag, String)>> {
        let mut requests = Vec::new();
        for Part { study, series, instances } in self.parts {
            let wanted: Vec<&str> = instances
                .iter()
                .map(|entry| entry.instance.as_str())
                .filter(|instance| missing.contains(*instance))
                .collect();
            let keys = |level: &str| {
                vec![
                    (tags::QUERY_RETRIEVE_LEVEL, level.to_owned()),
                    (tags::STUDY_INSTANCE_UID, study.clone()),
                    (tags::SERIES_INSTANCE_UID, series.clone()),
                ]
            };
            if wanted.len() == instances.len() && !wanted.is_empty() {
                requests.push(keys("SERIES"));
                continue;
            }
            for some in wanted.chunks(AT_ONCE) {
                let mut keys = keys("IMAGE");
                keys.push((tags::SOP_INSTANCE_UID, some.join("\\")));
                requests.push(keys);
            }
        }
        requests
    }

    /// Whether an answer is the last of a request; an error when the request failed.
    fn ended(
        &self,
        talk: &mut Talk<'_>,
        message: &crate::message::Message,
        asked: u16,
        id: u16,
        info: &mut FetchInfo,
    ) -> Result<bool, Error> {
        let command = &message.command;
        let of = command.get_number(element::MESSAGE_ID_RESPONDED_TO);
        let (true, Some(answer)) = (
            command.field() == asked | field::ANSWER && of == Some(id),
            command.get_number(element::STATUS),
        ) else {
            return Err(talk.link.protocol("an answer to something else than was asked"));
        };
        if command.has_data_set() {
            talk.data(message, MAX_FAILED_LIST, &mut |_| {})?;
        }
        if status::PENDING.contains(&answer) {
            return Ok(false);
        }
        if answer == status::SUCCESS || status::is_warning(answer) {
            let failed = command.get_number(element::FAILED).unwrap_or_default();
            if failed > 0 {
                let node = &self.call.peer;
                let text = format!("{node} says that {failed} transfers failed");
                info.warnings.push(Warning::new("transfers-failed", text));
            }
            return Ok(true);
        }
        Err(Error::Failed {
            node: self.call.peer.clone(),
            what: "send what it lists",
            status: status::words(answer),
            transient: status::is_transient(answer),
        })
    }
}

/// A request to retrieve.
struct Request<'a> {
    field: u16,
    model: &'a str,
    context: u8,
    explicit: bool,
    keys: &'a [(Tag, String)],
}

impl Request<'_> {
    /// Sends it, to a destination for C-MOVE; its number.
    fn send(&self, talk: &mut Talk<'_>, destination: Option<&Title>) -> Result<u16, Error> {
        let identifier =
            self.keys.iter().fold(Identifier::default(), |set, (tag, value)| set.with(*tag, value));
        let bytes = identifier.to_bytes(self.explicit);
        let id = talk.next_id();
        let mut command =
            Command::request(self.field, id, self.model, true).number(element::PRIORITY, 0);
        if let Some(title) = destination {
            command = command.text(element::MOVE_DESTINATION, title.as_str());
        }
        talk.send(self.context, &command, Some(Payload::of(&mut &bytes[..])))?;
        Ok(id)
    }
}

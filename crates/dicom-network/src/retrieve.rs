//! The requests of a retrieval, C-GET and C-MOVE (PS3.4 C.4.2, C.4.3, Study Root).

use crate::Call;
use crate::cancel::GoOn;
use crate::command::{Command, element, field};
use crate::contexts::{MAX_CONTEXTS, Proposal};
use crate::error::Error;
use crate::expected::Strangers;
use crate::find::InstanceEntry;
use crate::inbox::{self, Inbox};
use crate::link::Link;
use crate::listener::Listener;
use crate::message::{Message, Payload, Talk};
use crate::node::Title;
use crate::{status, syntaxes};
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use std::collections::BTreeSet;
use std::net::IpAddr;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_dicom::{Identifier, class_name};
use supine_space::Warning;

/// Most instances that one request names, bytes of UIDs below what fits in one value (64 KiB).
const AT_ONCE: usize = 200;
/// Longest list of failed instances in an answer that is taken, bytes.
const MAX_FAILED_LIST: u64 = 16 << 20;

/// Most answers that only say that more is to come while nothing comes: an archive that says it
/// once a second may take hours.
const MAX_PENDING: usize = 10_000;

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
    /// Why the rest did not arrive, when trying again will not help.
    pub failed: Option<String>,
}

/// The instances of one series that are meant.
#[derive(Debug)]
pub(crate) struct Part {
    pub(crate) study: String,
    pub(crate) series: String,
    pub(crate) instances: Vec<InstanceEntry>,
}

/// What is asked for, association after association, until nothing is missing.
pub(crate) struct Retrieval<'a> {
    call: &'a Call,
    parts: &'a [Part],
    arrived: &'a AtomicUsize,
    go_on: GoOn<'a>,
    /// Instances of which each is asked for by itself, since a request for several failed.
    singly: BTreeSet<String>,
    /// Classes that the archive does not send by C-GET; the empty one stands for what it does not
    /// say.
    unsent: BTreeSet<String>,
    /// How a request failed last that failed for objects of it.
    pub(crate) failure: Option<Error>,
    /// Whether one that asked for a single object was among them, in the last round.
    singly_failed: bool,
}

/// One request: what it names, and the instances that are to come.
struct Request {
    keys: Vec<(Tag, String)>,
    instances: Vec<String>,
}

/// How requests are made on an association.
struct Asking<'a> {
    field: u16,
    model: &'a str,
    context: u8,
    explicit: bool,
    destination: Option<&'a Title>,
}

/// The last answer to a request.
struct Ended {
    status: u16,
    /// Objects that did not get through.
    failed: u16,
    /// Objects that did.
    completed: u16,
}

impl<'a> Retrieval<'a> {
    pub(crate) fn new(
        call: &'a Call,
        parts: &'a [Part],
        arrived: &'a AtomicUsize,
        go_on: GoOn<'a>,
    ) -> Self {
        let (singly, unsent) = (BTreeSet::new(), BTreeSet::new());
        Self { call, parts, arrived, go_on, singly, unsent, failure: None, singly_failed: false }
    }

    /// How many instances are asked for by themselves: more of them is a step on, though nothing
    /// came.
    pub(crate) fn asked_singly(&self) -> usize {
        self.singly.len()
    }

    /// Asks once for all that is missing by C-GET, on as many associations as its classes need.
    pub(crate) fn by_get(&mut self, inbox: &mut Inbox, info: &mut FetchInfo) -> Result<(), Error> {
        self.singly_failed = false;
        let classes = self.classes(&inbox.missing);
        let mut any = classes.is_empty();
        for group in groups(&classes) {
            any |= self.get_of(group, inbox, info)?;
        }
        if any {
            return self.all_asked();
        }
        let what = "C-GET of these objects; try --move-to".into();
        Err(Error::NotOffered { node: self.call.peer.clone(), what })
    }

    /// Asks for what is missing of some classes; whether the archive offers any of them.
    fn get_of(
        &mut self,
        classes: &[String],
        inbox: &mut Inbox,
        info: &mut FetchInfo,
    ) -> Result<bool, Error> {
        let model = uids::STUDY_ROOT_QUERY_RETRIEVE_INFORMATION_MODEL_GET;
        let proposals: Vec<Proposal> = std::iter::once(Proposal::new(model, &syntaxes::IDENTIFIER))
            .chain(proposed(classes).into_iter().flat_map(receiving))
            .collect();
        let link = Link::open(self.call, &proposals, self.go_on)?;
        info.associations += 1;
        let Some((context, agreed)) = link.context(model, None) else {
            let what = "C-GET in the Study Root model; try --move-to".into();
            return Err(Error::NotOffered { node: self.call.peer.clone(), what });
        };
        let explicit = agreed.syntax == uids::EXPLICIT_VR_LITTLE_ENDIAN;
        let mut agreed = BTreeSet::new();
        for class in classes {
            let any = kinds_of(class).iter().any(|kind| link.context(kind, None).is_some());
            if any {
                agreed.insert(class.clone());
            } else if self.unsent.insert(class.clone()) && !class.is_empty() {
                let (node, class) = (&self.call.peer, class_name(class));
                let text = format!("{node} sends no {class} by C-GET: try --move-to");
                info.warnings.push(Warning::new("class-not-sent", text));
            }
        }
        let destination = None;
        let asking = Asking { field: field::GET, model, context, explicit, destination };
        let mut talk = Talk::new(link);
        let requests = self.requests(&inbox.missing, Some(&agreed));
        let (inbox, arrived) = (Mutex::new(inbox), self.arrived);
        for request in requests {
            let mut take = |talk: &mut Talk<'_>, message: &Message| {
                let is_object = message.command.field() == field::STORE;
                if is_object {
                    arrived.store(inbox::take(&inbox, talk, message)?, Ordering::Relaxed);
                }
                Ok(is_object)
            };
            self.ask(&mut talk, &asking, &request, &mut take, info)?;
        }
        let _best_effort = talk.link.release();
        Ok(!agreed.is_empty())
    }

    /// Asks once for all that is missing by C-MOVE.
    pub(crate) fn by_move(
        &mut self,
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
        let requests = self.requests(&inbox.missing, None);
        let inbox = Mutex::new(inbox);
        let listener = Listener::open(address, port, title, self.call)?;
        let destination = Some(title);
        let asking = Asking { field: field::MOVE, model, context, explicit, destination };
        let arrived = self.arrived;
        let moved = listener.while_open(&inbox, arrived, self.go_on, |go_on| {
            let mut talk = Talk::new(link);
            for request in &requests {
                let mut take = |_: &mut Talk<'_>, _: &Message| go_on().map(|()| false);
                self.ask(&mut talk, &asking, request, &mut take, info)?;
            }
            let _best_effort = talk.link.release();
            Ok(())
        });
        moved.and_then(|()| self.all_asked()).map_err(|error| match error {
            Error::Failed { node, what, status, transient: false } => {
                let status = format!(
                    "{status}; is the AE title {title} entered there as a receiver, at {address} port {port}?"
                );
                Error::Failed { node, what, status, transient: false }
            }
            error => error,
        })
    }

    /// The SOP classes of what is missing, an empty one where the archive does not say.
    fn classes(&self, missing: &BTreeSet<String>) -> Vec<String> {
        let entries = self.parts.iter().flat_map(|part| &part.instances);
        let classes: BTreeSet<&String> = entries
            .filter(|entry| missing.contains(&entry.instance))
            .map(|entry| &entry.class)
            .filter(|class| !self.unsent.contains(*class))
            .collect();
        classes.into_iter().cloned().collect()
    }

    /// The requests for what is missing, of some classes or of all: a series of which nothing is
    /// here as a whole, else instances; each by itself that was in a request that failed.
    fn requests(
        &self,
        missing: &BTreeSet<String>,
        classes: Option<&BTreeSet<String>>,
    ) -> Vec<Request> {
        let mut requests = Vec::new();
        for Part { study, series, instances } in self.parts {
            let keys = |level: &str| {
                vec![
                    (tags::QUERY_RETRIEVE_LEVEL, level.to_owned()),
                    (tags::STUDY_INSTANCE_UID, study.clone()),
                    (tags::SERIES_INSTANCE_UID, series.clone()),
                ]
            };
            let meant = |entry: &&InstanceEntry| {
                missing.contains(&entry.instance)
                    && classes.is_none_or(|classes| classes.contains(&entry.class))
            };
            let wanted: Vec<String> =
                instances.iter().filter(meant).map(|entry| entry.instance.clone()).collect();
            let (single, together): (Vec<_>, Vec<_>) =
                wanted.into_iter().partition(|instance| self.singly.contains(instance));
            if together.len() == instances.len() && !together.is_empty() {
                requests.push(Request { keys: keys("SERIES"), instances: together });
                continue;
            }
            for some in together.chunks(AT_ONCE).chain(single.chunks(1)) {
                let mut keys = keys("IMAGE");
                keys.push((tags::SOP_INSTANCE_UID, some.join("\\")));
                requests.push(Request { keys, instances: some.to_vec() });
            }
        }
        requests
    }

    /// Makes a request and takes its answers. `take` says whether a message is an object that it
    /// has taken.
    ///
    /// # Errors
    /// When the association broke, or the request failed by itself. One that failed for objects of
    /// it is no error: each of its objects is asked for by itself next.
    fn ask(
        &mut self,
        talk: &mut Talk<'_>,
        asking: &Asking<'_>,
        request: &Request,
        take: &mut dyn FnMut(&mut Talk<'_>, &Message) -> Result<bool, Error>,
        info: &mut FetchInfo,
    ) -> Result<(), Error> {
        let id = asking.send(talk, &request.keys)?;
        let (mut before, mut pending) = (self.arrived.load(Ordering::Relaxed), 0);
        let Ended { status: answer, failed, completed } = loop {
            let message = talk.answer()?;
            if take(talk, &message)? {
                pending = 0;
                continue;
            }
            if let Some(ended) = asking.ended(talk, &message, id)? {
                break ended;
            }
            // By C-MOVE objects come on another association.
            let now = self.arrived.load(Ordering::Relaxed);
            pending = if now == before { pending + 1 } else { 0 };
            before = now;
            if pending > MAX_PENDING {
                let text = "answers without end that more is to come, and nothing comes";
                return Err(talk.link.protocol(text));
            }
        };
        let done = answer == status::SUCCESS || status::is_warning(answer);
        if done && failed == 0 {
            return Ok(());
        }
        if failed > 0 && request.instances.len() > 1 {
            let node = &self.call.peer;
            let text = format!("{node} says that {failed} transfers failed");
            info.warnings.push(Warning::new("transfers-failed", text));
        }
        let (node, what) = (self.call.peer.clone(), "send what it lists");
        let transient = status::is_transient(answer);
        let failure = Error::Failed { node, what, status: status::words(answer), transient };
        // Archives whom nobody has named a C-MOVE's destination say no more than that they failed,
        // of no object.
        let counted = failed > 0 || completed > 0 || asking.field == field::GET;
        let of_objects = done || (counted && status::is_of_objects(answer));
        if !of_objects {
            return Err(failure);
        }
        // Some end a request with the first object that failed: the others are asked for by
        // themselves.
        self.singly.extend(request.instances.iter().cloned());
        self.singly_failed |= asking.field == field::GET && request.instances.len() == 1;
        if !done {
            self.failure = Some(failure);
        }
        Ok(())
    }

    /// Why objects asked for one by one do not come by C-GET, where it is a matter of those objects
    /// and not of a lack that passes: archives (dcmqrscp) say A702H of every object that no
    /// proposed context fits.
    pub(crate) fn unfit(&self, inbox: &Inbox) -> Option<String> {
        let unsaid = self.is_unsaid(&inbox.missing);
        (self.singly_failed && (unsaid || inbox.received > 0)).then(|| {
            let classes = if unsaid { ", of SOP classes that it does not list" } else { "" };
            format!(
                "it fails for these alone{classes}: it may hold them in a class or a transfer syntax that was not \
                 proposed; try --move-to, or have them exported"
            )
        })
    }

    /// Whether all that was asked for failed for no reason that may pass.
    fn all_asked(&mut self) -> Result<(), Error> {
        let passes = |failure: &mut Error| failure.of_the_peer();
        self.failure.take_if(passes).map_or(Ok(()), Err)
    }

    /// Says of objects whose class the archive does not say that it may be none of those that were
    /// proposed.
    pub(crate) fn tell_unsaid(&self, missing: &BTreeSet<String>, info: &mut FetchInfo) {
        if self.is_unsaid(missing) {
            let text = format!(
                "{} does not list SOP classes, and those of a planning CT were asked for: others come with --move-to",
                self.call.peer
            );
            info.warnings.push(Warning::new("class-not-listed", text));
        }
    }

    /// Whether the archive does not say the SOP class of something that is missing.
    fn is_unsaid(&self, missing: &BTreeSet<String>) -> bool {
        let mut entries = self.parts.iter().flat_map(|part| &part.instances);
        entries.any(|entry| entry.class.is_empty() && missing.contains(&entry.instance))
    }
}

/// The classes that are proposed for one that is listed; those of a planning CT where none is.
fn kinds_of(class: &str) -> Vec<&str> {
    if class.is_empty() { syntaxes::KINDS.to_vec() } else { vec![class] }
}

/// The classes that are proposed for some that are listed, each once.
fn proposed(classes: &[String]) -> BTreeSet<&str> {
    classes.iter().flat_map(|class| kinds_of(class)).collect()
}

/// A presentation context for each transfer syntax: one with several would leave us only one of
/// them.
fn receiving(class: &str) -> impl Iterator<Item = Proposal> {
    let one = |syntax: &&str| Proposal { receives: true, ..Proposal::new(class, &[syntax]) };
    syntaxes::of(class).iter().map(one)
}

/// Runs of classes for each of which one association has contexts enough, one being the request's.
fn groups(classes: &[String]) -> Vec<&[String]> {
    let (mut groups, mut rest) = (Vec::new(), classes);
    while !rest.is_empty() {
        let fits = |count: &usize| {
            let classes = proposed(&rest[..*count]).into_iter();
            let contexts = classes.map(|class| syntaxes::of(class).len());
            contexts.sum::<usize>() < MAX_CONTEXTS
        };
        // One always does, also the one that stands for those of a planning CT.
        let count = (1..=rest.len()).take_while(fits).last().unwrap_or(1);
        let (group, after) = rest.split_at(count);
        groups.push(group);
        rest = after;
    }
    groups
}

impl Asking<'_> {
    /// Sends a request; its number.
    fn send(&self, talk: &mut Talk<'_>, keys: &[(Tag, String)]) -> Result<u16, Error> {
        let identifier =
            keys.iter().fold(Identifier::default(), |set, (tag, value)| set.with(*tag, value));
        let bytes = identifier.to_bytes(self.explicit);
        let id = talk.next_id();
        let mut command =
            Command::request(self.field, id, self.model, true).number(element::PRIORITY, 0);
        if let Some(title) = self.destination {
            command = command.text(element::MOVE_DESTINATION, title.as_str());
        }
        talk.send(self.context, &command, Some(Payload::of(&mut &bytes[..])))?;
        Ok(id)
    }

    /// How a request ended, when this answer is its last.
    fn ended(
        &self,
        talk: &mut Talk<'_>,
        message: &Message,
        id: u16,
    ) -> Result<Option<Ended>, Error> {
        let command = &message.command;
        let of = command.get_number(element::MESSAGE_ID_RESPONDED_TO);
        let (true, Some(status)) = (
            command.field() == self.field | field::ANSWER && of == Some(id),
            command.get_number(element::STATUS),
        ) else {
            return Err(talk.link.protocol("an answer to something else than was asked"));
        };
        if command.has_data_set() {
            talk.data(message, MAX_FAILED_LIST, &mut |_| {})?;
        }
        if status::PENDING.contains(&status) {
            return Ok(None);
        }
        let count = |number| command.get_number(number).unwrap_or_default();
        let (failed, completed) = (count(element::FAILED), count(element::COMPLETED));
        Ok(Some(Ended { status, failed, completed }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_shared_out_so_that_each_association_has_contexts_for_its_own() {
        let classes: Vec<String> =
            (0..200).map(|n| format!("1.2.840.10008.5.1.4.1.1.{n}")).collect();
        let groups = groups(&classes);
        assert_eq!(groups.concat(), classes);
        for group in &groups {
            let contexts: usize = proposed(group).into_iter().map(|c| receiving(c).count()).sum();
            assert!(contexts < MAX_CONTEXTS, "{contexts}");
        }
        // Of those that cannot be compressed more find room.
        let reports: Vec<String> =
            (1..=42).map(|n| format!("1.2.840.10008.5.1.4.1.1.88.{n}")).collect();
        assert_eq!(super::groups(&reports).len(), 1);
        let unsaid = [String::new()];
        assert_eq!(super::groups(&unsaid), [&unsaid[..]]);
        assert!(proposed(&unsaid).into_iter().flat_map(receiving).count() < MAX_CONTEXTS);
    }
}

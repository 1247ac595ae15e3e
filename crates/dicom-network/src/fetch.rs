//! C-GET and C-MOVE: the instances that are missing in a folder (PS3.4 C.4.2, C.4.3, Study Root).

use crate::Call;
use crate::cancel::GoOn;
use crate::error::Error;
use crate::expected::Expected;
use crate::find::{Finder, Found, InstanceEntry, QuerySpec};
use crate::inbox::Inbox;
use crate::made::Made;
use crate::node::Title;
use crate::patience::{patiently, pause};
use crate::retrieve::{FetchInfo, Part, Retrieval};
use std::collections::BTreeMap;
use std::net::IpAddr;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Warning};

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

/// Retrieves what is meant and not yet in the folder `out`, each instance in a file of its own.
///
/// # Errors
/// When nothing or more than one study is meant, the peer does not offer what is needed, a file
/// cannot be written, or the user asked to stop. What arrived until then stays.
pub fn fetch(
    call: &Call,
    spec: &QuerySpec,
    way: &Way,
    out: &Path,
    progress: Progress<'_>,
) -> Result<FetchInfo, Error> {
    let _made = Made::new(out)?;
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
    let mut retrieval = Retrieval::new(call, &parts, &arrived, &go_on);
    while !inbox.missing.is_empty() {
        let before = (inbox.missing.len(), retrieval.asked_singly());
        let outcome = match way {
            Way::Get => retrieval.by_get(&mut inbox, &mut info),
            Way::Move { title, bind, port } => {
                retrieval.by_move(&mut inbox, &mut info, title, *bind, *port)
            }
        };
        let progressed = (inbox.missing.len(), retrieval.asked_singly()) != before;
        info.broken = outcome.as_ref().err().map(ToString::to_string);
        vain = if progressed { 0 } else { vain + 1 };
        match outcome {
            Ok(()) if progressed => {}
            // Asked in good order and nothing came: it will not come.
            Ok(()) => break,
            Err(error) if !error.of_the_peer() => {
                return Err(because(error, &inbox.problems));
            }
            Err(error) if vain > call.retries => match error.in_vain(call, "send objects") {
                error @ Error::NotPermitted { .. } if inbox.received == 0 => return Err(error),
                error @ Error::Failed { .. } => {
                    let unfit = retrieval.unfit(&inbox);
                    info.failed = unfit.map(|why| format!("{error}; {why}"));
                    break;
                }
                _ => break,
            },
            Err(_) => pause(vain, &go_on)?,
        }
    }
    if info.failed.is_some() {
        info.broken = None;
    }
    if let Some(failure) = retrieval.failure.take()
        && info.broken.is_none()
    {
        if inbox.received == 0 && inbox.strangers.is_empty() {
            return Err(because(failure, &inbox.problems));
        }
        info.failed.get_or_insert(failure.to_string());
    }
    if matches!(way, Way::Get) {
        retrieval.tell_unsaid(&inbox.missing, &mut info);
    }
    inbox.tell_strangers_in_the_folder();
    (info.received, info.bytes) = (inbox.received, inbox.bytes);
    info.strangers = inbox.strangers;
    info.missing = inbox.missing.into_iter().collect();
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
        return spec.nothing_listed(&call.peer);
    };
    let uid = &first.entry.study;
    if studies.iter().all(|found| found.entry.study == *uid) {
        let (peer, count) = (&call.peer, studies.len());
        return format!(
            "{peer} lists the study {uid} for {count} patients: name the one who is meant with --patient-id \
             (Patient IDs are not shown)"
        );
    }
    let uids: Vec<String> =
        studies.iter().map(|f| format!("\n  {} of {}", f.entry.study, f.entry.date)).collect();
    format!("several studies, choose one with --study:{}", uids.concat())
}

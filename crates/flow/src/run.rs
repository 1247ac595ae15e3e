//! A whole run: a session with a folder, all its results, and the summary that is written last.

use crate::folder::note_failed;
use crate::graph::Node;
use crate::nodes::Report;
use crate::session::{Done, Lane, Observer, Request, Session};
use crate::{Error, NodeId};
use serde_json::json;
use std::collections::BTreeMap;
use std::time::Instant;
use supine_report::{Run, StageTime, Summary};

/// What a run is asked beside its case.
#[derive(Clone, Copy, Debug, Default)]
pub struct Options {
    /// Ends when this node and all it rests on are done.
    pub until: Option<NodeId>,
    /// Makes this node and all that rest on it anew.
    pub force: Option<NodeId>,
    /// Replaces the finished result of another case.
    pub overwrite: bool,
    /// Repeats a summary although files that its run read have changed since.
    pub inputs_changed: bool,
}

/// Brings a session's folder up to date; the summary, or `None` when `until` ended the run before
/// the report.
///
/// # Errors
/// [`Error`]; nothing half-written is left under a final name, and what was finished stays.
pub fn run(
    session: &Session,
    options: Options,
    observer: &dyn Observer,
) -> Result<Option<Summary>, Error> {
    let done = unnoted(session, options, observer);
    if let Err(error) = &done {
        // A session without a folder has nothing that could be taken for its result.
        let _noted = session.folder(|folder| {
            note_failed(folder.root(), error);
            Ok(())
        });
    }
    done
}

/// The same for who notes a failure by itself.
pub(crate) fn unnoted(
    session: &Session,
    options: Options,
    observer: &dyn Observer,
) -> Result<Option<Summary>, Error> {
    // Stages run side by side: the sum of their times is not the time that one waits.
    let begun = Instant::now();
    session.spec().check_complete()?;
    session.check_told()?;
    let targets: Vec<NodeId> = match options.until {
        Some(until) if !matches!(until, NodeId::Report | NodeId::ReportObject) => vec![until],
        _ => NodeId::ALL.to_vec(),
    };
    let request = Request { observer, lane: Lane::Final, force: options.force, drops: true };
    session.reset_peak_memory();
    let done = session.bring(&targets, &[], &request)?.done;
    let stages = times(&done);
    if targets.len() == 1 {
        return Ok(None);
    }
    let record = done.get(&NodeId::Report).and_then(|done| done.record.as_ref());
    let facts = record.map(|record| record.facts.clone());
    let mut summary: Summary =
        serde_json::from_value(facts.ok_or(Error::NotKept { node: Report::ID })?)?;
    summary.outputs = outputs(&done);
    summary.warnings = done.values().flat_map(|done| done.warnings.clone()).collect();
    summary.chain = session.chain(&targets)?;
    let case_folder = Some(crate::folder::whole(session.spec().folder()));
    summary.run = Run {
        case_folder,
        started: session.start().map(|start| start.clock.to_string()),
        command: session.start().map(|start| start.command.clone()),
        total_seconds: begun.elapsed().as_secs_f64(),
        peak_memory_mb: session.peak_memory_mb(),
        threads: session.threads(),
        stages,
    };
    if session.case().export.anonymise {
        // Sites name files and folders after patients.
        keep_case(session, &summary)?;
        (summary.run.case_folder, summary.run.command) = (None, None);
    }
    session.folder(|folder| folder.write_summary(&summary))?;
    Ok(Some(summary))
}

/// Keeps the whole case of a de-identified run beside its results, for the program alone.
fn keep_case(session: &Session, summary: &Summary) -> Result<(), Error> {
    let kept = json!({
        "case": session.case().canonical(), "run": { "case_folder": summary.run.case_folder },
        "source": { "series_uid": series(session) },
    });
    session.folder(|folder| folder.keep_case(&kept))
}

/// The series that was read, by which the next run knows its CT again.
fn series(session: &Session) -> Option<String> {
    let (case, case_state) = (session.case(), session.case_state());
    let ct = case_state.path(case.ct.as_ref()?);
    case.series.clone().or_else(|| crate::folder::only_series(&ct))
}

fn times(done: &BTreeMap<NodeId, Done>) -> Vec<StageTime> {
    let one = |(node, done): (&NodeId, &Done)| StageTime {
        name: node.name().into(),
        seconds: done.seconds,
        cached: done.cached,
        peak_memory_mb: done.peak_memory_mb,
    };
    done.iter().map(one).collect()
}

fn outputs(done: &BTreeMap<NodeId, Done>) -> Vec<supine_report::Output> {
    let records = done.values().filter_map(|done| done.record.as_ref());
    records.flat_map(crate::folder::visible).collect()
}

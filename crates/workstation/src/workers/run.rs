//! Bringing stages up to date, in memory or in a folder.

use crate::Error;
use crate::names::{name_of, quoted};
use crate::store::Store;
use crate::workers::jobs::Jobs;
use crate::workers::live::has_breast;
use crate::workers::objects;
use std::sync::Arc;
use supine_flow::{CaseFile, Lane, NodeId, Options, Request, RunFolder, Session};

/// Brings the stages up to one of them up to date, in memory.
///
/// # Errors
/// When nothing is open, or work goes on.
pub(crate) fn run(jobs: &Arc<Jobs>, until: Option<NodeId>) -> Result<(), Error> {
    let session = jobs.workspace.look(|store| store.case.session())?;
    // The deformed CT is shown before it is known how sure the tumour's place is.
    let parts: Vec<Vec<NodeId>> = match until {
        // Labels are looked at where they are doubted, which is known of a region.
        Some(NodeId::Segment) if has_breast(&session) => {
            vec![vec![NodeId::Segment], vec![NodeId::Region]]
        }
        Some(until) => vec![vec![until]],
        None => vec![
            vec![NodeId::Warp, NodeId::MovedObjects],
            vec![NodeId::Points, NodeId::Interval, NodeId::Evaluation],
            vec![NodeId::Fields],
        ],
    };
    jobs.begin(until.map_or("simulating", NodeId::name), move |report| {
        report.change(|store| tell_command(store, "result", until.or(Some(NodeId::Interval))));
        let request = Request { observer: report, lane: Lane::Final, ..Request::default() };
        for part in parts {
            let done = session.update(&part, &request);
            // What was finished before it failed is shown all the same.
            report.change(|store| store.show_results(&session));
            done?;
        }
        Ok(())
    })
}

/// Runs the whole case into a folder.
///
/// # Errors
/// When nothing is open, the name is none, or work goes on.
pub(crate) fn run_into(jobs: &Arc<Jobs>, dir: &str, name: &str) -> Result<(), Error> {
    let text = |store: &Store| store.case.text().map(ToOwned::to_owned);
    let (session, path, before) = jobs.workspace.look(|store| {
        let session = store.case.session()?;
        Ok::<_, Error>((session, store.roots.path_of(dir, name)?, text(store)))
    })?;
    let name = name.to_owned();
    jobs.begin("the whole run", move |report| {
        report.change(|store| tell_command(store, &name, None));
        // The deformed CT is shown before its files are written.
        let request = Request { observer: report, ..Request::default() };
        session.update(&[NodeId::Warp], &request)?;
        report.change(|store| store.show_results(&session));
        session.keep_in(Some(RunFolder::open(&path)?))?;
        let done = supine_flow::run(&session, Options::default(), report);
        // A run lets go in memory of what lies in its folder.
        let read = if done.is_ok() { read_back(&session, &request) } else { Ok(()) };
        session.keep_in(None)?;
        read?;
        objects::read(&session, report, Lane::Final);
        report.change(|store| store.show_results(&session));
        if let Some(summary) = done? {
            report.change(|store| {
                let case = text(store).filter(|now| before.as_ref() == Some(now));
                store.show_run(&path, case, &summary);
            });
        }
        Ok(())
    })
}

/// Reads what is shown from the folder of a run. Each is asked for: what is only brought up to date
/// there is not read.
pub(crate) fn read_back(
    session: &Session,
    request: &Request<'_>,
) -> Result<(), supine_flow::Error> {
    session.labels(request)?;
    session.region(request)?;
    session.mesh(request)?;
    session.deformation(request)?;
    session.read_scans(request)?;
    session.deformed_ct(request)?;
    session.tumour(request)?;
    session.tumour_interval(request).map(drop)
}

/// Tells the command line of a run.
fn tell_command(store: &mut Store, out: &str, until: Option<NodeId>) {
    let command = store.case.file().and_then(CaseFile::path).map(|path| {
        let until = until.map_or(String::new(), |node| format!(" --until {node}"));
        format!("supine run {} --out {}{until}", quoted(&name_of(path)), quoted(out))
    });
    store.case.set_command(command.unwrap_or_default());
}

//! The objects that the case carries along, read and moved.

use crate::workers::reporter::Reporter;
use supine_flow::{Lane, NodeId, Request, Session};

/// Reads them, and moves them where that takes no longer work; what is wrong with them is told and
/// ends nothing.
pub(crate) fn read(session: &Session, report: &Reporter, lane: Lane) {
    if session.case().carried.is_empty() {
        return;
    }
    let mut nodes = vec![NodeId::Objects];
    nodes.extend(session.is_fresh(NodeId::Solve).then_some(NodeId::MovedObjects));
    if nodes.iter().all(|node| session.is_fresh(*node)) {
        return;
    }
    let request = Request { observer: report, lane, ..Request::default() };
    let done = session.update(&nodes, &request);
    report.change(|store| {
        store.show_results(session);
        match done {
            Ok(()) | Err(supine_flow::Error::Stopped) => {}
            Err(error) => store.work.fail(&error.into()),
        }
    });
}

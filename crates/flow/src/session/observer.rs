//! Who watches the work, and may end it.

use crate::NodeId;
use supine_report::Warning;

/// Sees the work from outside, and may end it. Called from several threads at once.
pub trait Observer: Sync {
    /// A node begins.
    fn begin(&self, _node: NodeId) {}
    /// Share of a node done, 0..=1.
    fn share(&self, _node: NodeId, _share: f64) {}
    /// What the user must know.
    fn warning(&self, _node: NodeId, _warning: &Warning) {}
    /// A node is done; `cached` when its result was there.
    fn end(&self, _node: NodeId, _seconds: f64, _cached: bool) {}
    /// Whether the work may go on.
    fn go_on(&self) -> bool {
        true
    }
}

/// Watches nothing and never ends it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Observer for Unwatched {}

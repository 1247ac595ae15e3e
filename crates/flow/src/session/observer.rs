//! Who watches the work, and may end it.

use crate::NodeId;
use std::sync::atomic::{AtomicBool, Ordering};
use supine_report::Warning;
use supine_space::Watch;

/// Sees the work from outside, and may end it. Called from several threads at once.
pub trait Observer: Sync {
    /// A node begins.
    fn begin(&self, _node: NodeId) {}
    /// Share of a node done, 0..=1.
    fn share(&self, _node: NodeId, _share: f64) {}
    /// What a node found on its way, in words for people.
    fn found(&self, _node: NodeId, _text: &str) {}
    /// What the user may want to know of how the work was asked for.
    fn note(&self, _text: &str) {}
    /// What the user must know.
    fn warning(&self, _node: NodeId, _warning: &Warning) {}
    /// A node is done; `cached` when its result was there.
    fn end(&self, _node: NodeId, _seconds: f64, _cached: bool) {}
    /// Whether the work may go on.
    fn go_on(&self) -> bool {
        true
    }
}

/// A node as its observer sees it.
pub(crate) struct Watched<'a> {
    pub(crate) node: NodeId,
    pub(crate) observer: &'a dyn Observer,
    /// Set when another node failed: this one ends too.
    pub(crate) failed: &'a AtomicBool,
}

impl Watch for Watched<'_> {
    fn share(&self, share: f64) -> bool {
        self.observer.share(self.node, share);
        self.observer.go_on() && !self.failed.load(Ordering::Relaxed)
    }

    fn found(&self, text: &str) {
        self.observer.found(self.node, text);
    }
}

/// Watches nothing and never ends it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwatched;

impl Observer for Unwatched {}

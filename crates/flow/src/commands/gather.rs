//! What a command hears of its session: each node once, and all warnings.

use crate::session::Observer;
use crate::shared::told;
use crate::{Error, NodeId};
use std::collections::BTreeSet;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;
use supine_report::Warning;
use supine_space::Progress;

/// Passes on what it hears, a node once however often its result is asked for, and keeps the
/// warnings.
pub(super) struct Gather<'a> {
    observer: &'a dyn Observer,
    heard: Mutex<Heard>,
}

#[derive(Default)]
struct Heard {
    done: BTreeSet<NodeId>,
    warnings: Vec<Warning>,
}

impl<'a> Gather<'a> {
    /// For a session in which some nodes are `given`, of which nothing is told.
    pub(super) fn new(observer: &'a dyn Observer, given: &[NodeId]) -> Self {
        let heard = Heard { done: given.iter().copied().collect(), warnings: vec![] };
        Self { observer, heard: Mutex::new(heard) }
    }

    fn heard(&self) -> MutexGuard<'_, Heard> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Work that is no node, shown as the node whose part it takes.
    pub(super) fn work<T>(
        &self,
        node: NodeId,
        work: impl FnOnce(Progress<'_>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let start = Instant::now();
        self.observer.begin(node);
        let share = |share| {
            self.observer.share(node, share);
            self.observer.go_on()
        };
        let made = work(Progress::new(&share))?;
        self.observer.end(node, start.elapsed().as_secs_f64(), false);
        Ok(made)
    }

    /// Warnings of such work.
    pub(super) fn warn_all(
        &self,
        node: NodeId,
        warnings: impl IntoIterator<Item = supine_space::Warning>,
    ) {
        for warning in warnings {
            self.warning(node, &told(node, &warning, false));
        }
    }

    /// All warnings so far.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        self.heard().warnings.clone()
    }

    /// The same as texts of a page.
    pub(super) fn texts(&self) -> Vec<supine_space::Warning> {
        let text = |warning: &Warning| supine_space::Warning::new("told", warning.message.as_str());
        self.heard().warnings.iter().map(text).collect()
    }

    fn is_new(&self, node: NodeId) -> bool {
        !self.heard().done.contains(&node)
    }
}

impl Observer for Gather<'_> {
    fn begin(&self, node: NodeId) {
        if self.is_new(node) {
            self.observer.begin(node);
        }
    }

    fn share(&self, node: NodeId, share: f64) {
        if self.is_new(node) {
            self.observer.share(node, share);
        }
    }

    fn found(&self, node: NodeId, text: &str) {
        if self.is_new(node) {
            self.observer.found(node, text);
        }
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        if self.heard().warnings.contains(warning) {
            return;
        }
        self.heard().warnings.push(warning.clone());
        self.observer.warning(node, warning);
    }

    fn end(&self, node: NodeId, seconds: f64, cached: bool) {
        if self.heard().done.insert(node) {
            self.observer.end(node, seconds, cached);
        }
    }

    fn go_on(&self) -> bool {
        self.observer.go_on()
    }
}

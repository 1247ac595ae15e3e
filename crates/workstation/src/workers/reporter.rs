//! Reports what becomes of work, and answers whether it may go on.

use crate::store::Store;
use crate::workspace::Workspace;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use supine_flow::{NodeId, Observer, Warning};

/// All that a worker knows of the page.
pub(crate) struct Reporter {
    workspace: Arc<Workspace>,
    cancel: Arc<AtomicBool>,
    /// Whether the work goes on beside that which was asked for.
    is_live: bool,
    began: Instant,
}

impl Reporter {
    pub(crate) fn new(workspace: Arc<Workspace>, cancel: Arc<AtomicBool>, is_live: bool) -> Self {
        Self { workspace, cancel, is_live, began: Instant::now() }
    }

    /// Reports something.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Store) -> T) -> T {
        self.workspace.change(change)
    }

    pub(crate) fn look<T>(&self, look: impl FnOnce(&Store) -> T) -> T {
        self.workspace.look(look)
    }

    /// Tells how far work is that is no stage's.
    pub(crate) fn work(&self, share: f64) {
        self.workspace.change_often(|store| store.work.set_share(None, share));
    }

    fn log(&self, node: NodeId, text: String) {
        self.workspace.change_often(|store| store.work.tell(self.began, node, text));
    }
}

impl Observer for Reporter {
    fn begin(&self, node: NodeId) {
        // What goes on beside may be given up at any time: it shows only what it has finished.
        if self.is_live {
            return;
        }
        self.change(|store| store.work.stage_begins(node));
        self.log(node, "begins".into());
    }

    fn share(&self, node: NodeId, share: f64) {
        self.workspace.change_often(|store| {
            if self.is_live {
                store.previews.set_share(share);
            } else {
                store.work.set_share(Some(node), share);
            }
        });
    }

    fn found(&self, node: NodeId, text: &str) {
        self.workspace.change_often(|store| store.work.stage_found(node, text));
        self.log(node, text.into());
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        self.log(node, format!("warning: {}", warning.message));
        self.change(|store| store.warn(node, warning));
    }

    fn end(&self, node: NodeId, seconds: f64, cached: bool) {
        let there = if cached { "was there" } else { "done" };
        self.log(node, format!("{there}, {seconds:.2} s"));
        self.change(|store| store.work.stage_ends(node, seconds, cached, self.is_live));
    }

    fn go_on(&self) -> bool {
        !self.cancel.load(Ordering::SeqCst)
    }
}

//! Work of the session as the page sees it.

use crate::state::{StageShown, WarningShown};
use crate::workspace::Workspace;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use supine_flow::{NodeId, Observer, Warning};

/// Tells the page of the stages, and answers whether the work may go on.
pub(crate) struct JobObserver {
    workspace: Arc<Workspace>,
    cancel: Arc<AtomicBool>,
    /// Whether it goes on beside the work that was asked for.
    beside: bool,
    began: Instant,
}

impl JobObserver {
    pub(crate) fn new(workspace: Arc<Workspace>, cancel: Arc<AtomicBool>) -> Self {
        Self { workspace, cancel, beside: false, began: Instant::now() }
    }

    /// The same of work that goes on beside.
    pub(crate) fn beside(workspace: Arc<Workspace>, cancel: Arc<AtomicBool>) -> Self {
        Self { workspace, cancel, beside: true, began: Instant::now() }
    }

    /// Tells how far work is that is no stage's.
    pub(crate) fn work(&self, share: f64) {
        self.workspace.change_often(|held| {
            if let Some(job) = &mut held.state.job {
                job.share = share;
            }
        });
    }

    fn forget_warnings(&self, node: NodeId) {
        self.workspace
            .change(|held| held.state.warnings.retain(|known| known.stage != node.name()));
    }

    fn log(&self, node: NodeId, text: String) {
        let began = self.began;
        self.workspace.change_often(|held| held.tell(began, node.name(), text));
    }

    /// Changes a stage that is shown; what others do is shown by the work as a whole.
    fn stage(&self, node: NodeId, change: impl FnOnce(&mut StageShown), often: bool) {
        let change = |held: &mut crate::workspace::OpenCase| {
            let stages = &mut held.state.stages;
            stages.iter_mut().find(|stage| stage.name == node.name()).map(change);
        };
        if often { self.workspace.change_often(change) } else { self.workspace.change(change) }
    }
}

impl Observer for JobObserver {
    fn begin(&self, node: NodeId) {
        // What goes on beside may be given up at any time: it shows only what it has finished.
        if self.beside {
            return;
        }
        // What it says is said anew.
        self.forget_warnings(node);
        let begin = |stage: &mut StageShown| {
            (stage.state, stage.share, stage.seconds, stage.found) =
                ("running", Some(0.0), None, None);
        };
        self.stage(node, begin, false);
        self.log(node, "begins".into());
    }

    fn share(&self, node: NodeId, share: f64) {
        if !self.beside {
            self.stage(node, |stage| stage.share = Some(share), true);
            return self.work(share);
        }
        self.workspace.change_often(|held| {
            held.state.live.share = Some(share);
            held.state.preview_bed.share = Some(share);
        });
    }

    fn found(&self, node: NodeId, text: &str) {
        self.stage(node, |stage| stage.found = Some(text.into()), true);
        self.log(node, text.into());
    }

    fn warning(&self, node: NodeId, warning: &Warning) {
        self.log(node, format!("warning: {}", warning.message));
        let shown = WarningShown {
            id: supine_flow::warning_id(warning),
            ticked: false,
            old: false,
            place_mm: warning.place_mm,
            stage: node.name().into(),
            code: warning.code.clone(),
            message: warning.message.clone(),
        };
        self.workspace.change(|held| {
            if !held.state.warnings.iter().any(|known| known.id == shown.id) {
                held.state.warnings.push(shown);
                held.show_ticks();
            }
        });
    }

    fn end(&self, node: NodeId, seconds: f64, cached: bool) {
        if self.beside && !cached {
            self.forget_warnings(node);
        }
        let there = if cached { "was there" } else { "done" };
        self.log(node, format!("{there}, {seconds:.2} s"));
        // What goes on beside may be of what was given before: it takes no stage from the work that
        // was asked for, and none is done because its result was there.
        let beside = self.beside;
        let end = |stage: &mut StageShown| {
            if !beside || !(cached || stage.state == "running") {
                (stage.state, stage.share, stage.seconds) = ("done", None, Some(seconds));
            }
        };
        self.stage(node, end, false);
    }

    fn go_on(&self) -> bool {
        !self.cancel.load(Ordering::SeqCst)
    }
}

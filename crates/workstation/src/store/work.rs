//! The work that was asked for: its stages, what it warns of, its log, and how it failed.

use crate::Error;
use serde::Serialize;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use supine_flow::{Case, CaseError, NodeId, Session, Warning};

/// More lines of the log are not kept.
const LOG: usize = 500;

/// What went wrong.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Problem {
    message: String,
    advice: Option<&'static str>,
}

/// A stage of the flow.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StageShown {
    name: &'static str,
    /// `none`, `running`, `done`, `stale` or `failed`.
    state: &'static str,
    share: Option<f64>,
    seconds: Option<f64>,
    found: Option<String>,
}

/// What is worked on.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Job {
    what: String,
    share: f64,
    can_cancel: bool,
}

/// What the user must know.
#[derive(Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct WarningShown {
    /// By what the case knows it.
    id: String,
    ticked: bool,
    /// Whether its stage was made of what was given before.
    old: bool,
    /// LPS, mm in the CT, where there is one place.
    place_mm: Option<[f64; 3]>,
    stage: String,
    code: String,
    message: String,
}

/// A line of the log.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct LogLine {
    /// Since the work began.
    seconds: f64,
    stage: &'static str,
    text: String,
}

/// One piece of work at a time.
#[derive(Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct Work {
    /// Set to end it.
    #[serde(skip)]
    cancel: Arc<AtomicBool>,
    /// No more work is begun.
    #[serde(skip)]
    closed: bool,
    /// The newest last.
    #[serde(skip)]
    log: VecDeque<LogLine>,
    problem: Option<Problem>,
    stages: Vec<StageShown>,
    job: Option<Job>,
    warnings: Vec<WarningShown>,
}

impl Work {
    /// Begins; the flag that ends it.
    ///
    /// # Errors
    /// [`Error::Busy`] while other work goes on.
    pub(crate) fn begin(&mut self, what: &str) -> Result<Arc<AtomicBool>, Error> {
        if self.job.is_some() || self.closed {
            return Err(Error::Busy);
        }
        self.cancel = Arc::default();
        self.problem = None;
        self.job = Some(Job { what: what.into(), share: 0.0, can_cancel: true });
        Ok(Arc::clone(&self.cancel))
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Ends the work that goes on at its next step.
    pub(crate) fn cancel(&self) {
        self.cancel.store(true, Ordering::SeqCst);
    }

    /// Ends all work: none begins any more.
    pub(crate) fn close(&mut self) {
        self.closed = true;
        self.cancel();
    }

    /// It has ended; whether it failed.
    pub(super) fn end(&mut self, done: Result<(), Error>) -> bool {
        self.job = None;
        let failed = done.err().filter(|error| !error.is_stop());
        let state = if failed.is_some() { "failed" } else { "none" };
        for stage in self.stages.iter_mut().filter(|stage| stage.state == "running") {
            (stage.state, stage.share) = (state, None);
        }
        if let Some(error) = &failed {
            self.fail(error);
        }
        failed.is_some()
    }

    /// Tells of a failure.
    pub(crate) fn fail(&mut self, error: &Error) {
        self.problem = Some(Problem::of(error));
    }

    /// The user has read of the failure.
    pub(crate) fn dismiss(&mut self) {
        self.problem = None;
    }

    /// Another case is opened, of which nothing is done yet.
    pub(super) fn clear(&mut self, case: &Case) {
        self.log.clear();
        self.warnings.clear();
        self.stages = stages(case);
    }

    /// How far it is, and a stage of it where one tells.
    pub(crate) fn set_share(&mut self, node: Option<NodeId>, share: f64) {
        self.job.iter_mut().for_each(|job| job.share = share);
        if let Some(stage) = node.and_then(|node| self.stage(node)) {
            stage.share = Some(share);
        }
    }

    /// What was told, the newest last.
    pub(crate) fn log(&self) -> Vec<LogLine> {
        self.log.iter().cloned().collect()
    }

    /// Adds a line to the log.
    pub(crate) fn tell(&mut self, began: Instant, node: NodeId, text: String) {
        if self.log.len() == LOG {
            self.log.pop_front();
        }
        let seconds = began.elapsed().as_secs_f64();
        self.log.push_back(LogLine { seconds, stage: node.name(), text });
    }

    /// A stage; none where the page shows what it does by the work as a whole.
    fn stage(&mut self, node: NodeId) -> Option<&mut StageShown> {
        self.stages.iter_mut().find(|stage| stage.name == node.name())
    }

    pub(crate) fn stage_begins(&mut self, node: NodeId) {
        self.forget_warnings(node);
        if let Some(stage) = self.stage(node) {
            (stage.state, stage.share) = ("running", Some(0.0));
            (stage.seconds, stage.found) = (None, None);
        }
    }

    pub(crate) fn stage_found(&mut self, node: NodeId, text: &str) {
        self.stage(node).into_iter().for_each(|stage| stage.found = Some(text.into()));
    }

    /// `is_live`: it was made beside the work, and may be of what was given before: it takes
    /// none from the work, and none is done because its result was there.
    pub(crate) fn stage_ends(&mut self, node: NodeId, seconds: f64, cached: bool, is_live: bool) {
        if is_live && !cached {
            self.forget_warnings(node);
        }
        let Some(stage) = self.stage(node) else { return };
        if !is_live || !(cached || stage.state == "running") {
            (stage.state, stage.share, stage.seconds) = ("done", None, Some(seconds));
        }
    }

    /// What a stage warned of is said anew.
    fn forget_warnings(&mut self, node: NodeId) {
        self.warnings.retain(|known| known.stage != node.name());
    }

    /// Whether there is such a warning.
    pub(crate) fn warns_of(&self, id: &str) -> bool {
        self.warnings.iter().any(|known| known.id == id)
    }

    /// Adds a warning; whether it is a new one.
    pub(super) fn warn(&mut self, node: NodeId, warning: &Warning) -> bool {
        let id = supine_flow::warning_id(warning);
        let is_new = !self.warns_of(&id);
        if is_new {
            self.warnings.push(WarningShown {
                id,
                ticked: false,
                old: false,
                place_mm: warning.place_mm,
                stage: node.name().into(),
                code: warning.code.clone(),
                message: warning.message.clone(),
            });
        }
        is_new
    }

    /// Shows which warnings the case has ticked.
    pub(super) fn show_ticks(&mut self, session: &Session) {
        let seen = session.case().names("report.seen");
        for warning in &mut self.warnings {
            warning.ticked = seen.contains(&warning.id);
        }
    }

    /// Marks the stages whose results are of what was given before.
    pub(super) fn mark(&mut self, old: &[NodeId], session: &Session) {
        let is_old = |name: &str| old.iter().any(|node| node.name() == name);
        let is_held = |name: &str| NodeId::of_name(name).is_some_and(|node| session.is_stale(node));
        for stage in self.stages.iter_mut().filter(|stage| stage.state != "running") {
            match (is_old(stage.name), stage.state) {
                // What an old run would have made is no more than not made yet.
                (true, state) if state != "done" && !is_held(stage.name) => {}
                (true, _) => stage.state = "stale",
                (false, "stale") => stage.state = "done",
                _ => {}
            }
        }
        for warning in &mut self.warnings {
            warning.old = is_old(&warning.stage);
        }
    }

    pub(super) fn mark_all_old(&mut self) {
        let stages = self.stages.iter_mut();
        stages.filter(|stage| stage.state == "done").for_each(|stage| stage.state = "stale");
        self.warnings.iter_mut().for_each(|warning| warning.old = true);
    }
}

impl Problem {
    /// An error in words for people.
    pub(super) fn of(error: &Error) -> Self {
        Self { message: error.to_string(), advice: advice(error) }
    }
}

/// Where in the page that is given which is missing.
fn advice(error: &Error) -> Option<&'static str> {
    let Error::Flow(supine_flow::Error::Case(CaseError::Missing { key, .. })) = error else {
        return None;
    };
    match key.split('.').next() {
        Some("breast") => Some("Choose left or right in step 2, Mark."),
        Some("tumour") => Some("Place it in step 2, Mark."),
        Some("table") => Some("Give both angles in step 4, Table."),
        _ => None,
    }
}

/// Stages that a planner knows, in their order.
const STAGES: [NodeId; 10] = [
    NodeId::Import,
    NodeId::Segment,
    NodeId::Region,
    NodeId::Mesh,
    NodeId::Solve,
    NodeId::Interval,
    NodeId::Warp,
    NodeId::Export,
    NodeId::Pictures,
    NodeId::Report,
];

/// The stages of a case, none done yet: those that only some cases have where this one has them.
fn stages(case: &Case) -> Vec<StageShown> {
    let some = [
        (NodeId::Tissues, case.tissues || case.stiffness.is_some()),
        (NodeId::Fit, case.fit_scans().is_some()),
        (NodeId::Evaluation, case.scans.as_ref().is_some_and(|scans| scans.intraop.is_some())),
        (NodeId::MovedObjects, !case.carried.is_empty()),
        (NodeId::Carry, !case.carried.is_empty()),
    ];
    let shown = |node: &NodeId| {
        STAGES.contains(node) || some.iter().any(|(known, has)| known == node && *has)
    };
    let stage = |node: NodeId| StageShown {
        name: node.name(),
        state: "none",
        share: None,
        seconds: None,
        found: None,
    };
    NodeId::ALL.into_iter().filter(shown).map(stage).collect()
}

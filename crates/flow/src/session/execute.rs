//! Doing the steps of a plan: two at a time where neither rests on the other.

use super::observer::{Observer, Watched};
use super::plan::{Plan, Step, entry};
use super::{Cells, Done};
use crate::case_state::CaseState;
use crate::folder::{Record, RunFolder, visible};
use crate::graph::Output;
use crate::memory::Meter;
use crate::shared::told;
use crate::work::Work;
use crate::{Error, NodeId};
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::{Instant, SystemTime, UNIX_EPOCH};
use supine_dicom::Clock;
use supine_report::{Output as File, Warning};
use supine_space::Progress;

/// Nodes that are worked on at once: most have parts that one thread does alone.
const AT_ONCE: usize = 2;

/// What a run left.
#[derive(Debug, Default)]
pub(crate) struct Run {
    pub(crate) done: BTreeMap<NodeId, Done>,
    /// The results that were asked for.
    pub(crate) outputs: BTreeMap<NodeId, Output>,
}

/// What the steps share.
pub(super) struct Job<'a> {
    pub(super) case_state: &'a CaseState,
    pub(super) plan: &'a Plan,
    pub(super) folder: Option<&'a RunFolder>,
    pub(super) cells: &'a Mutex<Cells>,
    pub(super) pool: &'a rayon::ThreadPool,
    pub(super) observer: &'a dyn Observer,
    /// Whether results are dropped when nobody in the plan needs them any more.
    pub(super) drops: bool,
    /// Never dropped.
    pub(super) stays: BTreeSet<NodeId>,
    /// When the run began.
    pub(super) clock: Option<&'a Clock>,
    /// What the work holds.
    pub(super) meter: &'static Meter,
    /// Done before in this work: nobody is told again.
    pub(super) quiet: BTreeSet<NodeId>,
    /// Set when a node failed: what runs beside it ends too.
    pub(super) failed: AtomicBool,
}

/// How far the steps are.
#[derive(Default)]
struct State {
    done: BTreeMap<NodeId, Done>,
    outputs: BTreeMap<NodeId, Output>,
    running: BTreeSet<NodeId>,
}

impl Job<'_> {
    /// Does all steps; the first error in the order in which they happen ends the work.
    pub(super) fn run(&self) -> Result<Run, Error> {
        let mut state = State::default();
        let at_once = AT_ONCE.min(self.pool.current_num_threads());
        std::thread::scope(|scope| {
            let (send, receive) = channel();
            let mut failed = None;
            loop {
                while failed.is_none() && state.running.len() < at_once {
                    let Some(node) = self.ready(&state) else { break };
                    state.running.insert(node);
                    let before = self.before(&state, node);
                    self.start(scope, node, before, send.clone());
                }
                if state.running.is_empty() {
                    break;
                }
                let Ok((node, result)) = receive.recv() else { break };
                state.running.remove(&node);
                let result = result.unwrap_or_else(|panic| {
                    self.failed.store(true, Ordering::Relaxed);
                    resume_unwind(panic)
                });
                match result {
                    Ok((output, done)) => {
                        self.log(node, Ok(&done), &mut failed);
                        self.finished(&mut state, node, output, done);
                    }
                    Err(error) => {
                        self.failed.store(true, Ordering::Relaxed);
                        self.log(node, Err(&error), &mut None);
                        failed = failed.or(Some(error));
                    }
                }
            }
            failed.map_or(Ok(()), Err)
        })?;
        state.outputs.retain(|node, _| self.stays.contains(node));
        Ok(Run { done: state.done, outputs: state.outputs })
    }

    /// Appends what happened to the folder's log. An error's text may hold names of files:
    /// of a de-identified run its code alone is written.
    fn log(&self, node: NodeId, ended: Result<&Done, &Error>, failed: &mut Option<Error>) {
        let Some(folder) = self.folder.filter(|_| !self.quiet.contains(&node)) else { return };
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let keys = &self.plan.keys;
        let (key, parents) = (keys.get(node), keys.shown_parents(self.case_state, node));
        let mut line = json!({
            "unix_seconds": now.as_secs(), "stage": node.name(), "key": key, "parents": parents,
        });
        match ended {
            Ok(done) => {
                line["seconds"] = done.seconds.into();
                line["cached"] = done.cached.into();
                line["warnings"] = json!(done.warnings);
            }
            Err(error) => {
                line["failed"] = error.kind().name().into();
                line["error"] = json!({ "code": error.code(), "exit": error.kind().exit_code() });
                if !self.case_state.case.export.anonymise {
                    line["error"]["message"] = error.to_string().into();
                }
            }
        }
        if let Err(error) = folder.log(&line) {
            failed.get_or_insert(error);
        }
    }

    /// The first node that can begin.
    fn ready(&self, state: &State) -> Option<NodeId> {
        let open = |node: NodeId| !state.done.contains_key(&node) && !state.running.contains(&node);
        let can = |node: NodeId| {
            let parents = self.plan.keys.parents(self.case_state, node);
            parents.iter().all(|parent| state.done.contains_key(parent))
        };
        self.plan.steps.keys().copied().find(|&node| open(node) && can(node))
    }

    /// What a node gets from those before it.
    fn before(&self, state: &State, node: NodeId) -> Before {
        let parents = self.plan.keys.parents(self.case_state, node);
        let outputs = parents.iter().filter_map(|p| state.outputs.get(p).cloned()).collect();
        let mut all = BTreeSet::new();
        let mut open = parents.to_vec();
        while let Some(node) = open.pop() {
            if all.insert(node) {
                open.extend(self.plan.keys.parents(self.case_state, node));
            }
        }
        let done = || all.iter().filter_map(|node| state.done.get(node));
        Before {
            outputs,
            warned: done().flat_map(|done| done.warnings.clone()).collect(),
            written: done().filter_map(|done| done.record.as_ref()).flat_map(visible).collect(),
        }
    }

    fn start<'scope>(
        &'scope self,
        scope: &'scope std::thread::Scope<'scope, '_>,
        node: NodeId,
        before: Before,
        send: Sender<Ended>,
    ) {
        scope.spawn(move || {
            // A panic must not leave the others waiting for an answer.
            let step = || self.pool.install(|| self.step(node, &before));
            let result = catch_unwind(AssertUnwindSafe(step));
            // Whoever waits is there as long as a step runs.
            let _sent = send.send((node, result));
        });
    }

    fn step(&self, node: NodeId, before: &Before) -> Result<(Option<Output>, Done), Error> {
        let start = Instant::now();
        let told = !self.quiet.contains(&node);
        if told {
            self.observer.begin(node);
        }
        let (output, record, warnings, cached) = self.do_step(node, before)?;
        let seconds = start.elapsed().as_secs_f64();
        if told {
            self.observer.end(node, seconds, cached);
            warnings.iter().for_each(|warning| self.observer.warning(node, warning));
        }
        let peak_memory_mb = self.meter.peak_mb();
        Ok((output, Done { seconds, cached, warnings, record, peak_memory_mb }))
    }

    fn do_step(&self, node: NodeId, before: &Before) -> Result<Stepped, Error> {
        let entry = entry(node);
        let watch = Watched { node, observer: self.observer, failed: &self.failed };
        let shelf = self.folder.map(|folder| folder.shelf(node));
        let work =
            Work::new(Progress::new(&watch), shelf, (&before.warned, &before.written), self.clock);
        let key = self.plan.keys.get(node).ok_or(Error::NotKept { node })?;
        let held = || self.cells.lock().ok().and_then(|mut cells| cells.get(node, key));
        match &self.plan.steps[&node] {
            Step::Kept(record) => Ok((None, Some(record.clone()), record.warnings.clone(), true)),
            Step::Load(record) => {
                let output = (entry.load)(record.facts.clone(), &work)?;
                Ok((Some(output), Some(record.clone()), record.warnings.clone(), true))
            }
            Step::Held => {
                let cell = held().ok_or(Error::NotKept { node })?;
                let record = self.folder.and_then(|folder| folder.result(node, key));
                Ok((Some(cell.output), record, cell.warnings, true))
            }
            Step::Write => {
                let cell = held().ok_or(Error::NotKept { node })?;
                let record = self.keep(node, &cell.output, cell.warnings.clone(), &work)?;
                Ok((Some(cell.output), record, cell.warnings, true))
            }
            Step::Make(known) => {
                let output = (entry.run)(self.case_state, &before.outputs, &work)?;
                if let Some(record) = known {
                    return Ok((
                        Some(output),
                        Some(record.clone()),
                        record.warnings.clone(),
                        false,
                    ));
                }
                let (warnings, record) = self.made(node, &output, &work)?;
                Ok((Some(output), record, warnings, false))
            }
        }
    }

    /// Writes what was made and says what it warned of.
    fn made(
        &self,
        node: NodeId,
        output: &Output,
        work: &Work<'_>,
    ) -> Result<(Vec<Warning>, Option<Record>), Error> {
        let nameless = self.case_state.case.export.anonymise;
        let warnings: Vec<Warning> =
            work.take_warnings().iter().map(|warning| told(node, warning, nameless)).collect();
        let record = self.keep(node, output, warnings.clone(), work)?;
        Ok((warnings, record))
    }

    /// Writes a result to the folder, where there is one.
    fn keep(
        &self,
        node: NodeId,
        output: &Output,
        warnings: Vec<Warning>,
        work: &Work<'_>,
    ) -> Result<Option<Record>, Error> {
        let Some(folder) = self.folder else { return Ok(None) };
        let facts = (entry(node).facts)(output)?;
        let key = self.plan.keys.get(node).cloned().ok_or(Error::NotKept { node })?;
        let (method, parents) =
            (entry(node).method, self.plan.keys.shown_parents(self.case_state, node));
        let record = Record { key, method, parents, files: vec![], facts, warnings };
        let saved = (entry(node).save)(output, work).and_then(|()| folder.keep(node, record));
        if saved.is_err() {
            folder.undo(node);
        }
        saved.map(Some)
    }

    /// Takes a result over, and drops those that nobody needs any more.
    fn finished(&self, state: &mut State, node: NodeId, output: Option<Output>, done: Done) {
        let key = self.plan.keys.get(node).cloned();
        if let (Some(output), Some(key), Ok(mut cells)) = (output, key, self.cells.lock()) {
            cells.put(node, key, output.clone(), done.warnings.clone());
            state.outputs.insert(node, output);
        }
        state.done.insert(node, done);
        if self.drops {
            self.drop_unneeded(state);
        }
    }

    /// Drops all results that no step to come needs.
    fn drop_unneeded(&self, state: &mut State) {
        let mut needed = BTreeSet::new();
        for (&node, step) in self.plan.steps.iter().filter(|(n, _)| !state.done.contains_key(n)) {
            match step {
                Step::Make(_) => needed.extend(self.plan.keys.parents(self.case_state, node)),
                Step::Held | Step::Write => drop(needed.insert(node)),
                Step::Kept(_) | Step::Load(_) => {}
            }
        }
        let stays = |node: NodeId| needed.contains(&node) || self.stays.contains(&node);
        state.outputs.retain(|node, _| stays(*node));
        if let Ok(mut cells) = self.cells.lock() {
            cells.retain(stays);
        }
    }
}

/// How a step ended, and with which result, if that was needed.
type Ended = (NodeId, std::thread::Result<Result<(Option<Output>, Done), Error>>);

/// A result, its record, its warnings, and whether it was there.
type Stepped = (Option<Output>, Option<Record>, Vec<Warning>, bool);

/// What a node gets from those before it.
struct Before {
    outputs: Vec<Output>,
    warned: Vec<Warning>,
    written: Vec<File>,
}

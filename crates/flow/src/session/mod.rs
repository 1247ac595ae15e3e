//! A session: what was given, and all that was derived from it, held in memory.
//!
//! Set a parameter, ask for a node: what is stale is found from the graph and made anew, all else
//! is taken as it is. Any number of sessions live in one process; each has its own threads. A
//! session knows no method and no name of a file.

mod bring;
mod cells;
mod execute;
mod given;
mod observer;
mod plan;
mod values;

pub(crate) use observer::Watched;
pub use observer::{Observer, Unwatched};

use crate::case_state::CaseState;
use crate::folder::{HeldResult, Record, RunFolder, refuse_overlap};
use crate::graph::{Node, typed};
use crate::inputs::Inputs;
use crate::key::Key;
use crate::memory::Meter;
use crate::spec::{Case, CaseError, Spec};
use crate::{Error, NodeId};
use cells::Cells;
use plan::{Keys, ancestors};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, RwLock};
use supine_dicom::Clock;
use supine_report::{Link, Warning};

/// Memory that a session's results may hold while nobody works on them, bytes: a CT of 512 x 512 x
/// 400 voxels before and after, its labels, surfaces and fields.
const BUDGET: usize = 4 << 30;

/// Threads of the live lane: what somebody waits for goes on while all others work.
const LIVE_THREADS: usize = 2;

/// What was given, and all that was derived from it.
pub struct Session {
    case_state: RwLock<Arc<CaseState>>,
    cells: Mutex<Cells>,
    folder: Mutex<Option<RunFolder>>,
    /// All cores but one, or as many as were asked for.
    pool: rayon::ThreadPool,
    /// A few threads for what somebody waits for.
    live: rayon::ThreadPool,
    /// The newest question of the live lane.
    newest: AtomicU64,
    budget: usize,
    /// Never dropped by a run.
    holds: BTreeSet<NodeId>,
    start: Option<Start>,
    meter: &'static Meter,
}

impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Session({} threads)", self.pool.current_num_threads())
    }
}

/// Who waits for the work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lane {
    /// Somebody looks on: two threads, nothing is written, and a newer question ends an older one.
    Live,
    /// The result: all threads, and all of it is written to the session's folder.
    #[default]
    Final,
}

/// When and by which command a session began.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Start {
    /// Date and time of the place where it runs.
    pub clock: Clock,
    /// The program's name and what was given to it.
    pub command: Vec<String>,
}

/// What is asked of a session.
#[derive(Clone, Copy)]
pub struct Request<'a> {
    /// Who watches.
    pub observer: &'a dyn Observer,
    /// Who waits.
    pub lane: Lane,
    /// Makes this node and all that rest on it anew.
    pub force: Option<NodeId>,
    /// Drops results as soon as nobody in this work needs them.
    pub drops: bool,
}

impl std::fmt::Debug for Request<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { lane, force, drops, .. } = self;
        write!(f, "Request({lane:?}, force {force:?}, drops {drops})")
    }
}

impl Default for Request<'_> {
    fn default() -> Self {
        Self { observer: &Unwatched, lane: Lane::Final, force: None, drops: false }
    }
}

/// How a node was done.
#[derive(Clone, Debug)]
pub(crate) struct Done {
    pub(crate) seconds: f64,
    /// Its result was there.
    pub(crate) cached: bool,
    pub(crate) warnings: Vec<Warning>,
    /// Its record in the folder.
    pub(crate) record: Option<Record>,
    /// The most memory that the session held at once up to its end, MB, if it is counted.
    pub(crate) peak_memory_mb: Option<f64>,
}

/// Whether a result that is held is of what is given now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freshness {
    /// Of what is given now.
    Fresh,
    /// Of what was given before.
    Stale,
}

impl Session {
    /// A session of a specification, with a number of threads (0: all cores).
    ///
    /// # Errors
    /// When the values contradict each other, files that a repeated run read have changed since, or
    /// worker threads could not be started.
    pub fn new(spec: Spec, threads: usize) -> Result<Self, Error> {
        let inputs = Inputs::default();
        check_recorded(&spec, &inputs)?;
        let meter = Meter::leaked();
        let pool = |threads: usize| {
            let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let built = builder.start_handler(|_| meter.enter()).build();
            built.map_err(|e| Error::Threads(e.to_string()))
        };
        let case_state = CaseState {
            case: Arc::new(spec.case()?),
            spec: Arc::new(spec),
            inputs: Arc::new(inputs),
            tumours: Arc::default(),
            secret: None,
            given: BTreeMap::new(),
        };
        Ok(Self {
            case_state: RwLock::new(Arc::new(case_state)),
            cells: Mutex::default(),
            folder: Mutex::new(None),
            pool: pool(threads)?,
            live: pool(if threads == 1 { 1 } else { LIVE_THREADS })?,
            newest: AtomicU64::new(0),
            budget: BUDGET,
            holds: BTreeSet::new(),
            start: None,
            meter,
        })
    }

    /// The same with a folder, in which results are kept and from which they come back.
    ///
    /// # Errors
    /// When an input lies where results are written, or the folder holds the finished result of
    /// another case.
    pub fn with_folder(self, folder: RunFolder) -> Result<Self, Error> {
        self.refuse_overlap(folder.root())?;
        self.refuse_other(&folder)?;
        *lock(&self.folder) = Some(folder);
        Ok(self)
    }

    /// Refuses a folder for results, before it is made, in which an input lies or would be.
    ///
    /// # Errors
    /// [`Error::Overlap`].
    pub fn refuse_overlap(&self, root: &Path) -> Result<(), Error> {
        let case_state = self.case_state();
        for (key, path) in case_state.spec.paths() {
            let path = case_state.path(path);
            refuse_overlap(root, key, &path)?;
            // The samples of a volume may lie elsewhere than its header.
            for beside in supine_exchange::volume_files(&path).unwrap_or_default() {
                refuse_overlap(root, key, &beside)?;
            }
        }
        Ok(())
    }

    /// Refuses a folder that holds the finished result of another case, unless that may be
    /// replaced.
    fn refuse_other(&self, folder: &RunFolder) -> Result<(), Error> {
        if folder.overwrites() {
            return Ok(());
        }
        match self.other_result(folder.root()) {
            Some(held) => Err(Error::OtherResult {
                path: folder.root().into(),
                held: held.told(),
                ct: self.case_state().case.ct.clone().map(|ct| self.case_state().path(&ct)),
            }),
            None => Ok(()),
        }
    }

    /// The finished result of another case that a folder holds, also one that a run which failed
    /// has set aside; nothing is changed.
    pub(crate) fn other_result(&self, root: &Path) -> Option<HeldResult> {
        let held = HeldResult::of(root).or_else(|| HeldResult::set_aside(root));
        let held = held.or_else(|| HeldResult::without_summary(root))?;
        let case_state = self.case_state();
        let ct = case_state.case.ct.as_ref().map(|ct| case_state.path(ct));
        // A CT that was given in memory has no place, and no result of it is kept in a folder.
        let key = self.key(NodeId::Import);
        let other = ct.is_some_and(|ct| !held.is_of(&ct, &case_state.inputs, key.as_deref()));
        other.then_some(held)
    }

    /// The same with another budget for what is held while nobody works, bytes.
    #[must_use]
    pub fn with_budget(mut self, bytes: usize) -> Self {
        self.budget = bytes;
        self
    }

    /// The same, in whose memory a run leaves the results of some nodes; else it leaves none.
    #[must_use]
    pub fn holding(mut self, nodes: &[NodeId]) -> Self {
        self.holds.extend(nodes);
        self
    }

    /// The same, begun by a command at a date and time: exported objects bear it where the case
    /// names none.
    #[must_use]
    pub fn with_start(mut self, start: Option<Start>) -> Self {
        self.start = start;
        self
    }

    /// How it began, if that was said.
    pub(crate) fn start(&self) -> Option<&Start> {
        self.start.as_ref()
    }

    /// Gives a node its result in place of having it made; `key` names its content.
    pub(crate) fn give<N: Node>(&self, out: N::Out, key: String) {
        let key = format!("given {key}");
        lock(&self.cells).put(N::ID, key.clone(), Arc::new(out), vec![]);
        self.change(|case_state| {
            case_state.given.insert(N::ID, key);
        });
    }

    /// Changes a parameter (`null`: not given any more); the nodes whose results are stale now.
    ///
    /// # Errors
    /// When the value does not fit or contradicts others; all stays as it was then.
    pub fn set(&self, key: &str, value: &serde_json::Value) -> Result<Vec<NodeId>, Error> {
        self.change_spec(|spec| spec.set(key, value))
    }

    /// Changes all parameters at once; the nodes whose results are stale now.
    ///
    /// # Errors
    /// When values contradict each other; all stays as it was then.
    pub fn set_all(&self, all: Spec) -> Result<Vec<NodeId>, Error> {
        self.change_spec(|spec| {
            *spec = all;
            Ok(())
        })
    }

    fn change_spec(
        &self,
        change: impl FnOnce(&mut Spec) -> Result<(), CaseError>,
    ) -> Result<Vec<NodeId>, Error> {
        self.change(|case_state| {
            let mut spec = (*case_state.spec).clone();
            change(&mut spec)?;
            case_state.case = Arc::new(spec.case()?);
            case_state.spec = Arc::new(spec);
            Ok::<_, Error>(())
        })?;
        Ok(NodeId::ALL.into_iter().filter(|node| self.is_stale(*node)).collect())
    }

    /// Keeps results in a folder from now on; in memory alone without one.
    ///
    /// # Errors
    /// When an input lies where results are written, or the folder holds the finished result of
    /// another case.
    pub fn keep_in(&self, folder: Option<RunFolder>) -> Result<(), Error> {
        if let Some(folder) = &folder {
            self.refuse_overlap(folder.root())?;
            self.refuse_other(folder)?;
        }
        *lock(&self.folder) = folder;
        Ok(())
    }

    /// The values that are given now.
    pub fn spec(&self) -> Arc<Spec> {
        Arc::clone(&self.case_state().spec)
    }

    /// The case that is given now.
    pub fn case(&self) -> Arc<Case> {
        Arc::clone(&self.case_state().case)
    }

    fn is_held(&self, node: NodeId) -> bool {
        lock(&self.cells).peek(node).is_some()
    }

    /// Does work on the thread of the live lane.
    pub fn on_live<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.live.install(work)
    }

    fn pool_of(&self, lane: Lane) -> &rayon::ThreadPool {
        if lane == Lane::Live { &self.live } else { &self.pool }
    }

    /// Whether a result is held that is not of what is given now.
    pub fn is_stale(&self, node: NodeId) -> bool {
        let held = lock(&self.cells).peek(node).map(|cell| cell.key.clone());
        held.is_some_and(|held| self.key(node).as_ref() != Some(&held))
    }

    /// The key that a node's result has with what is given now, if what is held tells it.
    pub(crate) fn key(&self, node: NodeId) -> Option<String> {
        let case_state = self.case_state();
        let wanted = ancestors(&case_state, &[node]).ok()?;
        let keys = Keys::of(&case_state, &wanted, &|node, key| self.shown(None, node, key)).ok()?;
        keys.get(node).cloned()
    }

    /// A result that is held, fresh or stale; nothing is made.
    pub(crate) fn peek<N: Node>(&self) -> Option<(Arc<N::Out>, Freshness)> {
        let cell = lock(&self.cells).peek(N::ID).cloned()?;
        let fresh = self.key(N::ID).as_ref() == Some(&cell.key);
        let freshness = if fresh { Freshness::Fresh } else { Freshness::Stale };
        Some((typed::<N>(&cell.output), freshness))
    }

    /// A node's result: held, read back or made.
    pub(crate) fn get<N: Node>(&self, request: &Request<'_>) -> Result<Arc<N::Out>, Error> {
        let run = self.bring(&[N::ID], &[N::ID], request)?;
        run.outputs.get(&N::ID).map(typed::<N>).ok_or(Error::NotKept { node: N::ID })
    }

    /// Memory that results hold, bytes.
    pub fn bytes(&self) -> usize {
        lock(&self.cells).bytes()
    }

    /// The most memory that the session's work held at once since it was last asked to start
    /// counting anew, MB; none in a program without [`crate::CountingAllocator`].
    pub fn peak_memory_mb(&self) -> Option<f64> {
        self.meter.peak_mb()
    }

    /// Counts the session's memory anew, from what it holds now.
    pub fn reset_peak_memory(&self) {
        self.meter.reset();
    }

    /// Drops a result; it comes back from the folder, or is made again.
    pub fn forget(&self, node: NodeId) {
        if !self.case_state().given.contains_key(&node) {
            lock(&self.cells).remove(node);
        }
    }

    /// Threads of its final lane.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    pub(crate) fn case_state(&self) -> Arc<CaseState> {
        Arc::clone(&self.case_state.read().unwrap_or_else(std::sync::PoisonError::into_inner))
    }

    /// Changes what was given, unless the change fails.
    fn change<T: Outcome>(&self, change: impl FnOnce(&mut CaseState) -> T) -> T {
        let mut held = self.case_state.write().unwrap_or_else(std::sync::PoisonError::into_inner);
        let mut case_state = (**held).clone();
        let outcome = change(&mut case_state);
        if outcome.is_good() {
            *held = Arc::new(case_state);
        }
        outcome
    }

    /// The nodes that a run would do over the finished one that left these links and this secret;
    /// nothing is done.
    pub(crate) fn redone(
        &self,
        left: &[Link],
        secret: Option<[u8; 32]>,
    ) -> Result<Vec<NodeId>, Error> {
        let case_state = CaseState { secret, ..(*self.case_state()).clone() };
        let wanted = ancestors(&case_state, &NodeId::ALL)?;
        let link = |node: NodeId, key: &Key| {
            left.iter().find(|link| link.stage == node.name() && link.key == *key)
        };
        let shown = |node, key: &Key| {
            link(node, key).map(|link| link.value.clone().unwrap_or_else(|| key.clone()))
        };
        let keys = Keys::of(&case_state, &wanted, &shown)?;
        let is_new = |node: &NodeId| keys.get(*node).is_none_or(|key| link(*node, key).is_none());
        Ok(wanted.into_iter().filter(is_new).collect())
    }

    /// Works with the session's folder.
    pub(crate) fn folder<T>(
        &self,
        work: impl FnOnce(&RunFolder) -> Result<T, Error>,
    ) -> Result<T, Error> {
        lock(&self.folder).as_ref().map_or(Err(Error::NoFolder), work)
    }
}

/// That the files of a summary that is repeated are those that its run read.
fn check_recorded(spec: &Spec, inputs: &Inputs) -> Result<(), Error> {
    for (key, path, known) in spec.recorded() {
        let path = spec.folder().join(path);
        // One that is not there is told by whoever reads it: the case can be looked at without.
        let file = inputs.file(key, &path).ok();
        if file.is_some_and(|file| !known.contains(&file.hash())) {
            return Err(Error::InputsChanged { key, path });
        }
    }
    Ok(())
}

/// Whether a change is to be kept.
trait Outcome {
    fn is_good(&self) -> bool;
}

impl Outcome for () {
    fn is_good(&self) -> bool {
        true
    }
}

impl Outcome for Option<Key> {
    fn is_good(&self) -> bool {
        self.is_some()
    }
}

impl Outcome for Result<(), Error> {
    fn is_good(&self) -> bool {
        self.is_ok()
    }
}

/// What a lock holds; a thread that failed while it held it left nothing half-done.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

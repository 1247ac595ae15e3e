//! The one owner of what is open: requests change it, the page is told of each change.

use crate::Error;
use crate::adjacent::AdjacentObject;
use crate::bed::Previewed;
use crate::draw::lines::{Cuttable, Line};
use crate::draw::surface::{Drawn, Shape};
use crate::draw::voxels::{VolumeShown, Voxels};
use crate::job::JobObserver;
use crate::live::{KeptBed, Live};
use crate::navigation::follow::Following;
use crate::roots::{Listing, Roots};
use crate::show::DisplayedInputs;
use crate::state::{Job, LiveShown, NodeShown, Phase, PreviewShown, Problem, State, SurfaceShown};
use crate::unsaved::{Kept, prune};
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use supine_dicom_network::Node;
use supine_flow::{CarriedKind, CaseFile, OwnObjects, Session, Start};
use tokio::sync::watch;

/// The page is told of progress no more often.
const OFTEN: Duration = Duration::from_millis(50);
/// How long the end of the program waits for the end of its work.
const PATIENCE: Duration = Duration::from_secs(10);

/// What is open, who works on it, and who looks.
pub(crate) struct Workspace {
    held: Mutex<OpenCase>,
    idle: Condvar,
    /// What goes on beside the work.
    pub(crate) live: Live,
    pub(crate) kept_bed: KeptBed,
    /// The navigation that is followed.
    pub(crate) following: Following,
    told: watch::Sender<Arc<str>>,
    pub(crate) threads: usize,
    /// When and by which command the program began.
    pub(crate) start: Option<Start>,
}

/// What the workspace holds.
pub(crate) struct OpenCase {
    pub(crate) roots: Roots,
    pub(crate) session: Option<Arc<Session>>,
    pub(crate) case: Option<CaseFile>,
    /// Where changes of cases that no file holds are kept, and those of the case that is open.
    pub(crate) unsaved: Option<PathBuf>,
    pub(crate) kept: Option<Kept>,
    pub(crate) state: State,
    /// Volumes by name, with the keys under which they are fetched.
    pub(crate) voxels: BTreeMap<&'static str, (String, Voxels)>,
    /// Surfaces by name, with their keys.
    pub(crate) surfaces: BTreeMap<&'static str, (String, Shape, Drawn)>,
    /// What planes cut, by volume, with the keys under which it is asked for.
    pub(crate) lines: BTreeMap<&'static str, (String, Arc<Cuttable>)>,
    pub(crate) seen: DisplayedInputs,
    /// The patient's own structures and doses that are shown.
    pub(crate) own: Option<OwnObjects>,
    /// What lies beside the CT.
    pub(crate) beside: Vec<AdjacentObject>,
    /// The side that was proposed from the tumour's place, as long as nobody has set one.
    pub(crate) side_proposed: bool,
    /// The last change of the case, as the command line takes it.
    pub(crate) edited: Vec<String>,
    /// The folder of the run that is shown.
    pub(crate) result: Option<PathBuf>,
    /// The case that it is of, as text; none where it was changed during the run.
    pub(crate) result_of: Option<String>,
    /// What was told of the work, the newest last.
    pub(crate) log: VecDeque<LogLine>,
    /// The last picture of the table.
    pub(crate) previewed: Option<Previewed>,
    /// The series of the folder that was looked through: where, and which Series Instance UID.
    pub(crate) series: Vec<(PathBuf, String)>,
    /// Objects of other kinds in that folder.
    pub(crate) objects: Vec<(CarriedKind, PathBuf)>,
    /// Set to end the work.
    cancel: Arc<AtomicBool>,
    keys: u64,
    told_at: Option<Instant>,
    closed: bool,
}

impl Workspace {
    /// A workspace that sees what lies below a folder.
    ///
    /// # Errors
    /// When it is not there.
    pub(crate) fn new(
        root: &Path,
        threads: usize,
        start: Option<Start>,
    ) -> Result<Arc<Self>, Error> {
        let state = State {
            version: env!("CARGO_PKG_VERSION"),
            command: "supine open".into(),
            ..State::default()
        };
        let held = OpenCase {
            roots: Roots::new(root)?,
            session: None,
            case: None,
            unsaved: None,
            kept: None,
            state,
            voxels: BTreeMap::new(),
            surfaces: BTreeMap::new(),
            lines: BTreeMap::new(),
            seen: DisplayedInputs::default(),
            own: None,
            beside: vec![],
            side_proposed: false,
            edited: vec![],
            result: None,
            result_of: None,
            log: VecDeque::new(),
            previewed: None,
            series: vec![],
            objects: vec![],
            cancel: Arc::default(),
            keys: 0,
            told_at: None,
            closed: false,
        };
        let told = watch::Sender::new(text(&held.state));
        let (idle, live, kept_bed) = (Condvar::new(), Live::default(), KeptBed::default());
        let (held, following) = (Mutex::new(held), Following::default());
        Ok(Arc::new(Self { held, idle, live, kept_bed, following, told, threads, start }))
    }

    /// The state as JSON, now and after each change.
    pub(crate) fn watched(&self) -> watch::Receiver<Arc<str>> {
        self.told.subscribe()
    }

    /// Changes what is held, and tells.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut OpenCase) -> T) -> T {
        let mut held = self.held();
        let out = change(&mut held);
        self.tell(&mut held);
        out
    }

    /// The same where the page need not be told of each change.
    pub(crate) fn change_often(&self, change: impl FnOnce(&mut OpenCase)) {
        let mut held = self.held();
        change(&mut held);
        if held.told_at.is_none_or(|at| at.elapsed() >= OFTEN) {
            self.tell(&mut held);
        }
    }

    fn tell(&self, held: &mut OpenCase) {
        held.told_at = Some(Instant::now());
        self.told.send_replace(text(&held.state));
    }

    pub(crate) fn held(&self) -> MutexGuard<'_, OpenCase> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Names archives for the page.
    pub(crate) fn name_nodes(&self, nodes: &[Node]) {
        let shown = nodes.iter().enumerate().map(|(n, node)| {
            let (address, id) = (node.to_string(), n.to_string());
            let name = address.split('@').next().unwrap_or_default().to_owned();
            NodeShown { id, name, address }
        });
        self.change(|held| held.state.nodes = shown.collect());
    }

    /// Keeps what no file holds in a folder from now on, and offers what is there.
    pub(crate) fn keep_unsaved(&self, folder: Option<PathBuf>) {
        self.change(|held| {
            held.state.unsaved_gone = folder.as_deref().map(prune).unwrap_or_default();
            held.unsaved = folder;
            held.show_unsaved();
        });
    }

    /// Begins work on a thread of its own; what it fails with is told.
    ///
    /// # Errors
    /// [`Error::Busy`] while other work goes on.
    pub(crate) fn begin(
        self: &Arc<Self>,
        what: &str,
        work: impl FnOnce(&Arc<Self>, &JobObserver) -> Result<(), Error> + Send + 'static,
    ) -> Result<(), Error> {
        let cancel = self.change(|held| {
            if held.state.job.is_some() || held.closed {
                return Err(Error::Busy);
            }
            held.cancel = Arc::default();
            held.state.problem = None;
            held.state.job = Some(Job { what: what.into(), share: 0.0, can_cancel: true });
            Ok(Arc::clone(&held.cancel))
        })?;
        self.live.make_way();
        let (workspace, watching) = (Arc::clone(self), JobObserver::new(Arc::clone(self), cancel));
        std::thread::spawn(move || {
            // What fails here must not leave the workspace busy for ever.
            let work = std::panic::AssertUnwindSafe(|| work(&workspace, &watching));
            let done = std::panic::catch_unwind(work);
            let session = workspace.change(|held| {
                held.end(done.unwrap_or_else(|_| Err(Error::Broken)));
                held.session.clone().filter(|_| !held.closed)
            });
            if let Some(session) = session {
                workspace.prepare(&session);
            }
            workspace.idle.notify_all();
        });
        Ok(())
    }

    /// Ends the work that goes on at its next step.
    pub(crate) fn cancel(&self) {
        self.held().cancel.store(true, Ordering::SeqCst);
    }

    /// Ends all work, and waits for it.
    pub(crate) fn close(&self) {
        self.live.end();
        self.leave();
        let mut held = self.held();
        held.closed = true;
        held.cancel.store(true, Ordering::SeqCst);
        let busy = |held: &mut OpenCase| held.state.job.is_some();
        drop(self.idle.wait_timeout_while(held, PATIENCE, busy));
    }

    /// What a folder holds.
    ///
    /// # Errors
    /// When it does not lie below the root, or cannot be read.
    pub(crate) fn list(&self, dir: Option<&str>) -> Result<Listing, Error> {
        self.change(|held| {
            held.show_unsaved();
            held.roots.list(dir)
        })
    }

    /// The bytes of a surface under a key.
    pub(crate) fn surface(&self, part: &str, key: &str) -> Option<Vec<u8>> {
        let held = self.held();
        let (_, (own, _, drawn)) = held.surfaces.iter().find(|(name, _)| **name == part)?;
        (own == key).then(|| drawn.bytes())
    }

    /// What was told of the work.
    pub(crate) fn log(&self) -> Vec<LogLine> {
        self.held().log.iter().cloned().collect()
    }

    /// The lines of a plane under a key.
    pub(crate) fn lines(
        &self,
        volume: &str,
        key: &str,
        (view, slice): (&str, usize),
    ) -> Option<Vec<Line>> {
        let cuttable = {
            let held = self.held();
            let (_, (own, cuttable)) = held.lines.iter().find(|(name, _)| **name == volume)?;
            (own == key).then(|| Arc::clone(cuttable))?
        };
        cuttable.lines(view, slice)
    }

    /// The voxels of a volume under a key.
    pub(crate) fn voxels(&self, id: &str, key: &str) -> Option<Voxels> {
        let held = self.held();
        let (_, (own, voxels)) = held.voxels.iter().find(|(name, _)| **name == id)?;
        (own == key).then(|| voxels.clone())
    }
}

/// A line of the log.
#[derive(Clone, Debug, serde::Serialize)]
pub(crate) struct LogLine {
    /// Since the work began.
    seconds: f64,
    stage: String,
    text: String,
}

/// More lines are not kept.
const LOG: usize = 500;

impl OpenCase {
    /// Adds a line to the log.
    pub(crate) fn tell(&mut self, began: Instant, stage: &str, text: String) {
        if self.log.len() == LOG {
            self.log.pop_front();
        }
        let seconds = began.elapsed().as_secs_f64();
        self.log.push_back(LogLine { seconds, stage: stage.into(), text });
    }

    fn end(&mut self, done: Result<(), Error>) {
        self.state.job = None;
        if self.state.phase == Phase::Reading {
            self.state.phase = Phase::Empty;
            // What could not be opened is offered still.
            self.kept = None;
            self.show_unsaved();
        }
        let failed = match done {
            Ok(()) => None,
            Err(error) if error.is_stop() => None,
            Err(error) => Some(Problem::of(&error)),
        };
        let state = if failed.is_some() { "failed" } else { "none" };
        for stage in self.state.stages.iter_mut().filter(|stage| stage.state == "running") {
            (stage.state, stage.share) = (state, None);
        }
        // What was there before work that was given up is there still.
        if let (None, Some(session)) = (&failed, self.session.clone()) {
            self.mark_as(&session);
        }
        self.state.problem = failed.or(self.state.problem.take());
    }

    /// Shows a volume under a key of its own.
    pub(crate) fn show(&mut self, id: &'static str, voxels: Voxels, fresh: bool) {
        let known = self.voxels.get(id).filter(|(_, known)| known.is_same(&voxels));
        let key = known.map(|(key, _)| key.clone()).unwrap_or_else(|| self.next_key());
        let known = self.state.volumes.iter().find(|volume| volume.id == id);
        let body = known.and_then(|volume| volume.body);
        let shown = VolumeShown { body, ..voxels.shown(id, key.clone(), fresh) };
        match self.state.volumes.iter_mut().find(|volume| volume.id == id) {
            Some(volume) => *volume = shown,
            None => self.state.volumes.push(shown),
        }
        self.voxels.insert(id, (key, voxels));
    }

    /// Shows a volume no longer.
    pub(crate) fn hide(&mut self, id: &str) {
        self.voxels.remove(id);
        self.state.volumes.retain(|volume| volume.id != id);
    }

    /// A key that nothing had before.
    pub(crate) fn next_key(&mut self) -> String {
        self.keys += 1;
        self.keys.to_string()
    }

    /// Shows a surface under a key of its own.
    pub(crate) fn show_surface(&mut self, part: &'static str, shape: Shape, drawn: Drawn) {
        if self.surfaces.get(part).is_some_and(|(.., known)| *known == drawn) {
            return;
        }
        let key = self.next_key();
        self.surfaces.insert(part, (key, shape, drawn));
        self.show_surfaces();
    }

    /// Shows a surface no longer.
    pub(crate) fn hide_surface(&mut self, part: &str) {
        if self.surfaces.remove(part).is_some() {
            self.show_surfaces();
        }
    }

    fn show_surfaces(&mut self) {
        let shown = self.surfaces.iter();
        let shown = shown.map(|(part, (key, shape, drawn))| {
            let (shape, kind) = (shape.name(), drawn.kind());
            SurfaceShown { part, key: key.clone(), shape, kind }
        });
        self.state.surfaces = shown.collect();
    }

    /// Closes what is open.
    pub(crate) fn clear(&mut self) {
        (self.session, self.case, self.state.case) = (None, None, None);
        self.kept = None;
        self.state.patient = None;
        (self.state.result, self.state.tumour, self.result) = (None, None, None);
        (self.state.sent, self.state.own, self.own) = (None, None, None);
        (self.side_proposed, self.beside) = (false, vec![]);
        self.state.beside.clear();
        self.edited.clear();
        self.state.figures.clear();
        self.log.clear();
        self.state.revision += 1;
        self.voxels.clear();
        self.surfaces.clear();
        (self.seen, self.state.live) = (DisplayedInputs::default(), LiveShown::default());
        self.previewed = None;
        self.state.preview_bed = PreviewShown::default();
        self.state.preview_applicator = PreviewShown::default();
        self.lines.clear();
        self.state.lines.clear();
        self.state.surfaces.clear();
        self.state.volumes.clear();
        self.state.views.clear();
        self.state.warnings.clear();
        self.state.patches.clear();
        self.state.stages.clear();
        self.state.phase = Phase::Reading;
    }
}

fn text(state: &State) -> Arc<str> {
    serde_json::to_string(state).unwrap_or_default().into()
}

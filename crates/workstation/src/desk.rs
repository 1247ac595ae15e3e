//! The one owner of what is open: requests change it, the page is told of each change.

use crate::Error;
use crate::bytes::Voxels;
use crate::job::Watching;
use crate::roots::{Listing, Roots};
use crate::state::{Job, Phase, Problem, State, SurfaceShown};
use crate::surface::Surface;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use supine_flow::{CaseFile, Session, Start};
use tokio::sync::watch;

/// The page is told of progress no more often.
const OFTEN: Duration = Duration::from_millis(50);
/// How long the end of the program waits for the end of its work.
const PATIENCE: Duration = Duration::from_secs(10);

/// What is open, who works on it, and who looks.
pub(crate) struct Desk {
    held: Mutex<Held>,
    idle: Condvar,
    told: watch::Sender<Arc<str>>,
    pub(crate) threads: usize,
    /// When and by which command the program began.
    pub(crate) start: Option<Start>,
}

/// What the desk holds.
pub(crate) struct Held {
    pub(crate) roots: Roots,
    pub(crate) session: Option<Arc<Session>>,
    pub(crate) case: Option<CaseFile>,
    pub(crate) state: State,
    /// Volumes by name, with the keys under which they are fetched.
    pub(crate) voxels: BTreeMap<&'static str, (String, Voxels)>,
    /// Surfaces by name, with their keys.
    pub(crate) surfaces: BTreeMap<&'static str, (String, Surface)>,
    /// The series of the folder that was looked through: where, and which Series Instance UID.
    pub(crate) series: Vec<(PathBuf, String)>,
    /// Set to end the work.
    cancel: Arc<AtomicBool>,
    keys: u64,
    told_at: Option<Instant>,
    closed: bool,
}

impl Desk {
    /// A desk that sees what lies below a folder.
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
        let held = Held {
            roots: Roots::new(root)?,
            session: None,
            case: None,
            state,
            voxels: BTreeMap::new(),
            surfaces: BTreeMap::new(),
            series: vec![],
            cancel: Arc::default(),
            keys: 0,
            told_at: None,
            closed: false,
        };
        let told = watch::Sender::new(text(&held.state));
        Ok(Arc::new(Self { held: Mutex::new(held), idle: Condvar::new(), told, threads, start }))
    }

    /// The state as JSON, now and after each change.
    pub(crate) fn watched(&self) -> watch::Receiver<Arc<str>> {
        self.told.subscribe()
    }

    /// Changes what is held, and tells.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Held) -> T) -> T {
        let mut held = self.held();
        let out = change(&mut held);
        self.tell(&mut held);
        out
    }

    /// The same where the page need not be told of each change.
    pub(crate) fn change_often(&self, change: impl FnOnce(&mut Held)) {
        let mut held = self.held();
        change(&mut held);
        if held.told_at.is_none_or(|at| at.elapsed() >= OFTEN) {
            self.tell(&mut held);
        }
    }

    fn tell(&self, held: &mut Held) {
        held.told_at = Some(Instant::now());
        self.told.send_replace(text(&held.state));
    }

    pub(crate) fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins work on a thread of its own; what it fails with is told.
    ///
    /// # Errors
    /// [`Error::Busy`] while other work goes on.
    pub(crate) fn begin(
        self: &Arc<Self>,
        what: &str,
        work: impl FnOnce(&Arc<Self>, &Watching) -> Result<(), Error> + Send + 'static,
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
        let (desk, watching) = (Arc::clone(self), Watching::new(Arc::clone(self), cancel));
        std::thread::spawn(move || {
            // What fails here must not leave the desk busy for ever.
            let work = std::panic::AssertUnwindSafe(|| work(&desk, &watching));
            let done = std::panic::catch_unwind(work);
            desk.change(|held| held.end(done.unwrap_or_else(|_| Err(Error::Broken))));
            desk.idle.notify_all();
        });
        Ok(())
    }

    /// Ends the work that goes on at its next step.
    pub(crate) fn cancel(&self) {
        self.held().cancel.store(true, Ordering::SeqCst);
    }

    /// Ends all work, and waits for it.
    pub(crate) fn close(&self) {
        let mut held = self.held();
        held.closed = true;
        held.cancel.store(true, Ordering::SeqCst);
        let busy = |held: &mut Held| held.state.job.is_some();
        drop(self.idle.wait_timeout_while(held, PATIENCE, busy));
    }

    /// What a folder holds.
    ///
    /// # Errors
    /// When it does not lie below the root, or cannot be read.
    pub(crate) fn list(&self, dir: Option<&str>) -> Result<Listing, Error> {
        self.held().roots.list(dir)
    }

    /// The bytes of a surface under a key.
    pub(crate) fn surface(&self, part: &str, key: &str) -> Option<Vec<u8>> {
        let held = self.held();
        let (_, (own, surface)) = held.surfaces.iter().find(|(name, _)| **name == part)?;
        (own == key).then(|| surface.bytes())
    }

    /// The voxels of a volume under a key.
    pub(crate) fn voxels(&self, id: &str, key: &str) -> Option<Voxels> {
        let held = self.held();
        let (_, (own, voxels)) = held.voxels.iter().find(|(name, _)| **name == id)?;
        (own == key).then(|| voxels.clone())
    }
}

impl Held {
    fn end(&mut self, done: Result<(), Error>) {
        self.state.job = None;
        if self.state.phase == Phase::Reading {
            self.state.phase = Phase::Empty;
        }
        let failed = match done {
            Ok(()) | Err(Error::Flow(supine_flow::Error::Stopped)) => None,
            Err(error) => Some(Problem::of(&error)),
        };
        let state = if failed.is_some() { "failed" } else { "none" };
        for stage in self.state.stages.iter_mut().filter(|stage| stage.state == "running") {
            (stage.state, stage.share) = (state, None);
        }
        self.state.problem = failed.or(self.state.problem.take());
    }

    /// Shows a volume under a key of its own.
    pub(crate) fn show(&mut self, id: &'static str, voxels: Voxels, fresh: bool) {
        let known = self.voxels.get(id).filter(|(_, known)| known.is_same(&voxels));
        let key = known.map(|(key, _)| key.clone()).unwrap_or_else(|| {
            self.keys += 1;
            self.keys.to_string()
        });
        let shown = voxels.shown(id, key.clone(), fresh);
        match self.state.volumes.iter_mut().find(|volume| volume.id == id) {
            Some(volume) => *volume = shown,
            None => self.state.volumes.push(shown),
        }
        self.voxels.insert(id, (key, voxels));
    }

    /// Shows a surface under a key of its own.
    pub(crate) fn show_surface(&mut self, part: &'static str, surface: Surface) {
        if self.surfaces.get(part).is_some_and(|(_, known)| *known == surface) {
            return;
        }
        self.keys += 1;
        self.surfaces.insert(part, (self.keys.to_string(), surface));
        let shown = self.surfaces.iter();
        let shown = shown.map(|(part, (key, _))| SurfaceShown { part, key: key.clone() });
        self.state.surfaces = shown.collect();
    }

    /// Closes what is open.
    pub(crate) fn clear(&mut self) {
        (self.session, self.case, self.state.case) = (None, None, None);
        (self.state.result, self.state.tumour) = (None, None);
        self.state.revision += 1;
        self.voxels.clear();
        self.surfaces.clear();
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

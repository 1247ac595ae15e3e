//! The store behind its lock: whoever changes it does so here, and the page is told of each change.

use crate::Error;
use crate::roots::Roots;
use crate::store::Store;
use crate::store::state::State;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// The page is told of progress no more often.
const OFTEN: Duration = Duration::from_millis(50);

/// What is open, and who looks.
pub(crate) struct Workspace {
    /// With when the page was told last.
    store: Mutex<(Store, Option<Instant>)>,
    states: watch::Sender<Arc<str>>,
}

impl Workspace {
    /// A workspace that sees what lies below a folder.
    ///
    /// # Errors
    /// When it is not there.
    pub(crate) fn new(root: &Path) -> Result<Arc<Self>, Error> {
        let store = Store::new(Roots::new(root)?);
        let states = watch::Sender::new(text(&store));
        Ok(Arc::new(Self { store: Mutex::new((store, None)), states }))
    }

    /// The state as JSON, now and after each change.
    pub(crate) fn watched(&self) -> watch::Receiver<Arc<str>> {
        self.states.subscribe()
    }

    /// Looks at the store; nobody changes it meanwhile.
    pub(crate) fn look<T>(&self, look: impl FnOnce(&Store) -> T) -> T {
        look(&self.lock().0)
    }

    /// Changes the store, and tells.
    pub(crate) fn change<T>(&self, change: impl FnOnce(&mut Store) -> T) -> T {
        let (store, told_at) = &mut *self.lock();
        let out = change(store);
        self.tell(store, told_at);
        out
    }

    /// The same where the page need not be told of each change.
    pub(crate) fn change_often(&self, change: impl FnOnce(&mut Store)) {
        let (store, told_at) = &mut *self.lock();
        change(store);
        if told_at.is_none_or(|at| at.elapsed() >= OFTEN) {
            self.tell(store, told_at);
        }
    }

    fn tell(&self, store: &Store, told_at: &mut Option<Instant>) {
        *told_at = Some(Instant::now());
        self.states.send_replace(text(store));
    }

    fn lock(&self) -> MutexGuard<'_, (Store, Option<Instant>)> {
        self.store.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn text(store: &Store) -> Arc<str> {
    serde_json::to_string(&State::from(store)).unwrap_or_default().into()
}

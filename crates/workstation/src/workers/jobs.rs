//! The work that was asked for: one piece at a time, on a thread of its own.

use crate::Error;
use crate::workers::live::Live;
use crate::workers::reporter::Reporter;
use crate::workspace::Workspace;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How long the end of the program waits for the end of its work.
const PATIENCE: Duration = Duration::from_secs(10);

/// Begins work and ends it.
pub(crate) struct Jobs {
    pub(crate) workspace: Arc<Workspace>,
    /// What goes on beside.
    pub(crate) live: Arc<Live>,
    /// Threads that have not ended.
    running: Mutex<usize>,
    idle: Condvar,
}

impl Jobs {
    pub(crate) fn new(workspace: Arc<Workspace>, live: Arc<Live>) -> Arc<Self> {
        Arc::new(Self { workspace, live, running: Mutex::default(), idle: Condvar::new() })
    }

    /// Begins work; what it fails with is told.
    ///
    /// # Errors
    /// [`Error::Busy`] while other work goes on.
    pub(crate) fn begin(
        self: &Arc<Self>,
        what: &str,
        work: impl FnOnce(&Reporter) -> Result<(), Error> + Send + 'static,
    ) -> Result<(), Error> {
        let cancel = self.workspace.change(|store| store.work.begin(what))?;
        self.live.make_way();
        *self.running() += 1;
        let report = Reporter::new(Arc::clone(&self.workspace), cancel, false);
        let jobs = Arc::clone(self);
        std::thread::spawn(move || {
            // What fails here must not leave the page busy for ever.
            let done = catch_unwind(AssertUnwindSafe(|| work(&report)));
            let done = done.unwrap_or(Err(Error::Broken));
            if let Some(session) = jobs.workspace.change(|store| store.end(done)) {
                jobs.live.prepare(&session);
            }
            *jobs.running() -= 1;
            jobs.idle.notify_all();
        });
        Ok(())
    }

    /// Ends all work, and waits for it.
    pub(crate) fn close(&self) {
        self.live.end();
        self.workspace.change(|store| store.work.close());
        let wait = |running: &mut usize| *running > 0;
        drop(self.idle.wait_timeout_while(self.running(), PATIENCE, wait));
    }

    fn running(&self) -> MutexGuard<'_, usize> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

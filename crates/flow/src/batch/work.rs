//! The cases at work: some threads, each of which takes the next case, waits until it fits, and
//! runs it.

use super::admit::Admission;
use super::cases::Case;
use super::need::need_of;
use super::one::{BROKE_OFF, BROKE_OFF_TEXT, Lost, OneCase, RunCase, told};
use super::{Batch, BatchObserver};
use crate::commands::run::finished;
use crate::folder::{CohortFolder, forget_failed};
use crate::session::Session;
use crate::spec::Spec;
use crate::status::Told;
use crate::{Error, Summary};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use supine_report::RunStatus;
use supine_space::Failure;

/// What a batch does and with what.
pub(super) struct Work<'a> {
    pub(super) given: &'a Batch,
    /// By name.
    pub(super) cases: &'a [Case],
    pub(super) folder: &'a CohortFolder,
    pub(super) admission: Admission,
    pub(super) run: &'a RunCase<'a>,
    pub(super) observer: &'a dyn BatchObserver,
}

impl Work<'_> {
    /// Runs all cases, so many at once; how each ended that was looked at, by name.
    pub(super) fn all(&self, jobs: usize) -> Result<Vec<RunStatus>, Error> {
        let (next, broken) = (AtomicUsize::new(0), AtomicBool::new(false));
        let order = self.order();
        let ended: Mutex<Vec<(usize, RunStatus)>> = Mutex::default();
        let failed: Mutex<Option<Error>> = Mutex::default();
        let worker = || {
            while self.observer.go_on() && !broken.load(Ordering::SeqCst) {
                let Some(&n) = order.get(next.fetch_add(1, Ordering::SeqCst)) else { break };
                let case = &self.cases[n];
                let before = self.folder.kept(&case.name);
                let Some((status, kept)) = self.one(case) else { break };
                if let Err(error) = self.folder.keep(&case.name, &status, before.as_ref()) {
                    // Where nothing can be kept, no case can be told of.
                    broken.store(true, Ordering::SeqCst);
                    lock(&failed).get_or_insert(error);
                }
                self.observer.end(&case.name, &status, kept);
                lock(&ended).push((n, status));
            }
            self.admission.leave();
        };
        std::thread::scope(|scope| {
            for _ in 0..jobs {
                scope.spawn(worker);
            }
        });
        if let Some(error) = lock(&failed).take() {
            return Err(error);
        }
        let mut ended = std::mem::take(&mut *lock(&ended));
        ended.sort_by_key(|(n, _)| *n);
        Ok(ended.into_iter().map(|(_, status)| status).collect())
    }

    /// Indices of the cases in the order in which they are begun: by name, those in the midst of
    /// which the system ended an earlier call after all others, which they shall not cost their
    /// turn once more.
    fn order(&self) -> Vec<usize> {
        let ended = |n: &usize| self.folder.was_not_ended(&self.cases[*n].name);
        let (last, mut order): (Vec<_>, Vec<_>) = (0..self.cases.len()).partition(ended);
        order.extend(last);
        order
    }

    /// Runs a case, if it is not finished; how it ended, and whether its result was there. None
    /// when it was not begun.
    fn one(&self, case: &Case) -> Option<(RunStatus, bool)> {
        let out = self.folder.run(&case.name);
        // A mistake of ours in one case is no reason to lose the others.
        let tried = catch_unwind(AssertUnwindSafe(|| self.tried(case, &out)));
        tried.unwrap_or_else(|_| {
            let told = told(self.given, case, &out, Err(Error::Stopped));
            Some((told.broken(Failure::Method, BROKE_OFF, BROKE_OFF_TEXT), false))
        })
    }

    fn tried(&self, case: &Case, out: &Path) -> Option<(RunStatus, bool)> {
        let told = told(self.given, case, out, case.values(self.given));
        let need = match told.spec.as_ref().map(|spec| looked_at(spec, out)) {
            Ok(Ok(Look::Finished(summary))) => {
                // On a disk that cannot be written nothing was noted either.
                let _forgotten = forget_failed(out);
                return Some((told.finished(&summary), true));
            }
            Ok(Ok(Look::Open(need))) => need,
            // Its own words say why.
            Ok(Err(_)) | Err(_) => 0,
        };
        let admitted = self.admission.enter(need, &|| self.observer.go_on())?;
        self.observer.begin(&case.name, admitted.threads);
        let told = Told { threads: admitted.threads, ..told };
        if told.spec.is_ok() {
            // That nothing can be kept is told when the case ended.
            let _kept = self.folder.keep(&case.name, &told.not_ended(), None);
        }
        let asked = OneCase { case: case.clone(), threads: admitted.threads };
        let status = (self.run)(&asked, self.observer);
        Some((status.unwrap_or_else(|lost| self.lost(&told, &lost)), false))
    }

    /// Of a case that was run by a process which did not tell how it ended.
    fn lost(&self, told: &Told<'_>, lost: &Lost) -> RunStatus {
        match lost {
            _ if !self.observer.go_on() => told.stopped(),
            Lost::Ended => told.not_ended(),
            Lost::BrokeOff => told.broken(Failure::Method, BROKE_OFF, BROKE_OFF_TEXT),
            Lost::NotStarted(why) => {
                let text =
                    format!("a process for the case cannot be started ({why}); run it again");
                told.broken(Failure::Retry, "not-started", &text)
            }
        }
    }
}

/// What a look at a case tells.
enum Look {
    /// It is finished.
    Finished(Box<Summary>),
    /// It is not, and needs so many bytes.
    Open(u64),
}

/// Whether a run of these values is finished; if not, what it needs.
fn looked_at(spec: &Spec, out: &Path) -> Result<Look, Error> {
    spec.check_complete()?;
    let session = Session::new(spec.clone(), 1)?;
    if let Some(summary) = finished(&session, out)? {
        return Ok(Look::Finished(Box::new(summary)));
    }
    need_of(&session).map(Look::Open)
}

/// What a lock holds; a thread that failed while it held it left nothing half-done.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

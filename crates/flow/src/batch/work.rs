//! The cases at work: some threads, each of which takes the next case, waits until it fits, and runs it.

use super::admit::Admission;
use super::cases::{Case, place_in};
use super::need::need_of;
use super::{Batch, BatchObserver};
use crate::commands::run::finished;
use crate::folder::CohortFolder;
use crate::session::Session;
use crate::spec::Spec;
use crate::status::Told;
use crate::{Error, NodeId, Observer, Summary};
use serde_json::Value as Json;
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

    /// Indices of the cases in the order in which they are begun: by name, those in the midst of which the system ended an
    /// earlier call after all others, which they shall not cost their turn once more.
    fn order(&self) -> Vec<usize> {
        let ended = |n: &usize| self.folder.was_not_ended(&self.cases[*n].name);
        let (last, mut order): (Vec<_>, Vec<_>) = (0..self.cases.len()).partition(ended);
        order.extend(last);
        order
    }

    /// Runs a case, if it is not finished; how it ended, and whether its result was there. None when it was not begun.
    fn one(&self, case: &Case) -> Option<(RunStatus, bool)> {
        let out = self.folder.run(&case.name);
        // A mistake of ours in one case is no reason to lose the others.
        let tried = catch_unwind(AssertUnwindSafe(|| self.tried(case, &out)));
        tried.unwrap_or_else(|_| {
            let text = "the program broke off in this case, which is a mistake in it; the message on the terminal says where";
            let told = self.told(case, &out, Err(Error::Stopped));
            Some((told.broken(Failure::Method, "broke-off", text), false))
        })
    }

    fn tried(&self, case: &Case, out: &Path) -> Option<(RunStatus, bool)> {
        let told = self.told(case, out, self.values(case));
        let need = match told.spec.as_ref().map(|spec| self.looked_at(spec, out)) {
            Ok(Ok(Look::Finished(summary))) => {
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
        let watch = Watch { name: &case.name, done: AtomicUsize::new(0), observer: self.observer };
        let (done, mut status) = told.run(&watch);
        if let (Err(error), Some(told)) = (&done, &mut status.error) {
            match status.case_file {
                Some(_) => told.place.file = place_in(error.place(), case).file,
                None => self.observer.withheld(&case.name, &error.to_string()),
            }
        }
        Some((status, false))
    }

    /// The values that a case is run with.
    fn values(&self, case: &Case) -> Result<Spec, Error> {
        let mut spec = case.spec(&self.given.changes)?;
        if self.given.anonymise {
            spec.set("export.anonymise", &Json::Bool(true))?;
        }
        Ok(spec)
    }

    fn told<'a>(&self, case: &'a Case, out: &'a Path, spec: Result<Spec, Error>) -> Told<'a> {
        Told {
            name: case.name.clone(),
            nameless: case.name.clone(),
            case_file: case.base(),
            spec,
            anonymise: self.given.anonymise,
            out,
            options: self.given.options,
            start: self.given.start.clone(),
            threads: 1,
            worst: self.given.worst,
        }
    }

    /// Whether a run of these values is finished; if not, what it needs.
    fn looked_at(&self, spec: &Spec, out: &Path) -> Result<Look, Error> {
        spec.check_complete()?;
        let session = Session::new(spec.clone(), 1)?;
        if let Some(summary) = finished(&session, out)? {
            return Ok(Look::Finished(Box::new(summary)));
        }
        need_of(&session).map(Look::Open)
    }
}

/// What a look at a case tells.
enum Look {
    /// It is finished.
    Finished(Box<Summary>),
    /// It is not, and needs so many bytes.
    Open(u64),
}

/// A case as its run sees who watches.
struct Watch<'a> {
    name: &'a str,
    done: AtomicUsize,
    observer: &'a dyn BatchObserver,
}

impl Observer for Watch<'_> {
    fn end(&self, _: NodeId, _: f64, _: bool) {
        let done = self.done.fetch_add(1, Ordering::SeqCst) + 1;
        self.observer.share(self.name, (done as f64 / NodeId::ALL.len() as f64).min(1.0));
    }

    fn go_on(&self) -> bool {
        self.observer.go_on()
    }
}

/// What a lock holds; a thread that failed while it held it left nothing half-done.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

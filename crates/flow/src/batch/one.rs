//! One case of a batch: what whoever runs it needs to know, and its run.

use super::cases::{Case, place_in};
use super::{Batch, BatchObserver};
use crate::folder::run_of;
use crate::spec::Spec;
use crate::status::Told;
use crate::{Error, NodeId, Observer};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_report::RunStatus;
use supine_space::Failure;

/// The code of a case in which the program broke off.
pub(super) const BROKE_OFF: &str = "broke-off";
/// What is said of it.
pub(super) const BROKE_OFF_TEXT: &str = "the program broke off in this case, which is a mistake in it; the message on the terminal says where";

/// A case that is to be run, and on how many threads.
#[derive(Clone, Debug)]
pub struct OneCase {
    pub(super) case: Case,
    pub(super) threads: usize,
}

/// Runs a case of a batch, wherever that is, and says how it ended. Called from several threads at
/// once. Whoever does it in another process calls [`run_one`] there, so that a case that takes all
/// memory ends itself alone.
pub type RunCase<'a> = dyn Fn(&OneCase, &dyn BatchObserver) -> Result<RunStatus, Lost> + Sync + 'a;

/// Why nobody knows how a case ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Lost {
    /// Its process was ended from outside, or got no memory.
    Ended,
    /// Its process broke off by a mistake in it.
    BrokeOff,
    /// Its process could not be started, and why.
    NotStarted(String),
}

impl OneCase {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.case.name
    }

    /// Its case file, or the table in which it stands.
    pub fn file(&self) -> &Path {
        &self.case.file
    }

    /// Threads that it may use.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Its row in a table as text for [`OneCase::new`], as the table may change while the batch
    /// runs; none of a case file.
    pub fn row(&self) -> Option<String> {
        self.case.row.as_ref().map(|row| row.text())
    }

    /// The case of a file, or of a row of a table in the words of [`OneCase::row`].
    ///
    /// # Errors
    /// When these are no words of a row.
    pub fn new(
        name: String,
        file: &Path,
        row: Option<&str>,
        threads: usize,
    ) -> Result<Self, Error> {
        let row = row.map(super::rows::Row::from_text).transpose()?;
        Ok(Self { case: Case::new(name, file.into(), row), threads })
    }
}

/// Runs one case here. A failure is told in the status.
pub fn run_one(given: &Batch, one: &OneCase, observer: &dyn BatchObserver) -> RunStatus {
    let (case, out) = (&one.case, run_of(&given.out, &one.case.name));
    let tried = catch_unwind(AssertUnwindSafe(|| {
        let told = Told { threads: one.threads, ..told(given, case, &out, case.values(given)) };
        let watch = Watch { name: &case.name, done: AtomicUsize::new(0), observer };
        let (done, mut status) = told.run(&watch);
        if let (Err(error), Some(told)) = (&done, &mut status.error) {
            match status.case_file {
                Some(_) => told.place.file = place_in(error.place(), case).file,
                None => observer.withheld(&case.name, &error.to_string()),
            }
        }
        status
    }));
    tried.unwrap_or_else(|_| {
        let told = told(given, case, &out, Err(Error::Stopped));
        told.broken(Failure::Method, BROKE_OFF, BROKE_OFF_TEXT)
    })
}

/// A case as its status tells of it.
pub(super) fn told<'a>(
    given: &Batch,
    case: &'a Case,
    out: &'a Path,
    spec: Result<Spec, Error>,
) -> Told<'a> {
    Told {
        name: case.name.clone(),
        nameless: case.name.clone(),
        case_file: &case.base,
        spec,
        anonymise: given.anonymise,
        out,
        options: given.options,
        start: given.start.clone(),
        threads: 1,
        worst: given.worst,
    }
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

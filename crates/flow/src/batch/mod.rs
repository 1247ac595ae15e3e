//! Many cases on one machine: each in a folder of its own, as many at once as memory and cores
//! allow, and all of them in one table and on one page.
//!
//! Who calls says where a case is run, such as in a process of its own. A case that fails ends
//! itself alone; what is finished is not done again.

mod admit;
mod cases;
mod need;
mod one;
mod rows;
#[cfg(test)]
mod tests;
mod work;

pub use one::{Lost, OneCase, RunCase, run_one};

use crate::commands::run::Change;
use crate::folder::{CohortFolder, whole};
use crate::status::finished;
use crate::{Error, Options, Start, Summary};
use std::path::{Path, PathBuf};
use supine_report::{Colour, Ended, Patient, RunStatus};
use supine_space::Failure;

/// Share of the available memory that is used unless somebody says how much.
const SHARE: f64 = 0.8;
/// Memory that is used where the system does not tell how much there is, bytes.
const UNTOLD: u64 = 4_000_000_000;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Case files, folders that hold `case.toml`, and tables (`.csv`).
    pub cases: Vec<PathBuf>,
    /// Where all results go.
    pub out: PathBuf,
    /// Cases at once; as many as there are cores without.
    pub jobs: Option<usize>,
    /// Memory for all together, bytes; most of what the machine has now without.
    pub memory: Option<u64>,
    /// Cores for all together.
    pub cores: usize,
    /// Changes of the values of every case.
    pub changes: Vec<Change>,
    /// Takes the patients out of all that leaves, whatever the cases say.
    pub anonymise: bool,
    /// The worst verdict that does.
    pub worst: Colour,
    /// Where each run ends.
    pub options: Options,
    /// When and by which command it began.
    pub start: Option<Start>,
}

/// Sees a batch from outside, and may end it. Called from several threads at once.
pub trait BatchObserver: Sync {
    /// So many cases are looked at.
    fn cases(&self, _number: usize) {}
    /// A case begins, on so many threads.
    fn begin(&self, _name: &str, _threads: usize) {}
    /// Share of a case done, 0..=1.
    fn share(&self, _name: &str, _share: f64) {}
    /// Why a de-identified case failed, in words that may name files: its status does not hold
    /// them.
    fn withheld(&self, _name: &str, _message: &str) {}
    /// A case ended; `kept` when its result was there.
    fn end(&self, _name: &str, _status: &RunStatus, _kept: bool) {}
    /// Whether the work may go on.
    fn go_on(&self) -> bool {
        true
    }
}

/// What became of a batch.
#[derive(Clone, Debug)]
pub struct BatchDone {
    /// How each case ended that was looked at, by name.
    pub ended: Vec<RunStatus>,
    /// Cases that were not begun.
    pub left: usize,
    /// Whether somebody stopped it.
    pub stopped: bool,
    /// The table of all patients in the folder.
    pub table: PathBuf,
    /// Their page.
    pub page: PathBuf,
    /// Number of patients in both.
    pub patients: usize,
    /// Names of others in the folder that are no cases of this call: neither table nor page holds
    /// them.
    pub others: Vec<String>,
}

impl BatchDone {
    /// How it failed, in the kind that has the exit code: the worst of its cases. Stopped before
    /// all; a failure before a verdict that does not do; worth a retry when all that failed are.
    pub fn failure(&self) -> Option<Failure> {
        if self.stopped {
            return Some(Failure::Stopped);
        }
        let failed = || self.ended.iter().filter(|status| status.status == Ended::Failed);
        if failed().next().is_some() {
            let retry = failed().all(|status| status.exit == Failure::Retry.exit_code());
            return Some(if retry { Failure::Retry } else { Failure::Method });
        }
        let denied = self.ended.iter().any(|status| status.exit == Failure::Check.exit_code());
        denied.then_some(Failure::Check)
    }

    /// How many ended so.
    pub fn count(&self, ended: Ended) -> usize {
        self.ended.iter().filter(|status| status.status == ended).count()
    }
}

/// Runs cases, as many at once as fit, and makes table and page of all patients in the folder.
///
/// # Errors
/// When the cases cannot be told apart, a table cannot be read, or the folder cannot be written or
/// is in use: nothing is run then. A case that fails is no error.
pub fn batch(
    given: &Batch,
    run: &RunCase<'_>,
    observer: &dyn BatchObserver,
) -> Result<BatchDone, Error> {
    let cases = cases::cases(&given.cases)?;
    let folder = CohortFolder::open(&given.out)?;
    let _lock = folder.lock()?;
    observer.cases(cases.len());
    let memory = given
        .memory
        .unwrap_or_else(|| need::available().map_or(UNTOLD, |bytes| (bytes as f64 * SHARE) as u64));
    let jobs = given.jobs.unwrap_or(given.cores).clamp(1, cases.len().max(1));
    let admission = admit::Admission::new(memory, given.cores, jobs);
    let work = work::Work { given, cases: &cases, folder: &folder, admission, run, observer };
    let ended = work.all(jobs)?;
    let left = cases.len() - ended.len();
    let stopped = left > 0 || ended.iter().any(|status| status.status == Ended::Stopped);
    let own = |name: &str| cases.iter().any(|case| case.name == name);
    Ok(BatchDone { left, stopped, ended, ..gathered(&folder, given.worst, &own)? })
}

/// Makes table and page of what a folder holds, and runs nothing: of the cases' states and runs
/// that others left there.
///
/// # Errors
/// When it is no folder of a batch, or cannot be written.
pub fn collect(out: &Path, worst: Colour) -> Result<BatchDone, Error> {
    std::fs::read_dir(out).map_err(|source| Error::Unread { path: out.into(), source })?;
    gathered(&CohortFolder::open(out)?, worst, &|_| true)
}

/// Table and page of the patients in a folder that are wanted.
fn gathered(
    folder: &CohortFolder,
    worst: Colour,
    wanted: &dyn Fn(&str) -> bool,
) -> Result<BatchDone, Error> {
    let of_summary = |name: &str, summary: &Summary| of_summary(folder, name, summary, worst);
    let names = folder.names();
    let (own, others): (Vec<String>, Vec<String>) =
        names.into_iter().partition(|name| wanted(name));
    let patients: Vec<Patient> = folder.patients(own, &of_summary);
    let [table, page] = folder.write(&patients)?;
    let ended = patients.iter().map(|patient| patient.status.clone()).collect();
    let patients = patients.len();
    Ok(BatchDone { ended, left: 0, stopped: false, table, page, patients, others })
}

/// How a run ended of which a summary alone is left.
fn of_summary(folder: &CohortFolder, name: &str, summary: &Summary, worst: Colour) -> RunStatus {
    let asked = summary.case.get("export").and_then(|export| export.get("anonymise"));
    let shown = asked != Some(&serde_json::Value::Bool(true));
    let out = shown.then(|| whole(&folder.run(name)));
    finished(RunStatus { out, ..RunStatus::unfinished(name) }, summary, worst)
}

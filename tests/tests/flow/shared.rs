//! The one run that the tests share.

use std::path::Path;
use std::sync::OnceLock;
use supine_tests::{Case, Finished, Outcome, supine_command};

/// A finished run of the small case on two threads, for looking alone.
pub(crate) fn shared() -> &'static Finished {
    static SHARED: OnceLock<Finished> = OnceLock::new();
    SHARED.get_or_init(|| Finished::of(&Case::small()))
}

/// The run whose tumour is held by the chest wall, for looking alone.
pub(crate) fn held() -> &'static Finished {
    static HELD: OnceLock<Finished> = OnceLock::new();
    HELD.get_or_init(Finished::held)
}

/// Runs a case.
pub(crate) fn run(case: &Path, out: &Path, threads: usize) -> Outcome {
    let mut command = supine_command();
    command.arg("run").arg(case).arg("--out").arg(out);
    command.args(["--no-progress", "--threads", &threads.to_string()]);
    Outcome::of(&mut command)
}

/// Runs a case up to a stage on two threads.
pub(crate) fn run_until(stage: &str, case: &Path, out: &Path) -> Outcome {
    let mut command = supine_command();
    command.arg("run").arg(case).arg("--out").arg(out).args(["--until", stage]);
    Outcome::of(command.args(["--no-progress", "--threads", "2"]))
}

/// A folder that goes with the test.
pub(crate) fn scratch() -> tempfile::TempDir {
    tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a scratch folder can be made")
}

/// The summary that a run left.
pub(crate) fn summary(out: &Path) -> serde_json::Value {
    let text = std::fs::read_to_string(out.join("summary.json")).expect("the run left a summary");
    serde_json::from_str(&text).expect("the summary is JSON")
}

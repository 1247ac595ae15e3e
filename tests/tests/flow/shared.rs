//! The one run that the tests share.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use supine_tests::{Case, Outcome, supine_command};

/// A finished run of the small case on two threads.
pub(crate) struct Shared {
    /// Its case file.
    pub(crate) case: PathBuf,
    /// What it left.
    pub(crate) out: PathBuf,
    /// Held as long as the tests run: another process of this test waits, then makes its own.
    _lock: File,
}

/// The run, made on first use.
pub(crate) fn shared() -> &'static Shared {
    static SHARED: OnceLock<Shared> = OnceLock::new();
    SHARED.get_or_init(|| {
        let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let lock = File::create(scratch.join("flow.lock")).expect("the lock can be made");
        lock.lock().expect("the lock can be taken");
        let folder = scratch.join("flow");
        if folder.exists() {
            std::fs::remove_dir_all(&folder).expect("the last run can be removed");
        }
        std::fs::create_dir(&folder).expect("the run's folder can be made");
        let (case, out) = (Case::small().write(&folder), folder.join("out"));
        run(&case, &out, 2).success("supine run");
        Shared { case, out, _lock: lock }
    })
}

/// Runs a case.
pub(crate) fn run(case: &Path, out: &Path, threads: usize) -> Outcome {
    let mut command = supine_command();
    command.arg("run").arg(case).arg("--out").arg(out);
    command.args(["--no-progress", "--threads", &threads.to_string()]);
    Outcome::of(&mut command)
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

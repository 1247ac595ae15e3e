//! Finished runs that tests look at: each is made once, by whichever process of the tests needs it
//! first, and nobody writes into it.

use crate::binary::{Outcome, supine_command};
use crate::case::Case;
use crate::folder::copy_folder;
use crate::workspace::target;
use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A finished run.
#[derive(Clone, Debug)]
pub struct Finished {
    /// Its case file.
    pub case: PathBuf,
    /// What it left; for looking alone.
    pub out: PathBuf,
}

/// Stands in the folder of a run that came to its end.
const COMPLETE: &str = "complete";

impl Finished {
    /// The run of a case by the program under test on two threads.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn of(case: &Case) -> Self {
        Self::made(case, |_| {}, 0)
    }

    /// The run of the case whose tumour is held, which goes on from that of the small case and ends
    /// with 4.
    ///
    /// # Panics
    /// When it cannot be made.
    pub fn held() -> Self {
        let small = Self::of(&Case::small());
        Self::made(&Case::held(), |out| small.begin(out), 4)
    }

    /// The run of a case in a folder that is begun somehow; it ends with this code.
    fn made(case: &Case, begin: impl FnOnce(&Path), code: i32) -> Self {
        let all = target().join("tmp/finished");
        std::fs::create_dir_all(&all).expect("the folder of runs can be made");
        let name = hash(&case.text());
        let lock = File::create(all.join(format!("{name}.lock"))).expect("the lock can be made");
        // Another process that makes the same run is waited for.
        lock.lock().expect("the lock can be taken");
        let folder = all.join(name);
        let complete = folder.join(COMPLETE);
        let finished = Self { case: folder.join("case.toml"), out: folder.join("out") };
        let program = program();
        if std::fs::read_to_string(&complete).is_ok_and(|by| by == program) {
            return finished;
        }
        if folder.exists() {
            std::fs::remove_dir_all(&folder).expect("the run of another program can be removed");
        }
        std::fs::create_dir(&folder).expect("the run's folder can be made");
        begin(&finished.out);
        let mut command = supine_command();
        command.arg("run").arg(case.write(&folder)).arg("--out").arg(&finished.out);
        let said = Outcome::of(command.args(["--no-progress", "--threads", "2"]));
        assert_eq!(said.code, Some(code), "supine run: {}", said.stderr);
        std::fs::write(complete, program).expect("that it is complete can be written");
        finished
    }

    /// A copy of what it left, to be written into.
    pub fn copy_to(&self, out: &Path) {
        copy_folder(&self.out, out);
    }

    /// What it left without how it ended: a run of another case into it makes the stages that the
    /// case touches. For tests of what a run makes, not of whether it makes it anew.
    pub fn begin(&self, out: &Path) {
        self.copy_to(out);
        for name in ["summary.json", "log.jsonl"] {
            std::fs::remove_file(out.join(name)).expect("how it ended can be removed");
        }
    }
}

/// Names a text.
fn hash(text: &str) -> String {
    let mut hasher = DefaultHasher::new();
    text.hash(&mut hasher);
    format!("{:016x}", hasher.finish())
}

/// Tells the program under test from what was built before and after it.
fn program() -> String {
    let path = PathBuf::from(supine_command().get_program());
    let facts = std::fs::metadata(&path).expect("the program is there");
    let written = facts.modified().expect("when it was written is known");
    hash(&format!("{} {} {written:?}", path.display(), facts.len()))
}

//! The test executables: built by one call of cargo, each run as one job or, when that would take
//! long, as several.

use super::command::{Logs, seated};
use super::harness;
use super::known::{Known, Subject};
use super::outcome::Report;
use super::pool::Seat;
use super::selection::runs_program;
use super::times::Times;
use crate::House;
use anyhow::{Context, Result, bail};
use cargo_metadata::{Message, Metadata};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// An executable whose tests would take longer is run as several jobs, s.
const LONG: f64 = 45.0;

/// A test executable.
pub(crate) struct Executable {
    /// Package and target, as in `supine-flow/session`.
    pub(crate) name: String,
    path: PathBuf,
    /// The folder of its package, in which cargo would run it.
    folder: PathBuf,
}

impl Executable {
    /// The name of its package.
    pub(crate) fn package(&self) -> &str {
        self.name.split('/').next().unwrap_or(&self.name)
    }
}

/// What a build of the tests left.
#[derive(Default)]
pub(crate) struct Built {
    pub(crate) executables: Vec<Executable>,
    /// The program `supine`, when it was among what was built.
    pub(crate) supine: Option<PathBuf>,
}

/// Compiles tests by a command of cargo's (`test --no-run …`) and tells what it made.
///
/// # Errors
/// When something cannot be compiled: with all that cargo said.
pub(crate) fn build(
    cargo: &mut Command,
    metadata: &Metadata,
    log: &Path,
    goes_on: impl Fn() -> bool,
) -> Result<Built> {
    let file = File::create(log).with_context(|| log.display().to_string())?;
    cargo.args(["--no-run", "--message-format=json-render-diagnostics"]);
    let mut child = cargo
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(file)
        .spawn()
        .context("cargo cannot be started")?;
    let output = child.stdout.take().context("cargo's output is piped")?;
    let mut built = Built::default();
    for message in Message::parse_stream(BufReader::new(output)) {
        if !goes_on() {
            child.kill()?;
            child.wait()?;
            bail!("given up");
        }
        let Message::CompilerArtifact(artifact) = message? else { continue };
        let Some(path) = artifact.executable else { continue };
        let package = &metadata[&artifact.package_id];
        if artifact.profile.test {
            let folder = package.manifest_path.parent().context("a manifest lies in a folder")?;
            built.executables.push(Executable {
                name: name(&package.name, &artifact.target),
                path: path.into_std_path_buf(),
                folder: folder.as_std_path().to_owned(),
            });
        } else if artifact.target.name == "supine" {
            built.supine = Some(path.into_std_path_buf());
        }
    }
    let status = child.wait()?;
    if !status.success() {
        bail!("{}", String::from_utf8_lossy(&std::fs::read(log).unwrap_or_default()));
    }
    built.executables.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(built)
}

/// The package and what of it: a library's unit tests go by the package alone.
fn name(package: &str, target: &cargo_metadata::Target) -> String {
    if target.is_test() { format!("{package}/{}", target.name) } else { package.to_owned() }
}

/// The tests of an executable that have to be run.
pub(crate) struct ToRun<'a> {
    pub(crate) shares: Vec<Share<'a>>,
    /// How many others passed before with the same bytes.
    pub(crate) before: usize,
}

/// Some tests of an executable, to be run one after the other.
pub(crate) struct Share<'a> {
    pub(crate) executable: &'a Executable,
    /// What their outcome rests on.
    subject: Subject,
    known: &'a Known,
    supine: &'a Path,
    /// Which of how many.
    pub(crate) part: (usize, usize),
    tests: Vec<String>,
    /// What they are expected to take, s.
    pub(crate) seconds: f64,
}

/// Divides the tests of an executable that did not pass before among as many jobs as are needed for
/// none to take long. The executable is handed the program `supine` if it runs it.
///
/// # Errors
/// When the executable does not list its tests, or a file cannot be read.
pub(crate) fn to_run<'a>(
    executable: &'a Executable,
    supine: &'a Path,
    times: &Times,
    known: &'a Known,
) -> Result<ToRun<'a>> {
    let with = [executable.path.as_path(), supine];
    let with = if runs_program(executable.package()) { &with[..] } else { &with[..1] };
    let subject = known.subject(&executable.name, with)?;
    let names = harness::list(&mut Command::new(&executable.path))?;
    let whole = |name: &str| format!("{}::{name}", executable.name);
    let all = names.len();
    let names: Vec<String> =
        names.into_iter().filter(|name| known.passed(&subject, &whole(name)).is_none()).collect();
    let before = all - names.len();
    let tests = names.into_iter().map(|name| (times.test(&whole(&name)), name)).collect();
    let share = |part, (seconds, tests)| Share {
        executable,
        subject: subject.clone(),
        known,
        supine,
        part,
        tests,
        seconds,
    };
    let divided = divided(tests);
    let parts = divided.len();
    let shares = divided.into_iter().zip(1..).map(|(some, part)| share((part, parts), some));
    Ok(ToRun { shares: shares.collect(), before })
}

/// Tests with what they are expected to take (s), divided so that no part takes much longer than
/// [`LONG`]; each part with what it is expected to take.
fn divided(mut tests: Vec<(f64, String)>) -> Vec<(f64, Vec<String>)> {
    let all: f64 = tests.iter().map(|(seconds, _)| seconds).sum();
    let parts = ((all / LONG).ceil() as usize).max(1).min(tests.len());
    let mut divided: Vec<(f64, Vec<String>)> = vec![(0.0, Vec::new()); parts];
    // The longest first, each to who has least.
    tests.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    for (seconds, test) in tests {
        let least = divided.iter_mut().min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((sum, part)) = least {
            *sum += seconds;
            part.push(test);
        }
    }
    divided
}

impl Share<'_> {
    /// What people call it.
    pub(crate) fn name(&self) -> String {
        match self.part {
            (1, 1) => self.executable.name.clone(),
            (part, parts) => format!("{} {part}/{parts}", self.executable.name),
        }
    }

    /// Runs the tests with the program under test, and keeps which passed.
    ///
    /// # Errors
    /// As [`harness::run`].
    pub(crate) fn run(&self, house: &House, seat: &Seat, logs: &Logs) -> Result<Report> {
        let executable = self.executable;
        let mut command = Command::new(&executable.path);
        command.current_dir(&executable.folder).env("CARGO_MANIFEST_DIR", &executable.folder);
        command.env("CARGO", house.cargo()).env("SUPINE", self.supine);
        let log = logs.path(&format!("{}-{}", executable.name, self.part.0));
        let mut report = harness::run(&mut seated(&command, seat), &self.tests, &log)?;
        let whole = |name: &String| format!("{}::{name}", executable.name);
        report.times.iter_mut().for_each(|(name, _)| *name = whole(name));
        report.failed = report.failed.iter().map(whole).collect();
        let tests: Vec<String> = self.tests.iter().map(whole).collect();
        let passed = tests.iter().filter(|name| !report.failed.contains(*name));
        if report.skipped == 0 {
            self.known.keep(&self.subject, passed.map(|name| (name.as_str(), 1)))?;
        }
        Ok(report)
    }
}

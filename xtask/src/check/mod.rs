//! `cargo xtask test`: everything that must hold.
//!
//! What others provide is installed first: packages of Debian before anything is compiled, Python's
//! beside that. What cannot be installed ends the check at once. The tests are compiled and linted
//! by one call of cargo with all processors. Then they run side by side, one process and one
//! processor each, while cargo does on one processor what is left for it: the wheel, the other
//! meshers, documentation.

mod command;
mod executables;
mod harness;
mod inputs;
mod jobs;
mod known;
mod outcome;
mod pool;
mod pytest;
mod selection;
mod times;

use crate::steps::{cargo, run};
use crate::{House, readers};
use anyhow::{Context, Result, bail};
use cargo_metadata::{Metadata, MetadataCommand};
use command::{Logs, linting, run_quietly, seated};
use executables::Built;
use inputs::Inputs;
use known::Known;
use outcome::{Done, Report};
use pool::Job;
use selection::Selection;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use times::Times;

#[derive(clap::Args)]
pub(crate) struct Options {
    /// Only what a change of this crate can break: itself and all that rests on it
    #[arg(long, value_name = "CRATE")]
    only: Option<String>,
    /// Runs what passed before with the same bytes too
    #[arg(long)]
    again: bool,
    /// Leaves out the documentation and the other meshers
    #[arg(long)]
    fast: bool,
    /// Keeps what the tests took for those who run them for the first time, in xtask/test-times.txt
    #[arg(long)]
    keep_times: bool,
}

/// All that the jobs look at.
pub(crate) struct Check<'a> {
    house: &'a House,
    metadata: &'a Metadata,
    selection: Selection,
    logs: Logs,
    times: Times,
    known: Known,
    /// A copy of the program under test: cargo's own is made anew with other features while the
    /// tests run.
    supine: PathBuf,
}

/// The log of what is compiled first.
const COMPILING: &str = "tests";

/// Installs, compiles, tests.
///
/// # Errors
/// When anything failed; all that could be done was done.
pub(crate) fn run_steps(house: &House, options: &Options) -> Result<()> {
    let begun = Instant::now();
    let received = received();
    let metadata = MetadataCommand::new().current_dir(&house.root).no_deps().exec()?;
    let selection = match &options.only {
        Some(asked) => Selection::of(&metadata, asked)?,
        None => Selection::whole(&metadata),
    };
    if !selection.is_whole() {
        println!("looked at, and nothing else: {}", selection.names());
    }
    println!("\n== installing what others provide");
    readers::install_packages()?;
    fetch(house)?;
    let installed = begun.elapsed();
    println!("-- {:.1} s", installed.as_secs_f64());

    let folder = house.target.join("check");
    let lists = [house.root.join("xtask/test-times.txt"), folder.join("times.txt")];
    let check = Check {
        house,
        metadata: &metadata,
        selection,
        logs: Logs::new(folder.join("logs"))?,
        times: Times::read(&[&lists[0], &lists[1]]),
        known: Known::read(folder.join("passed.txt"), Inputs::of(house), options.again),
        supine: folder.join("supine"),
    };
    let mut done = Vec::new();
    let mut before = 0;
    let built = check.compile(&mut done);
    if let Some(built) = &built {
        println!("\n== tests and documentation, side by side");
        let list = check.jobs(built, options)?;
        if list.before > 0 {
            println!(
                "   {} tests passed before with the same bytes (--again runs them)",
                list.before
            );
        }
        before = list.before;
        done.extend(pool::run(list.jobs, processors()));
    }
    let file = if options.keep_times { &lists[0] } else { &lists[1] };
    times::write(Times::read(&[&lists[0], &lists[1]]), &done, file)?;
    outcome::sum_up(&done, &[("installing", installed)]);
    println!("\nin all {:.0} s by the clock{}", begun.elapsed().as_secs_f64(), worked());
    let megabytes = self::received().saturating_sub(received) as f64 / 1e6;
    println!("this machine received {megabytes:.0} MB over its networks meanwhile");
    outcome::count(&done, before)
}

/// What all processors worked for it, where the system tells.
fn worked() -> String {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // After the name: own and ended children's time, in user and in system mode, in hundredths of a
    // second.
    let fields = stat.rsplit_once(')').map_or("", |(_, fields)| fields).split_whitespace();
    let hundredths: f64 = fields.skip(11).take(4).filter_map(|f| f.parse::<f64>().ok()).sum();
    format!(", {:.0} s of processors", hundredths / 100.0)
}

/// What this machine has received over its networks since it started, bytes; 0 where the system
/// does not tell.
fn received() -> u64 {
    let networks = std::fs::read_to_string("/proc/net/dev").unwrap_or_default();
    let interfaces = networks.lines().filter_map(|line| line.trim_start().split_once(':'));
    let others = interfaces.filter(|(name, _)| *name != "lo");
    others.filter_map(|(_, counts)| counts.split_whitespace().next()?.parse::<u64>().ok()).sum()
}

/// How many processors there are for this process.
fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, Into::into)
}

/// Gets the sources of foreign crates, so that nothing later waits for the network.
///
/// # Errors
/// When they cannot be had.
fn fetch(house: &House) -> Result<()> {
    run(cargo(&house.root).args(["fetch", "--locked", "--quiet"]))
}

impl Check<'_> {
    /// Looks at the format and compiles the tests and the program, and installs Python's packages
    /// meanwhile; nothing when one of both failed.
    fn compile(&self, done: &mut Vec<Done>) -> Option<Built> {
        println!("\n== format, Python packages and compiling");
        let (made, lacks) = (OnceLock::new(), AtomicBool::new(false));
        let install = Job {
            name: "Python packages".into(),
            step: "installing",
            processors: 0,
            seconds: 1e5,
            after: vec![],
            compiles: false,
            work: Box::new(|_| {
                readers::install_environments(self.house)
                    .inspect_err(|_| lacks.store(true, Ordering::Relaxed))?;
                Ok(Report::default())
            }),
        };
        let format = Job {
            name: "every file".into(),
            step: "format",
            processors: 1,
            seconds: 1e4,
            after: vec![],
            compiles: true,
            work: Box::new(|_| {
                let mut format = cargo(&self.house.root);
                run_quietly(format.args(["fmt", "--all", "--check"]), &self.logs.path("format"))?;
                Ok(Report::default())
            }),
        };
        let compile = Job {
            name: "tests and the program".into(),
            step: "compiling",
            processors: processors(),
            seconds: 1.0,
            after: vec![],
            compiles: true,
            work: Box::new(|_| {
                let mut cargo = cargo(&self.house.root);
                linting(&mut cargo)?.arg("test").args(self.selection.to_be_built());
                let log = self.logs.path(COMPILING);
                let goes_on = || !lacks.load(Ordering::Relaxed);
                let mut built = executables::build(&mut cargo, self.metadata, &log, goes_on)?;
                if let Some(supine) = &built.supine {
                    std::fs::copy(supine, &self.supine).context("the program cannot be copied")?;
                } else if self.selection.runs_program() {
                    bail!("cargo built no program `supine`");
                }
                built.executables.retain(|executable| self.selection.has(executable.package()));
                let _first = made.set(built);
                Ok(Report::default())
            }),
        };
        done.extend(pool::run(vec![install, format, compile], processors()));
        made.into_inner().filter(|_| !lacks.into_inner())
    }

    /// A log of a job that consists of several commands.
    fn log(&self, job: &str) -> Result<PathBuf> {
        let log = self.logs.path(job);
        if log.exists() {
            std::fs::remove_file(&log).with_context(|| log.display().to_string())?;
        }
        Ok(log)
    }
}

/// Runs a command of cargo's that compiles as the tests were compiled, on the processors of a job.
///
/// # Errors
/// When it does not end with 0: with what it printed.
fn cargo_job(house: &House, arguments: &[String], seat: &pool::Seat, log: &Path) -> Result<()> {
    let mut command = cargo(&house.root);
    linting(command.args(arguments))?;
    run_quietly(&mut seated(&command, seat), log)
}

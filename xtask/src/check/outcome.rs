//! How the jobs of the check ended, and what is said of them at its end.

use anyhow::{Result, bail};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// A test and the time it took, s.
pub(crate) type Timed = (String, f64);

/// What a job found.
#[derive(Default)]
pub(crate) struct Report {
    /// Tests that passed.
    pub(crate) passed: usize,
    /// Names of tests that failed.
    pub(crate) failed: Vec<String>,
    /// Tests that were left out, by their own word.
    pub(crate) skipped: usize,
    /// What each took.
    pub(crate) times: Vec<Timed>,
    /// What was printed, for whom it failed.
    pub(crate) log: Option<PathBuf>,
}

impl Report {
    /// Adds what another process found.
    pub(crate) fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed.extend(other.failed);
        self.skipped += other.skipped;
        self.times.extend(other.times);
        self.log = other.log.or(self.log.take());
    }
}

/// How a job ended.
pub(crate) enum Outcome {
    /// It came to its end; tests may have failed.
    Ended(Report),
    /// It did not: why.
    Broken(String),
    /// What it rests on did not pass.
    LeftOut,
}

impl Outcome {
    pub(crate) fn passed(&self) -> bool {
        matches!(self, Self::Ended(report) if report.failed.is_empty())
    }
}

/// A job that was dealt with.
pub(crate) struct Done {
    name: String,
    step: String,
    time: Duration,
    pub(crate) outcome: Outcome,
}

impl Done {
    pub(crate) fn new(name: String, step: String, time: Duration, outcome: Outcome) -> Self {
        Self { name, step, time, outcome }
    }

    pub(crate) fn left_out(name: String, step: &str) -> Self {
        Self::new(name, step.into(), Duration::ZERO, Outcome::LeftOut)
    }

    /// What people call it, with its step.
    pub(crate) fn job(&self) -> String {
        format!("{}: {}", self.step, self.name)
    }

    /// What it took, s.
    pub(crate) fn seconds(&self) -> f64 {
        self.time.as_secs_f64()
    }

    /// What each test took.
    pub(crate) fn times(&self) -> &[Timed] {
        match &self.outcome {
            Outcome::Ended(report) => &report.times,
            _ => &[],
        }
    }

    /// One line; of a failure all that was printed.
    pub(crate) fn say(&self) {
        let (seconds, what) = (self.seconds(), self.job());
        match &self.outcome {
            Outcome::LeftOut => println!("   left out          {what}: what it rests on failed"),
            Outcome::Broken(why) => println!("   FAILED {seconds:8.1} s  {what}\n{why}"),
            Outcome::Ended(report) => {
                let tests = match report.passed + report.failed.len() {
                    0 => String::new(),
                    n => format!(", {n} tests"),
                };
                let word = if report.failed.is_empty() { "passed" } else { "FAILED" };
                println!("   {word} {seconds:8.1} s  {what}{tests}");
                if !report.failed.is_empty() {
                    let log = report.log.as_ref().and_then(|log| std::fs::read(log).ok());
                    println!("{}", String::from_utf8_lossy(&log.unwrap_or_default()));
                }
            }
        }
    }
}

/// How many of the slowest tests are named.
const SLOWEST: usize = 10;

/// Prints what each step took and the slowest tests.
pub(crate) fn sum_up(done: &[Done], before: &[(&'static str, Duration)]) {
    let mut steps: BTreeMap<&str, Duration> = before.iter().copied().collect();
    for job in done {
        *steps.entry(&job.step).or_default() += job.time;
    }
    let mut steps: Vec<_> = steps.into_iter().collect();
    steps.sort_by_key(|(_, time)| std::cmp::Reverse(*time));
    println!("\n== time of each step, summed over what ran side by side");
    for (step, time) in steps {
        println!("  {:8.1} s  {step}", time.as_secs_f64());
    }
    let mut times: Vec<&Timed> = done.iter().flat_map(Done::times).collect();
    times.sort_by(|a, b| b.1.total_cmp(&a.1));
    println!("\n== the slowest tests");
    for (name, seconds) in times.iter().take(SLOWEST) {
        println!("  {seconds:8.1} s  {name}");
    }
}

/// Says what failed, then how many tests there were, on the last line, with those that passed
/// before.
///
/// # Errors
/// When anything failed or was left out.
pub(crate) fn count(done: &[Done], before: usize) -> Result<()> {
    let (mut passed, mut failed, mut skipped) = (before, Vec::new(), 0);
    for job in done {
        match &job.outcome {
            Outcome::Ended(report) => {
                passed += report.passed;
                skipped += report.skipped;
                failed.extend(report.failed.iter().map(|test| format!("{}: {test}", job.step)));
            }
            Outcome::Broken(_) => failed.push(job.job()),
            Outcome::LeftOut => failed.push(format!("{} (left out)", job.job())),
        }
    }
    if !failed.is_empty() {
        println!("\n== failed");
        failed.iter().for_each(|what| println!("  {what}"));
    }
    let before = if before > 0 { format!(", {before} of them before") } else { String::new() };
    println!("\n{passed} passed, {} failed, {skipped} skipped{before}", failed.len());
    if failed.is_empty() { Ok(()) } else { bail!("{} of the checks failed", failed.len()) }
}

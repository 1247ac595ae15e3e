//! The steps of a chore: each is named, timed and carried to the summary, whatever its outcome.

use anyhow::{Context, Result, bail};
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// How a step ended.
enum Outcome {
    Passed,
    Failed,
}

/// What was done so far.
pub(crate) struct Steps {
    started: Instant,
    done: Vec<(&'static str, Outcome, Duration)>,
}

impl Steps {
    pub(crate) fn new() -> Self {
        Self { started: Instant::now(), done: Vec::new() }
    }

    /// Runs a step. A failure is printed and kept; the steps after it run all the same, so that one
    /// run tells everything that is wrong.
    pub(crate) fn run(&mut self, name: &'static str, step: impl FnOnce() -> Result<()>) {
        println!("\n== {name}");
        let started = Instant::now();
        let outcome = match step() {
            Ok(()) => Outcome::Passed,
            Err(error) => {
                eprintln!("{name} failed: {error:#}");
                Outcome::Failed
            }
        };
        let time = started.elapsed();
        println!("-- {name}: {:.1} s", time.as_secs_f64());
        self.done.push((name, outcome, time));
    }

    /// Prints the summary.
    ///
    /// # Errors
    /// When a step failed; the message names all that did.
    pub(crate) fn finish(self) -> Result<()> {
        println!("\n== summary");
        let mut failed = Vec::new();
        for (name, outcome, time) in &self.done {
            let seconds = time.as_secs_f64();
            match outcome {
                Outcome::Passed => println!("  passed {seconds:8.1} s  {name}"),
                Outcome::Failed => {
                    println!("  FAILED {seconds:8.1} s  {name}");
                    failed.push(*name);
                }
            }
        }
        println!("  in all {:8.1} s", self.started.elapsed().as_secs_f64());
        if failed.is_empty() {
            println!("all steps passed");
            Ok(())
        } else {
            bail!("failed: {}", failed.join(", "))
        }
    }
}

/// Runs a command to its end with its output shown and no keyboard.
///
/// # Errors
/// When it cannot be started or does not end with 0.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let line = line(command);
    println!("$ {line}");
    let status =
        command.stdin(Stdio::null()).status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// The cargo that runs this chore, in a copy of the repository.
pub(crate) fn cargo(folder: &Path) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"));
    let mut command = Command::new(cargo);
    command.current_dir(folder);
    // What cargo told us of ourselves. A build script that heeds it, as that of TLS's cryptography
    // does, would run anew whenever another program calls cargo.
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_PKG_") || text.starts_with("CARGO_MANIFEST_") {
            command.env_remove(name);
        }
    }
    command
}

/// The command as one would type it.
fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

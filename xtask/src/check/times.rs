//! What tests took when they were run last, by which the check puts those that take long first and
//! splits executables.

use super::outcome::Done;
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// What is kept of a test that is not in the list, s.
const UNKNOWN: f64 = 0.05;
/// Shorter ones are not listed, s.
const WORTH: f64 = 1.0;

/// Seconds by the name of a test or of a job.
#[derive(Default)]
pub(crate) struct Times(BTreeMap<String, f64>);

impl Times {
    /// Reads lists, later ones before earlier ones; a list that is not there says nothing.
    pub(crate) fn read(lists: &[&Path]) -> Self {
        let mut times = BTreeMap::new();
        for list in lists {
            let text = std::fs::read_to_string(list).unwrap_or_default();
            for line in text.lines() {
                if let Some((seconds, name)) = line.trim_start().split_once(' ')
                    && let Ok(seconds) = seconds.parse()
                {
                    times.insert(name.to_owned(), seconds);
                }
            }
        }
        Self(times)
    }

    /// What a test is expected to take, s.
    pub(crate) fn test(&self, name: &str) -> f64 {
        self.0.get(name).copied().unwrap_or(UNKNOWN)
    }

    /// What a job is expected to take, s.
    pub(crate) fn job(&self, name: &str, otherwise: f64) -> f64 {
        self.0.get(name).copied().unwrap_or(otherwise)
    }
}

/// Writes what was measured, with what was known of others.
///
/// # Errors
/// When the file cannot be written.
pub(crate) fn write(known: Times, done: &[Done], file: &Path) -> Result<()> {
    let mut times = known.0;
    for job in done.iter().filter(|job| job.outcome.passed()) {
        times.insert(job.job(), job.seconds());
        times.extend(job.times().iter().cloned());
    }
    let mut text = String::new();
    for (name, seconds) in times.iter().filter(|(_, seconds)| **seconds >= WORTH) {
        writeln!(text, "{seconds:6.1} {name}")?;
    }
    std::fs::write(file, text).with_context(|| file.display().to_string())
}

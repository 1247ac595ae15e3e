//! Tests in Python, by the words of pytest.

use super::outcome::{Report, Timed};
use anyhow::{Context, Result, bail};
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs a command that calls pytest.
///
/// # Errors
/// When it cannot be started or ran no test.
pub(crate) fn run(command: &mut Command, name: &str, log: &Path) -> Result<Report> {
    // By the clock of the tests and of what they share.
    command.args(["-q", "-p", "no:cacheprovider", "-rfE", "--durations=0", "--durations-min=0.1"]);
    let file = File::create(log).with_context(|| log.display().to_string())?;
    command.stdin(Stdio::null()).stdout(file.try_clone()?).stderr(file);
    let status = command.status().with_context(|| format!("cannot start {command:?}"))?;
    let said = String::from_utf8_lossy(&std::fs::read(log)?).into_owned();
    let mut report = read(&said, name);
    let ran = report.passed + report.failed.len();
    if ran == 0 || status.success() != report.failed.is_empty() {
        bail!("{said}\n{ran} tests ended, pytest with {status}");
    }
    report.log = Some(log.to_owned());
    Ok(report)
}

/// What pytest said.
fn read(said: &str, name: &str) -> Report {
    let mut report = Report::default();
    for line in said.lines() {
        let bad = ["FAILED ", "ERROR "].iter().find_map(|word| line.strip_prefix(word));
        if let Some(test) = bad {
            let test = test.split(" - ").next().unwrap_or(test);
            report.failed.push(format!("{name}::{test}"));
        }
        if let Some((test, seconds)) = time(line) {
            report.times.push((format!("{name}::{test}"), seconds));
        }
    }
    let ends = ["passed", "failed", "error", "skipped"];
    let is_last = |line: &&str| line.contains(" in ") && ends.iter().any(|end| line.contains(end));
    let last = said.lines().rev().find(is_last);
    let words: Vec<&str> = last.unwrap_or_default().split([' ', ',']).collect();
    let count = |what: &str| {
        let at = words.iter().position(|word| *word == what)?;
        words.get(at.checked_sub(1)?)?.parse().ok()
    };
    report.passed = count("passed").unwrap_or(0);
    report.skipped = count("skipped").unwrap_or(0);
    report
}

/// A line such as `1.23s call     tests/test_a.py::test_b`.
fn time(line: &str) -> Option<Timed> {
    let mut words = line.split_whitespace();
    let seconds = words.next()?.strip_suffix('s')?.parse().ok()?;
    let phase = words.next().filter(|phase| ["call", "setup", "teardown"].contains(phase))?;
    let test = words.next()?.rsplit('/').next()?;
    let test = if phase == "call" { test.to_owned() } else { format!("{test} ({phase})") };
    Some((test, seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_names_and_times_are_read() {
        let said = "...F\n== slowest durations ==\n1.25s call     python/tests/test_a.py::test_b\n\
                    0.50s setup    python/tests/test_a.py::test_c\n== short test summary info ==\n\
                    FAILED python/tests/test_a.py::test_c - assert 1 == 2\n1 failed, 3 passed, 1 skipped in 2.34s\n";
        let report = read(said, "package");
        assert_eq!((report.passed, report.skipped), (3, 1));
        assert_eq!(report.failed, ["package::python/tests/test_a.py::test_c"]);
        let times =
            [("package::test_a.py::test_b", 1.25), ("package::test_a.py::test_c (setup)", 0.5)];
        assert_eq!(report.times, times.map(|(name, seconds)| (name.to_owned(), seconds)));
    }
}

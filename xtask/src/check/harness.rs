//! One process of a test executable, by the words of Rust's own harness: which tests there are,
//! what became of them, and what each took.
//!
//! With one thread the harness prints the name of a test before it begins and what became of it
//! after. The time between two names is that of a test.

use super::outcome::{Report, Timed};
use anyhow::{Context, Result, bail, ensure};
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// No test runs this long, however busy the machine: it hangs. The slowest takes about a minute.
const PATIENCE: Duration = Duration::from_secs(1800);

/// The names of the tests of an executable.
///
/// # Errors
/// When it does not answer.
pub(crate) fn list(command: &mut Command) -> Result<Vec<String>> {
    let output = command.args(["--list", "--format", "terse"]).stdin(Stdio::null()).output()?;
    ensure!(output.status.success(), "{command:?} does not list its tests");
    let text = String::from_utf8(output.stdout)?;
    Ok(text.lines().filter_map(|line| line.strip_suffix(": test")).map(String::from).collect())
}

/// Runs the tests of these names; `command` starts the executable.
///
/// # Errors
/// When it cannot be started, hangs, or other tests ran than were asked for.
pub(crate) fn run(command: &mut Command, names: &[String], log: &Path) -> Result<Report> {
    command.args(["--test-threads=1", "--exact"]).args(names);
    let mut file = File::create(log).with_context(|| log.display().to_string())?;
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(file.try_clone()?);
    let mut child = command.spawn().with_context(|| format!("cannot start {command:?}"))?;
    let mut output = child.stdout.take().context("its output is piped")?;
    let (tell, told) = mpsc::channel();
    let reader = std::thread::spawn(move || {
        let mut buffer = [0; 1 << 16];
        while let Ok(count @ 1..) = output.read(&mut buffer) {
            if tell.send(buffer[..count].to_vec()).is_err() {
                break;
            }
        }
    });
    let mut said = Said::default();
    loop {
        match told.recv_timeout(PATIENCE) {
            Ok(bytes) => {
                file.write_all(&bytes)?;
                said.hear(&bytes, Instant::now());
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
            Err(mpsc::RecvTimeoutError::Timeout) => {
                child.kill()?;
                child.wait()?;
                let name = said.begun.last().map_or("the first test", |(name, _)| name);
                bail!("{name} hangs: nothing was heard for {} s", PATIENCE.as_secs());
            }
        }
    }
    let _ended = reader.join();
    let status = child.wait()?;
    let mut report = said.report(Instant::now());
    let ran = report.passed + report.failed.len() + report.skipped;
    if ran != names.len() || status.success() != report.failed.is_empty() {
        let said = std::fs::read(log).unwrap_or_default();
        let said = String::from_utf8_lossy(&said);
        bail!("{said}\n{ran} of {} tests ended, the process with {status}", names.len());
    }
    report.log = Some(log.to_owned());
    Ok(report)
}

/// What a process has said so far.
#[derive(Default)]
struct Said {
    /// The text of lines that were read.
    text: String,
    /// How much of it was searched for names.
    searched: usize,
    begun: Vec<(String, Instant)>,
    ended: Option<Instant>,
}

impl Said {
    /// Takes what was printed up to a moment.
    fn hear(&mut self, bytes: &[u8], now: Instant) {
        self.text.push_str(&String::from_utf8_lossy(bytes));
        while let Some(name) = self.next_name() {
            self.begun.push((name, now));
        }
        if self.ended.is_none() && self.text[self.searched..].contains("\ntest result: ") {
            self.ended = Some(now);
        }
    }

    /// The next test that has begun: "test NAME ... ", which stands at the beginning of a line.
    fn next_name(&mut self) -> Option<String> {
        let rest = &self.text[self.searched..];
        let mut from = 0;
        loop {
            let at = rest[from..].find("\ntest ")? + from + "\ntest ".len();
            match rest[at..].split_once([' ', '\n']) {
                Some((name, after)) if name != "result:" => {
                    let end = at + name.len();
                    if after.starts_with("... ") || after.starts_with("- should panic ... ") {
                        self.searched += end;
                        return Some(name.to_owned());
                    }
                    from = end;
                }
                _ => return None,
            }
        }
    }

    fn report(&self, now: Instant) -> Report {
        let mut report = Report::default();
        let ends = self.begun.iter().skip(1).map(|(_, begun)| *begun);
        let ends = ends.chain([self.ended.unwrap_or(now)]);
        report.times = self
            .begun
            .iter()
            .zip(ends)
            .map(|((name, begun), end)| -> Timed {
                (name.clone(), end.duration_since(*begun).as_secs_f64())
            })
            .collect();
        for line in self.text.lines() {
            if let Some(counts) = line.strip_prefix("test result: ") {
                let count = |what: &str| {
                    let words: Vec<&str> = counts.split([' ', ';', '.']).collect();
                    let at = words.iter().position(|word| *word == what);
                    at.and_then(|at| words.get(at - 1)?.parse().ok()).unwrap_or(0)
                };
                report.passed = count("passed");
                report.skipped = count("ignored");
                report.failed = self.failed(count("failed"));
            }
        }
        report
    }

    /// The names in the list of failures, which the harness prints last.
    fn failed(&self, count: usize) -> Vec<String> {
        let (_, list) = self.text.rsplit_once("\nfailures:\n").unwrap_or_default();
        let names = list.lines().map_while(|line| line.strip_prefix("    "));
        names.take(count).map(String::from).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAID: &str = "\nrunning 3 tests\ntest a::quick ... ok\ntest slow ... child says\ntest in the middle\nok\n\
                        test panics - should panic ... FAILED\n\nfailures:\n\n---- panics stdout ----\nnote\n\n\
                        failures:\n    panics\n\ntest result: FAILED. 2 passed; 1 failed; 0 ignored; 0 measured; 7 filtered \
                        out; finished in 0.00s\n\n";

    #[test]
    fn counts_names_and_times_are_read() {
        let mut said = Said::default();
        let begun = Instant::now();
        for (n, byte) in SAID.bytes().enumerate() {
            said.hear(&[byte], begun + Duration::from_millis(n as u64));
        }
        let report = said.report(begun);
        assert_eq!((report.passed, report.skipped), (2, 0));
        assert_eq!(report.failed, ["panics"]);
        let names: Vec<&str> = report.times.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["a::quick", "slow", "panics"]);
        let slow =
            SAID.find("- should").unwrap_or_default() - SAID.find("slow ...").unwrap_or_default();
        assert!((report.times[1].1 * 1000.0 - slow as f64).abs() < 20.0, "{}", report.times[1].1);
    }

    #[test]
    fn a_process_that_says_nothing_ran_no_test() {
        let report = Said::default().report(Instant::now());
        assert_eq!(report.passed + report.failed.len() + report.skipped, 0);
    }
}

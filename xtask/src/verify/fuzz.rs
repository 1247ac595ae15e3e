//! What fuzzing has run for and found, from the logs of `cargo xtask fuzz`.

use super::Bench;
use crate::fuzz::{log, targets};
use anyhow::{Result, ensure};
use std::fmt::Write as _;

const TEXT: &str = include_str!("fuzz.md");

/// What the log of one target says, all its runs together.
#[derive(Debug, Default, PartialEq)]
struct Log {
    inputs: u64,
    minutes: f64,
    processor_minutes: f64,
    branches: u64,
    peak_mb: u64,
    findings: usize,
}

impl Log {
    fn read(text: &str) -> Self {
        let mut log = Self::default();
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            let number = |n: usize| words.get(n).and_then(|w| w.parse::<u64>().ok()).unwrap_or(0);
            match words.as_slice() {
                // Also of runs that end with a finding, which do not say "Done".
                ["stat::number_of_executed_units:", _] => log.inputs += number(1),
                ["real", time] => log.minutes += minutes(time),
                ["user" | "sys", time] => log.processor_minutes += minutes(time),
                ["stat::peak_rss_mb:", _] => log.peak_mb = log.peak_mb.max(number(1)),
                _ if line.contains("SUMMARY: ") => log.findings += 1,
                _ => {
                    let at = words.iter().position(|w| *w == "cov:");
                    log.branches = log.branches.max(at.map_or(0, |n| number(n + 1)));
                }
            }
        }
        log
    }
}

/// Minutes of what a shell's `time` says: `12m3.45s`.
fn minutes(time: &str) -> f64 {
    let parts = time.trim_end_matches('s').split_once('m');
    let parsed =
        parts.and_then(|(m, s)| Some(m.parse::<f64>().ok()? + s.parse::<f64>().ok()? / 60.0));
    parsed.unwrap_or(0.0)
}

/// A row for each target that has run.
pub(crate) fn section(bench: &Bench<'_>) -> Result<String> {
    let mut rows = String::new();
    for target in targets(&bench.house.root.join("fuzz"))? {
        let Ok(text) = std::fs::read_to_string(log(bench.house, &target)) else { continue };
        let Log { inputs, minutes, processor_minutes, branches, peak_mb, findings } =
            Log::read(&text);
        writeln!(
            rows,
            "| {target} | {minutes:.0} | {processor_minutes:.0} | {inputs} | {branches} | {peak_mb} | {findings} |"
        )?;
    }
    ensure!(!rows.is_empty(), "nothing was fuzzed yet: run `cargo xtask fuzz` first");
    Ok(String::from(TEXT) + &rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_of_a_log_add_up() {
        let text = "#1\tINITED cov: 300 ft: 9 corp: 1\n#9\tNEW    cov: 310 ft: 9\n\
                    stat::number_of_executed_units: 40\nstat::peak_rss_mb:   55\n\nreal\t2m0.0s\nuser\t1m30.0s\nsys\t0m6.0s\n\
                    SUMMARY: libFuzzer: deadly signal\nstat::number_of_executed_units: 2\n\nreal\t1m0.0s\nuser\t0m24.0s\n";
        let log = Log::read(text);
        assert_eq!((log.inputs, log.branches, log.peak_mb, log.findings), (42, 310, 55, 1));
        assert!((log.minutes - 3.0).abs() < 1e-9 && (log.processor_minutes - 2.0).abs() < 1e-9);
    }
}

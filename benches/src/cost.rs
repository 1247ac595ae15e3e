//! Time and memory of this process.

use anyhow::{Context, Result};
use rustix::time::{ClockId, clock_gettime};
use std::path::Path;

/// CPU time of this process, s.
pub(crate) fn cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

/// A line of what the system says of this process' memory, MB.
pub(crate) fn memory_mb(line: &str) -> Result<f64> {
    let status = std::fs::read_to_string(Path::new("/proc/self/status"))?;
    let line = status.lines().find_map(|l| l.strip_prefix(line)?.strip_prefix(':'));
    let kib: f64 = line.context("no such line")?.trim().trim_end_matches("kB").trim().parse()?;
    Ok(kib * 1.024e-3)
}

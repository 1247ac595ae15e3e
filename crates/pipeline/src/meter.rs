//! Time and peak memory of the stages.

use crate::Stage;
use std::time::Instant;
use supine_report::StageTime;

/// Measures one stage.
pub(crate) struct Meter {
    stage: Stage,
    start: Instant,
}

impl Meter {
    /// Starts the clock and forgets the memory peak so far.
    pub(crate) fn start(stage: Stage) -> Self {
        forget_peak();
        Self { stage, start: Instant::now() }
    }

    /// The figures of the stage.
    pub(crate) fn stop(self, cached: bool) -> StageTime {
        StageTime {
            name: self.stage.name().into(),
            seconds: self.start.elapsed().as_secs_f64(),
            cached,
            peak_memory_mb: peak_memory_mb(),
        }
    }
}

/// Largest resident memory since the last [`forget_peak`], MB; `None` where the system keeps none.
fn peak_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024.0 / 1e6)
}

/// Sets the kernel's peak to the memory in use now. Where it cannot be set, a stage's figure is
/// the peak since the start of the process, which is an upper bound.
fn forget_peak() {
    let _upper_bound_instead = std::fs::write("/proc/self/clear_refs", "5");
}

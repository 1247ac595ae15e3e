//! Waiting before what failed is tried again.

use crate::Call;
use crate::cancel::GoOn;
use crate::error::Error;
use std::time::{Duration, Instant};

/// Waits before the next association: half a second, then twice as long each time, 8 s at most.
pub(crate) fn pause(vain: u32, go_on: GoOn<'_>) -> Result<(), Error> {
    let wait = Duration::from_millis(500 << vain.saturating_sub(1).min(4));
    let start = Instant::now();
    while start.elapsed() < wait {
        go_on()?;
        std::thread::sleep(Duration::from_millis(50));
    }
    Ok(())
}

/// Tries again what failed for a reason that may pass: a query.
pub(crate) fn patiently<T>(
    call: &Call,
    go_on: GoOn<'_>,
    mut work: impl FnMut() -> Result<T, Error>,
) -> Result<T, Error> {
    let mut vain = 0;
    loop {
        match work() {
            Err(error) if error.of_the_peer() && vain < call.retries => vain += 1,
            outcome => return outcome.map_err(|error| error.in_vain(call, "answer a query")),
        }
        pause(vain, go_on)?;
    }
}

//! When and by which command the program began.

use crate::failure::Failure;
use chrono::{DateTime, Local, NaiveDateTime};
use supine_flow::Start;
use supine_flow::commands::Clock;
use supine_space::Failure as Kind;

/// Names the time to write in place of that of the clock, in seconds since 1970 (UTC), as in
/// reproducible builds.
const EPOCH: &str = "SOURCE_DATE_EPOCH";

/// The start of this program, at the local time.
///
/// # Errors
/// When the time to write was given and cannot be understood.
pub(crate) fn start() -> Result<Start, Failure> {
    let now = match std::env::var(EPOCH) {
        Ok(text) => given(&text).ok_or_else(|| {
            let text = format!(
                "{EPOCH}: {text:?} are no seconds since 1970: leave it out, or give a whole number"
            );
            Failure::new(Kind::Usage, text)
        })?,
        Err(_) => Local::now().naive_local(),
    };
    let clock =
        Clock { date: now.format("%Y%m%d").to_string(), time: now.format("%H%M%S").to_string() };
    let command = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    Ok(Start { clock, command })
}

fn given(text: &str) -> Option<NaiveDateTime> {
    let seconds = text.parse().ok()?;
    // A date of DICOM has four digits for the year.
    let read = DateTime::from_timestamp(seconds, 0)?.naive_utc();
    (0..=253_402_300_799).contains(&seconds).then_some(read)
}

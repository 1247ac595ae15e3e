//! A recording, followed once more.

use crate::Error;
use crate::follower::Follower;
use crate::record::Recording;
use crate::settings::Renewing;
use serde::Serialize;
use supine_space::Progress;

/// How a replay compares with what was recorded.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Replayed {
    /// Answers that were compared.
    pub answers: usize,
    /// Whether every place has the same bits.
    pub identical: bool,
    /// Whether the recording promises that: its factor was renewed between the steps.
    pub promised: bool,
    /// Largest distance of two places, mm.
    pub largest_mm: f64,
    /// Answers farther apart than the errors that both told.
    pub beyond: usize,
}

impl Replayed {
    /// Whether it is as it should be.
    pub fn holds(&self) -> bool {
        if self.promised { self.identical } else { self.beyond == 0 }
    }
}

/// Follows the poses of a recording with a follower of its settings.
///
/// # Errors
/// As [`Follower::follow`], or when the user stops.
pub fn replay(
    recording: &Recording,
    follower: &mut Follower,
    progress: Progress<'_>,
) -> Result<Replayed, Error> {
    let promised = recording.head.settings.renewal == Renewing::Between;
    let mut told = Replayed { identical: true, promised, ..Replayed::default() };
    for (n, line) in recording.lines.iter().enumerate() {
        let share = n as f64 / recording.lines.len() as f64;
        progress.at(share).map_err(|_| Error::Stopped)?;
        let (tissue, _) = follower.follow(&line.pose())?;
        follower.between()?;
        let apart = (tissue.target - line.target()).norm();
        let same = |a: [f64; 3], b: [f64; 3]| a.map(f64::to_bits) == b.map(f64::to_bits);
        told.identical &= same(tissue.target.coords.into(), line.target);
        told.largest_mm = told.largest_mm.max(apart);
        told.beyond += usize::from(apart > tissue.error_mm + line.error);
        told.answers += 1;
    }
    Ok(told)
}

//! From a message of the tracker to a pose of the applicator in the patient.

use crate::clock::Clock;
use crate::gate::{Gate, Refusal, Verdict};
use std::time::Duration;
use supine_openigtlink::{Rows, Stamp};
use supine_space::{Point, Pose};

/// How the frame of the poses lies in the patient, and the applicator in that of its marker.
#[derive(Clone, Copy, Debug)]
pub struct Frames {
    /// From the frame of the poses to the patient's, LPS, mm: the registration, or the turn of the
    /// patient's own frame.
    pub to_patient: Pose,
    /// From the applicator's own frame to that of its marker: the calibration.
    pub from_tool: Pose,
    /// Latency that the maker of the tracker states.
    pub latency: Duration,
}

/// A pose that is to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    pub(crate) stamp: Stamp,
    /// When it arrived, since the session began.
    pub(crate) arrived: Duration,
    /// How old it was then, s.
    pub(crate) age_s: f64,
    /// From the applicator's own frame to the patient's, LPS, mm.
    pub(crate) pose: Pose,
}

/// What came of a message.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Taken {
    Pose {
        wanted: Wanted,
        /// The same pose again and again: the tracker does not measure.
        frozen: bool,
        /// The device's clock was set: by so many s, where that is known.
        clock_step_s: Option<f64>,
    },
    Refused(Refusal),
    /// An equal or newer one was there.
    Dropped,
}

/// Judges the messages of one peer: each has its own clock.
#[derive(Clone, Debug)]
pub(crate) struct Intake {
    gate: Gate,
    clock: Clock,
    frames: Frames,
    /// The device's clock was set by so many s; to be told with the next pose that is taken.
    step_s: Option<f64>,
}

impl Intake {
    /// `centre` (LPS, mm): farther than `reach_mm` from it there is no applicator.
    pub(crate) fn new(frames: Frames, centre: &Point, reach_mm: f64) -> Self {
        let centre = frames.to_patient.inverse_transform_point(centre);
        let (gate, clock) = (Gate::new(centre, reach_mm), Clock::new(frames.latency));
        Self { gate, clock, frames, step_s: None }
    }

    pub(crate) fn take(&mut self, stamp: Stamp, arrived: Duration, rows: &Rows) -> Taken {
        let age = self.clock.arrived(stamp.0, arrived);
        self.step_s = age.step_s.or(self.step_s);
        let rows = rows.map(|row| row.map(f64::from));
        match self.gate.judge(stamp.0, arrived, &rows) {
            Verdict::Accepted { pose, frozen, clock_restarted, .. } => {
                if clock_restarted {
                    self.clock.restart();
                }
                let pose = self.frames.to_patient * pose * self.frames.from_tool;
                let wanted = Wanted { stamp, arrived, age_s: age.age_s, pose };
                let clock_step_s = self.step_s.take();
                Taken::Pose { wanted, frozen, clock_step_s }
            }
            Verdict::Refused(refusal) => Taken::Refused(refusal),
            Verdict::Dropped(_) => Taken::Dropped,
        }
    }
}

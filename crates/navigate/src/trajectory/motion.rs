//! The motion without tracker: where the tip is, how far the tool is turned, and how much the hand
//! trembles.

use nalgebra::{Rotation3, Vector3};
use std::f64::consts::TAU;
use supine_space::{Matrix, Vector};

/// From the tumour bed to the side where the tool enters, LPS: left, anterior, superior. A unit
/// vector.
pub(super) const ENTRY: [f64; 3] = [0.36, -0.80, 0.48];
/// From here to the bed the tool is in tissue, mm.
const SKIN_MM: f64 = 40.0;
/// The tremor: Hz, and its radius across the tool, mm.
const TREMOR: (f64, f64) = (8.0, 0.3);
/// The sweep in steps: number, and length of each in each axis, mm.
const STEPS: (f64, f64) = (10.0, 0.5);
/// Share of a step in which the tool moves.
const MOVING: f64 = 0.4;
/// Peak speed of the slow sweep along x, y and z, mm/s, and its greatest amplitude, mm.
const SWEEP: ([f64; 3], f64) = ([5.0, 15.0, 28.0], 8.0);
/// Share of a sweep at either end in which it grows and fades.
const FADE: f64 = 0.15;
/// Length of a jump, mm, and the directions in turn.
const JUMP_MM: f64 = 3.0;
const JUMPS: [[f64; 3]; 5] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
/// The turn about the tool's axis: degrees to either side, and how often.
const TURN: (f64, f64) = (15.0, 6.0);

/// A part of the motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// From the start to the skin.
    Approach,
    /// From the skin to the bed.
    Insertion,
    /// Held in the bed, with tremor.
    Hold,
    /// Ten steps of 0.5 mm in each axis, 8.66 mm in all.
    Steps,
    /// Back to the bed.
    Return,
    /// To and fro along x, y, z at up to 5, 15 and 28 mm/s.
    Sweep,
    /// In the bed without tremor.
    Rest,
    /// 3 mm in one sample, and back.
    Jumps,
    /// Turned by 15 degrees to either side about its axis.
    Turn,
    /// Samples are lost: gaps, and one in fifty.
    Lost,
    /// Stamps are repeated or out of order.
    Stamps,
    /// Every sixth pose is none.
    Bad,
    /// The device's clock runs ahead by 120 ms and by 50 ppm more.
    Clock,
    /// Out again.
    Withdraw,
}

impl Phase {
    /// Its name in a table of the trajectory.
    pub fn name(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Insertion => "insertion",
            Self::Hold => "hold",
            Self::Steps => "paper_sweep",
            Self::Return => "return",
            Self::Sweep => "slow_sweep",
            Self::Rest => "rest",
            Self::Jumps => "jumps",
            Self::Turn => "rotate",
            Self::Lost => "lost",
            Self::Stamps => "stamps",
            Self::Bad => "bad",
            Self::Clock => "clock",
            Self::Withdraw => "withdraw",
        }
    }

    /// Share of the full tremor.
    fn tremor(self, done: f64) -> f64 {
        match self {
            Self::Steps | Self::Jumps | Self::Rest => 0.0,
            Self::Sweep if sweep_axis(done) < 2 => 0.5,
            Self::Sweep => 0.0,
            _ => 1.0,
        }
    }
}

/// What differs between a long and a short motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    /// Where the approach begins, mm from the bed.
    pub(super) start_mm: f64,
    /// Where the withdrawal ends, mm from the bed.
    pub(super) end_mm: f64,
    /// Factor of the amplitude of the slow sweep.
    pub(super) sweep: f64,
}

/// A moment of a phase.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) phase: Phase,
    /// Share of the phase that is done, 0 <= done < 1.
    pub(super) done: f64,
    /// How long the phase lasts, s.
    pub(super) lasts_s: f64,
    /// Since the motion began, s.
    pub(super) t_s: f64,
}

impl Moment {
    /// The tip from the bed without tremor, LPS, mm.
    pub(super) fn place(&self, reach: &Reach) -> Vector {
        let entry = Vector::from(ENTRY);
        let a = self.done;
        match self.phase {
            Phase::Approach => entry * (reach.start_mm - (reach.start_mm - SKIN_MM) * smooth(a)),
            Phase::Insertion => entry * (SKIN_MM * (1.0 - smooth(a))),
            Phase::Steps => {
                let step = (a * STEPS.0).floor();
                let made = step + smooth((a * STEPS.0 - step) / MOVING);
                Vector::repeat(STEPS.1 * made)
            }
            Phase::Return => Vector::repeat(STEPS.0 * STEPS.1 * (1.0 - smooth(a))),
            Phase::Sweep => self.sweep(reach.sweep),
            Phase::Jumps => match jump(a) {
                jump if jump % 2 == 1 => Vector::from(JUMPS[jump / 2 % JUMPS.len()]) * JUMP_MM,
                _ => Vector::zeros(),
            },
            Phase::Withdraw => entry * (reach.end_mm * smooth(a)),
            _ => Vector::zeros(),
        }
    }

    /// The slow sweep along one axis: whole waves under a hood.
    fn sweep(&self, factor: f64) -> Vector {
        let axis = sweep_axis(self.done);
        let (speed, done) = (SWEEP.0[axis], self.done * 3.0 - axis as f64);
        let lasts = self.lasts_s / 3.0;
        let waves = (speed / (TAU * SWEEP.1) * lasts).round().max(1.0);
        let amplitude = (speed * lasts / (TAU * waves)).min(SWEEP.1);
        let hood = smooth(done / FADE) * smooth((1.0 - done) / FADE);
        let mut place = Vector::zeros();
        place[axis] = amplitude * factor * hood * (TAU * waves * done).sin();
        place
    }

    /// The tremor across a tool whose axes are the columns of `tool`, mm.
    pub(super) fn tremor(&self, tool: &Matrix) -> Vector {
        let (sin, cos) = (TAU * TREMOR.0 * self.t_s).sin_cos();
        let across = tool.column(0) * sin + tool.column(1) * cos;
        across * (TREMOR.1 * self.phase.tremor(self.done))
    }

    /// The turn about the tool's axis, rad.
    pub(super) fn turn(&self) -> f64 {
        match self.phase {
            Phase::Turn => TURN.0.to_radians() * (TAU * TURN.1 * self.done).sin(),
            _ => 0.0,
        }
    }

    /// Whether the tool is elsewhere than a moment `before` of the same phase although it jumps
    /// only now and then.
    pub(super) fn jumped(&self, before: f64) -> bool {
        self.phase == Phase::Jumps && jump(before) != jump(self.done)
    }
}

/// Axes of the tool as columns, LPS, when it is not turned: z points out of the tip, away from the
/// entry; x is level.
pub(super) fn tool_axes() -> Matrix {
    let z = -Vector::from(ENTRY);
    let x = Vector3::new(z.y, -z.x, 0.0).normalize();
    Matrix::from_columns(&[x, z.cross(&x), z])
}

/// A turn (rad) about the tool's own axes: x, or z.
pub(super) fn about(axis: Vector, angle: f64) -> Matrix {
    Rotation3::from_scaled_axis(axis * angle).into_inner()
}

/// The step from 0 to 1 with the least jerk; beyond its ends it stays. Source: Flash and Hogan, J.
/// Neurosci. 5, 1985.
fn smooth(a: f64) -> f64 {
    let a = a.clamp(0.0, 1.0);
    a * a * a * (10.0 - 15.0 * a + 6.0 * a * a)
}

/// The axis that is swept.
fn sweep_axis(done: f64) -> usize {
    ((done * 3.0) as usize).min(2)
}

/// Which tenth of the jumps it is: the odd ones are away from the bed.
fn jump(done: f64) -> usize {
    (done * 10.0) as usize
}

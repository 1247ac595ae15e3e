//! A motion of an applicator that is always the same: for a session without tracker and for tests.
//!
//! It goes in, is held, steps, sweeps, jumps and turns; samples are lost, stamps repeat, poses are
//! none, the device's clock steps; it goes out. Each row says what is to be done with it, so that
//! whatever takes poses can be checked row by row.

mod motion;
mod split_mix;
pub(crate) mod table;
#[cfg(test)]
mod tests;

pub use motion::Phase;
pub(crate) use split_mix::SplitMix;
pub use table::TableError;

use motion::{Moment, Reach, about, tool_axes};
use nalgebra::UnitQuaternion;
use supine_space::{Matrix, Point, Pose, Vector};

/// Samples a second.
const RATE_HZ: f64 = 60.0;
/// Of the generator.
const SEED: u64 = 20_261_121;
/// Noise of the tracker: mm an axis, and rad about the tool's x.
const NOISE: (f64, f64) = (0.05, 0.0005);
/// From the moment of a pose until it is sent: mean and range, s. Polaris Vega: 14.2 ms, doi
/// 10.1186/s13014-021-01804-7.
const SENT_AFTER_S: (f64, f64) = (0.0142, 0.004);
/// Gaps as seconds of a minute of losses: where each begins and how long it is; the first always
/// lasts 0.1 s.
const GAPS: [(f64, f64); 5] = [(5.0, 0.1), (10.0, 0.5), (20.0, 1.0), (30.0, 2.0), (45.0, 5.0)];
/// Share of the other samples that is lost.
const LOST: f64 = 0.02;
/// Shares of stamps that are, summed up: those of the sample before, out of order, and whole
/// samples that come again.
const WRONG_STAMPS: [f64; 3] = [0.05, 0.10, 0.12];
/// How many samples a stamp out of order lies back.
const BACK: f64 = 3.5;
/// One in so many poses is none.
const BAD_EVERY: usize = 6;
/// The device's clock ahead, s, and s more in each s.
const CLOCK: (f64, f64) = (0.120, 50e-6);

/// What is special about a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flag {
    /// 3 mm away from the row before.
    Jump,
    /// The stamp of the sample before.
    Duplicate,
    /// A stamp from 3.5 samples ago.
    OutOfOrder,
    /// The newest sample that was good, again.
    Repeat,
    /// One number is not a number.
    Nan,
    /// One number is infinite.
    Infinite,
    /// Scaled by 1.02.
    Scaled,
    /// Mirrored.
    Mirrored,
    /// No turn at all: zeros.
    Zero,
    /// 1 m off.
    Far,
    /// The stamp is of a clock that runs ahead.
    ClockAhead,
}

/// The poses that are none, in turn.
const BAD: [(Flag, Expect); 6] = [
    (Flag::Nan, Expect::NotFinite),
    (Flag::Infinite, Expect::NotFinite),
    (Flag::Scaled, Expect::NotRigid),
    (Flag::Mirrored, Expect::NotRigid),
    (Flag::Zero, Expect::NotRigid),
    (Flag::Far, Expect::Far),
];

/// What is to be done with a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Expect {
    /// Take it.
    Accept,
    /// Drop it: its stamp was accepted already.
    Duplicate,
    /// Drop it: a newer one was accepted.
    Old,
    /// Refuse it: not all numbers are finite.
    NotFinite,
    /// Refuse it: not a rigid motion.
    NotRigid,
    /// Refuse it: too far away.
    Far,
}

/// A sample of the tracker as it is sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Number of the sample as it was taken; missing numbers are lost samples.
    pub seq: u32,
    /// When the pose was true, s since the beginning.
    pub t_true_s: f64,
    /// The time stamp, s since the beginning by the device's clock.
    pub stamp_s: f64,
    /// When it is sent, s since the beginning.
    pub t_send_s: f64,
    /// Part of the motion.
    pub phase: Phase,
    /// What is special about it.
    pub flag: Option<Flag>,
    /// What is to be done with it.
    pub expect: Expect,
    /// The upper three rows of the pose: turn and tip (mm), LPS unless set elsewhere
    /// ([`Trajectory::at`]).
    pub rows: [[f64; 4]; 3],
    /// The true tip, without noise of the tracker, mm; same frame.
    pub tip: Point,
}

impl Row {
    /// The time stamp as OpenIGTLink has it: seconds since 1970 in the upper 32 bits, 2^-32 s in
    /// the lower; to 1 us. `epoch_s` is when the motion began, s since 1970. An epoch of 0 makes
    /// the first stamp 0, which means that there is none.
    pub fn stamp(&self, epoch_s: u32) -> u64 {
        let micros = (self.stamp_s.max(0.0) * 1e6).round() as u64;
        let seconds = u64::from(epoch_s) + micros / 1_000_000;
        (seconds << 32) + ((micros % 1_000_000) << 32) / 1_000_000
    }
}

/// Samples in the order in which they are sent.
///
/// The tip of the tool is the pose's origin, its +z points out of the tip. The frame is LPS with
/// its origin in the tumour bed; the tool enters from the left, in front and above.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    rows: Vec<Row>,
}

impl Trajectory {
    /// 600 s: 35,431 rows of 36,000 samples.
    pub fn long() -> Self {
        let reach = Reach { start_mm: 150.0, end_mm: 120.0, sweep: 0.92 };
        let phases = [
            (Phase::Approach, 20.0),
            (Phase::Insertion, 20.0),
            (Phase::Hold, 20.0),
            (Phase::Steps, 30.0),
            (Phase::Return, 10.0),
            (Phase::Sweep, 120.0),
            (Phase::Rest, 30.0),
            (Phase::Hold, 30.0),
            (Phase::Jumps, 60.0),
            (Phase::Turn, 60.0),
            (Phase::Lost, 60.0),
            (Phase::Stamps, 40.0),
            (Phase::Bad, 30.0),
            (Phase::Clock, 30.0),
            (Phase::Withdraw, 30.0),
            (Phase::Rest, 10.0),
        ];
        Sender::new(reach).run(&phases)
    }

    /// 20 s: 1,181 rows of 1,200 samples; no turn about the axis, no clock that runs ahead.
    pub fn short() -> Self {
        let reach = Reach { start_mm: 55.0, end_mm: 15.0, sweep: 0.60 };
        let phases = [
            (Phase::Approach, 2.0),
            (Phase::Insertion, 3.0),
            (Phase::Steps, 4.0),
            (Phase::Return, 2.0),
            (Phase::Sweep, 3.0),
            (Phase::Jumps, 1.0),
            (Phase::Lost, 1.5),
            (Phase::Stamps, 1.0),
            (Phase::Bad, 1.0),
            (Phase::Withdraw, 1.5),
        ];
        Sender::new(reach).run(&phases)
    }

    /// The rows.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// The same motion where an applicator is planned: `placed` is its pose there, from its own
    /// frame to the patient's, mm. The bed is its place, the way in comes along its shaft.
    #[must_use]
    pub fn entering(self, placed: &Pose) -> Self {
        let (entry, shaft) = (Vector::from(motion::ENTRY), placed.rotation * -Vector::z());
        let turn = UnitQuaternion::rotation_between(&entry, &shaft).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI)
        });
        self.at(&Pose::from_parts(placed.translation, turn))
    }

    /// The same motion elsewhere: `origin` takes the frame of the motion to another, as that of a
    /// patient, mm. Its shift is where the tumour bed lies there.
    pub fn at(mut self, origin: &Pose) -> Self {
        let turn = origin.rotation.to_rotation_matrix().into_inner();
        for row in &mut self.rows {
            let (inner, tip) = parts(&row.rows);
            row.rows = rows_of(&(turn * inner), &(turn * tip + origin.translation.vector));
            row.tip = origin * row.tip;
        }
        self
    }
}

/// Makes rows from the phases.
struct Sender {
    reach: Reach,
    tool: Matrix,
    draws: SplitMix,
    rows: Vec<Row>,
    /// Number of the sample.
    seq: u32,
    /// Pose and stamp (s) of the newest row that is to be accepted.
    newest: Option<([[f64; 4]; 3], f64)>,
}

/// What the tracker draws for each sample, in this order.
struct Draws {
    shift: [f64; 3],
    tilt: f64,
    delay: f64,
    pick: f64,
}

impl Sender {
    fn new(reach: Reach) -> Self {
        let draws = SplitMix::new(SEED);
        Self { reach, tool: tool_axes(), draws, rows: Vec::new(), seq: 0, newest: None }
    }

    fn run(mut self, phases: &[(Phase, f64)]) -> Trajectory {
        for &(phase, lasts_s) in phases {
            let count = (lasts_s * RATE_HZ).round() as usize;
            for index in 0..count {
                let t_s = f64::from(self.seq) / RATE_HZ;
                let done = index as f64 / count as f64;
                self.sample(&Moment { phase, done, lasts_s, t_s }, index, count);
                self.seq += 1;
            }
        }
        Trajectory { rows: self.rows }
    }

    /// The sample of a moment, the `index`th of `count` in its phase.
    fn sample(&mut self, moment: &Moment, index: usize, count: usize) {
        let draws = self.draw();
        if moment.phase == Phase::Lost && lost(moment, draws.pick) {
            return;
        }
        let mut row = self.good(moment, &draws);
        match moment.phase {
            Phase::Stamps => self.wrong_stamp(&mut row, draws.pick),
            Phase::Bad if index % BAD_EVERY == BAD_EVERY - 1 => {
                spoil(&mut row, BAD[index / BAD_EVERY % BAD.len()]);
            }
            Phase::Clock => {
                row.stamp_s += CLOCK.0 + CLOCK.1 * (index as f64 / RATE_HZ);
                row.flag = Some(Flag::ClockAhead);
            }
            _ if index > 0 && moment.jumped((index - 1) as f64 / count as f64) => {
                row.flag = Some(Flag::Jump);
            }
            _ => {}
        }
        self.expect(&mut row);
        self.rows.push(row);
    }

    fn draw(&mut self) -> Draws {
        let shift = self.draws.normals();
        let tilt = self.draws.normal();
        Draws { shift, tilt, delay: self.draws.even(), pick: self.draws.even() }
    }

    /// The row of a sample with which nothing is wrong.
    fn good(&self, moment: &Moment, draws: &Draws) -> Row {
        let tip = moment.place(&self.reach) + moment.tremor(&self.tool);
        let turn = self.tool
            * about(Vector::z(), moment.turn())
            * about(Vector::x(), NOISE.1 * draws.tilt);
        Row {
            seq: self.seq,
            t_true_s: moment.t_s,
            stamp_s: moment.t_s,
            t_send_s: moment.t_s + SENT_AFTER_S.0 + SENT_AFTER_S.1 * (draws.delay - 0.5),
            phase: moment.phase,
            flag: None,
            expect: Expect::Accept,
            rows: rows_of(&turn, &(tip + Vector::from(draws.shift) * NOISE.0)),
            tip: tip.into(),
        }
    }

    /// Some stamps are not newer than the one before, and some samples come twice.
    fn wrong_stamp(&self, row: &mut Row, pick: f64) {
        let [duplicate, out_of_order, repeat] = WRONG_STAMPS;
        if pick < duplicate {
            row.flag = Some(Flag::Duplicate);
            row.stamp_s = (f64::from(row.seq) - 1.0) / RATE_HZ;
        } else if pick < out_of_order {
            row.flag = Some(Flag::OutOfOrder);
            row.stamp_s -= BACK / RATE_HZ;
        } else if pick < repeat
            && let Some((rows, stamp_s)) = self.newest
        {
            row.flag = Some(Flag::Repeat);
            (row.rows, row.stamp_s) = (rows, stamp_s);
        }
    }

    /// Says what is to be done: a stamp counts against the newest that was accepted, and only of a
    /// pose that is one.
    fn expect(&mut self, row: &mut Row) {
        if row.expect != Expect::Accept {
            return;
        }
        let newest = self.newest.map_or(-1.0, |(_, stamp_s)| stamp_s);
        let newer = ((row.stamp_s - newest) * 1e6).round();
        if newer > 0.0 {
            self.newest = Some((row.rows, row.stamp_s));
        } else if newer == 0.0 {
            row.expect = Expect::Duplicate;
        } else {
            row.expect = Expect::Old;
        }
    }
}

/// Whether a sample is lost. Gaps shrink with the phase, except the first.
fn lost(moment: &Moment, pick: f64) -> bool {
    let scale = moment.lasts_s / 60.0;
    let t_s = moment.done * moment.lasts_s;
    let in_gap = |(number, &(begin, lasts)): (usize, &(f64, f64))| {
        let lasts = if number == 0 && scale < 1.0 { lasts / scale } else { lasts };
        (begin * scale..(begin + lasts) * scale).contains(&t_s)
    };
    GAPS.iter().enumerate().any(in_gap) || pick < LOST
}

/// Makes a pose that is none.
fn spoil(row: &mut Row, (flag, expect): (Flag, Expect)) {
    let (turn, tip) = parts(&row.rows);
    let mirror = Matrix::from_diagonal(&Vector::new(-1.0, 1.0, 1.0));
    match flag {
        Flag::Nan => row.rows[0][3] = f64::NAN,
        Flag::Infinite => row.rows[1][1] = f64::INFINITY,
        Flag::Scaled => row.rows = rows_of(&(turn * 1.02), &tip),
        Flag::Mirrored => row.rows = rows_of(&(turn * mirror), &tip),
        Flag::Zero => row.rows = rows_of(&Matrix::zeros(), &tip),
        _ => row.rows[0][3] += 1000.0,
    }
    (row.flag, row.expect) = (Some(flag), expect);
}

/// The turn (or whatever stands there) and the tip of the upper three rows of a pose.
pub(crate) fn parts(rows: &[[f64; 4]; 3]) -> (Matrix, Vector) {
    let turn = Matrix::from_fn(|row, column| rows[row][column]);
    (turn, Vector::new(rows[0][3], rows[1][3], rows[2][3]))
}

/// The upper three rows of a pose.
fn rows_of(turn: &Matrix, tip: &Vector) -> [[f64; 4]; 3] {
    std::array::from_fn(|i| [turn[(i, 0)], turn[(i, 1)], turn[(i, 2)], tip[i]])
}

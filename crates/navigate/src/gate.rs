//! Which poses are taken.
//!
//! A tracker sends what it has: poses that are no rigid motion when a marker is lost, the same pose
//! again when it is asked too often, old ones when a network delays them. The gate says of each
//! what it is.

use crate::trajectory::parts;
use nalgebra::{Rotation3, UnitQuaternion};
use std::time::Duration;
use supine_space::{Matrix, Point, Pose, Vector};

/// How far an entry of R'R - I may be from 0. Trackers round their quaternions; a scale of 1.0025
/// is at the limit.
const RIGID: f64 = 5e-3;
/// Faster than this, mm/s, the tool jumps: the fastest motion of an applicator that is followed.
const FASTEST_MM_S: f64 = 29.0;
/// What the noise of a tracker may add to that, mm.
const NOISE_MM: f64 = 1.0;
/// So many poses in a row that are equal to the bit are frozen: a tracker that sees always has
/// noise.
const FROZEN: u32 = 5;
/// After so long with old stamps alone the device's clock was set back.
const RESTARTED: Duration = Duration::from_secs(5);
/// Poses farther than this from the region are not of the tool, mm.
pub const REACH_MM: f64 = 500.0;

/// What a pose is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It is to be followed.
    Accepted {
        /// The rigid motion nearest to the matrix; mm, in the frame of the poses.
        pose: Pose,
        /// It lies farther from the one accepted before than 29 mm/s and 1 mm of noise explain: go
        /// there in steps.
        jump: bool,
        /// It is the fifth or a later one in a row that is equal to the bit: the tracker sends but
        /// does not measure.
        frozen: bool,
        /// The device's clock was set back: stamps are compared with this one from now on.
        clock_restarted: bool,
    },
    /// It is no pose of the tool: what is shown is stale.
    Refused(Refusal),
    /// It is passed over: as new a one was accepted before.
    Dropped(Dropped),
}

/// Why something is no pose of the tool.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A number is not finite.
    #[error("the pose has a number that is not finite: the tracker does not see the tool")]
    NotFinite,
    /// The matrix is no turn.
    #[error(
        "the pose is not a rigid motion: R'R differs from 1 by {worst:.3}, or it mirrors; send a turn without scale"
    )]
    NotRigid {
        /// Largest entry of |R'R - I|; a mirror image has a small one too.
        worst: f64,
    },
    /// The tool is elsewhere.
    #[error(
        "the tool is {mm:.0} mm away from the region: check the registration and which tool is tracked"
    )]
    Far {
        /// Distance from the centre of the region, mm.
        mm: f64,
    },
}

/// Why a pose is passed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Dropped {
    /// A pose with the same stamp was accepted.
    #[error("a pose with this stamp was there before")]
    Duplicate,
    /// A pose with a newer stamp was accepted.
    #[error("a newer pose was there before")]
    Old,
}

/// Judges poses in the order in which they arrive.
///
/// First what a pose is, then how new it is: one that is refused is refused whatever its stamp, and
/// does not count as the newest. A stamp that is not newer than the newest accepted one is dropped.
/// When for 5 s, by time of arrival, all stamps are older than that, the device's clock was set
/// back: the newest is forgotten, and the verdict says so. A stamp of 0 means that there is none:
/// such a pose is never dropped and leaves the newest as it is.
#[derive(Clone, Debug)]
pub struct Gate {
    centre: Point,
    reach_mm: f64,
    /// Newest stamp accepted.
    newest: Option<u64>,
    last: Option<Last>,
    old: Option<OldRun>,
}

/// The pose accepted last.
#[derive(Clone, Copy, Debug)]
struct Last {
    rows: [[f64; 4]; 3],
    stamp: u64,
    arrival: Duration,
    /// How many in a row are equal to it, itself included.
    alike: u32,
}

/// Stamps older than the newest, one after the other.
#[derive(Clone, Copy, Debug)]
struct OldRun {
    since: Duration,
    /// The first stamp.
    first: u64,
}

/// How new a stamp is.
enum Newness {
    New,
    Restarted,
    Not(Dropped),
}

impl Gate {
    /// A gate round the centre of a region, mm, in the frame of the poses that it judges;
    /// `reach_mm` as [`REACH_MM`].
    pub fn new(centre: Point, reach_mm: f64) -> Self {
        Self { centre, reach_mm, newest: None, last: None, old: None }
    }

    /// What a pose is.
    ///
    /// `stamp`: device time, seconds in the upper 32 bits and 2^-32 s in the lower, 0 if there is
    /// none. `arrival`: time since any fixed moment, by a clock that is never set back. `rows`: the
    /// upper three rows of the matrix, mm.
    pub fn judge(&mut self, stamp: u64, arrival: Duration, rows: &[[f64; 4]; 3]) -> Verdict {
        let pose = match rigid(rows) {
            Ok(pose) => pose,
            Err(refusal) => return Verdict::Refused(refusal),
        };
        let mm = (Point::from(pose.translation.vector) - self.centre).norm();
        // A distance that is not a number is far, too.
        if !matches!(mm.partial_cmp(&self.reach_mm), Some(order) if order.is_le()) {
            return Verdict::Refused(Refusal::Far { mm });
        }
        let clock_restarted = match self.newness(stamp, arrival) {
            Newness::New => false,
            Newness::Restarted => true,
            Newness::Not(dropped) => return Verdict::Dropped(dropped),
        };
        let jump = self.last.is_some_and(|last| {
            let moved = pose.translation.vector - parts(&last.rows).1;
            moved.norm() > FASTEST_MM_S * last.until(stamp, arrival) + NOISE_MM
        });
        let alike = self.last.filter(|last| equal(&last.rows, rows)).map_or(0, |last| last.alike);
        let alike = alike.saturating_add(1);
        self.last = Some(Last { rows: *rows, stamp, arrival, alike });
        Verdict::Accepted { pose, jump, frozen: alike >= FROZEN, clock_restarted }
    }

    /// How new a stamp is; remembers it.
    fn newness(&mut self, stamp: u64, arrival: Duration) -> Newness {
        if stamp == 0 {
            return Newness::New;
        }
        let Some(newest) = self.newest.filter(|newest| stamp <= *newest) else {
            (self.newest, self.old) = (Some(stamp), None);
            return Newness::New;
        };
        if stamp == newest {
            self.old = None;
            return Newness::Not(Dropped::Duplicate);
        }
        // A clock that was set back goes on from there; the same old sample over and over does not.
        match self.old.filter(|old| stamp >= old.first) {
            Some(old) if stamp > old.first && arrival.saturating_sub(old.since) >= RESTARTED => {
                (self.newest, self.old) = (Some(stamp), None);
                Newness::Restarted
            }
            Some(_) => Newness::Not(Dropped::Old),
            None => {
                self.old = Some(OldRun { since: arrival, first: stamp });
                Newness::Not(Dropped::Old)
            }
        }
    }
}

impl Last {
    /// Time until another pose, s: by the device's clock if both have a stamp and it went on, else
    /// by arrival.
    fn until(&self, stamp: u64, arrival: Duration) -> f64 {
        match stamp.checked_sub(self.stamp) {
            Some(ticks) if self.stamp != 0 => ticks as f64 / (1_u64 << 32) as f64,
            _ => arrival.saturating_sub(self.arrival).as_secs_f64(),
        }
    }
}

/// The rigid motion nearest to a matrix that is nearly one: the turn is the orthogonal factor of
/// its polar decomposition.
///
/// # Errors
/// When a number is not finite, an entry of |R'R - I| is above 5e-3, or the determinant is not
/// above 0.
pub(crate) fn rigid(rows: &[[f64; 4]; 3]) -> Result<Pose, Refusal> {
    if !rows.iter().flatten().all(|value| value.is_finite()) {
        return Err(Refusal::NotFinite);
    }
    let (turn, tip) = parts(rows);
    let off = turn.transpose() * turn - Matrix::identity();
    // Huge numbers overflow to what is no number.
    let worst =
        off.iter().fold(
            0.0,
            |worst: f64, entry| {
                if entry.is_nan() { f64::INFINITY } else { worst.max(entry.abs()) }
            },
        );
    if worst > RIGID || turn.determinant() <= 0.0 {
        return Err(Refusal::NotRigid { worst });
    }
    let turn = Rotation3::from_matrix_unchecked(orthogonal(turn));
    Ok(Pose::from_parts(tip.into(), UnitQuaternion::from_rotation_matrix(&turn)))
}

/// The orthogonal factor of the polar decomposition of a matrix within [`RIGID`] of a turn, by
/// Newton's iteration X <- (X + X^-T)/2. The error is squared and halved each time: four of them go
/// from 2.5e-3 below rounding.
///
/// Source: Higham, SIAM J. Sci. Stat. Comput. 7, 1986.
fn orthogonal(matrix: Matrix) -> Matrix {
    (0..4).fold(matrix, |x, _| {
        let [a, b, c]: [Vector; 3] = std::array::from_fn(|k| x.column(k).into_owned());
        // The columns of the inverse transposed are these over the determinant.
        let cofactors = Matrix::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        (x + cofactors / a.dot(&b.cross(&c))) / 2.0
    })
}

/// Whether two poses are equal to the bit.
fn equal(a: &[[f64; 4]; 3], b: &[[f64; 4]; 3]) -> bool {
    a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Expect, Flag, Phase, Row, Trajectory};

    const EPOCH: u32 = 1_700_000_000;
    const STILL: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 2.0], [0.0, 0.0, 1.0, 3.0]];

    fn gate() -> Gate {
        Gate::new(Point::origin(), REACH_MM)
    }

    /// A stamp some seconds after the epoch.
    fn stamp(seconds: f64) -> u64 {
        (u64::from(EPOCH) << 32) + (seconds * (1_u64 << 32) as f64) as u64
    }

    fn after(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    fn expect(verdict: &Verdict) -> Expect {
        match verdict {
            Verdict::Accepted { .. } => Expect::Accept,
            Verdict::Dropped(Dropped::Duplicate) => Expect::Duplicate,
            Verdict::Dropped(Dropped::Old) => Expect::Old,
            Verdict::Refused(Refusal::NotFinite) => Expect::NotFinite,
            Verdict::Refused(Refusal::NotRigid { .. }) => Expect::NotRigid,
            Verdict::Refused(Refusal::Far { .. }) => Expect::Far,
        }
    }

    /// The verdicts on a trajectory round a centre, with numbers as they are on the wire.
    fn judged(trajectory: &Trajectory, centre: Point) -> Vec<Verdict> {
        let mut gate = Gate::new(centre, REACH_MM);
        let judge = |row: &Row| {
            let wire = row.rows.map(|row| row.map(|value| f64::from(value as f32)));
            gate.judge(row.stamp(EPOCH), after(row.t_send_s), &wire)
        };
        trajectory.rows().iter().map(judge).collect()
    }

    #[test]
    fn each_row_of_the_trajectories_gets_the_verdict_that_it_expects() {
        let turn = UnitQuaternion::from_euler_angles(0.4, 2.0, -1.0);
        let origin = Pose::from_parts(Vector::new(80.0, -90.0, -1200.0).into(), turn);
        let centre = Point::from(origin.translation.vector);
        for (trajectory, centre) in [
            (Trajectory::short(), Point::origin()),
            (Trajectory::long(), Point::origin()),
            (Trajectory::long().at(&origin), centre),
        ] {
            for (row, verdict) in trajectory.rows().iter().zip(judged(&trajectory, centre)) {
                assert_eq!(expect(&verdict), row.expect, "{row:?} {verdict:?}");
                let Verdict::Accepted { pose, frozen, clock_restarted, .. } = verdict else {
                    continue;
                };
                assert!(!frozen && !clock_restarted, "{row:?}");
                assert!((Point::from(pose.translation.vector) - row.tip).norm() < 0.4);
            }
        }
    }

    #[test]
    fn what_jumps_in_the_trajectory_is_flagged_and_nothing_else() {
        let long = Trajectory::long();
        let verdicts = judged(&long, Point::origin());
        let mut flagged = 0;
        for (at, (row, verdict)) in long.rows().iter().zip(verdicts).enumerate() {
            let before = at.checked_sub(1).map(|at| long.rows()[at].phase);
            // Out of the last jump into the turn, and from the end of the withdrawal to the bed.
            let leaves = matches!(
                (before, row.phase),
                (Some(Phase::Jumps), Phase::Turn) | (Some(Phase::Withdraw), Phase::Rest)
            );
            let jumps = matches!(verdict, Verdict::Accepted { jump: true, .. });
            assert_eq!(jumps, leaves || row.flag == Some(Flag::Jump), "{row:?}");
            flagged += usize::from(jumps);
        }
        assert_eq!(flagged, 11);
    }

    #[test]
    fn after_a_while_a_tool_may_be_farther_off() {
        let jumped = |from: u64, to: u64, arrival: f64, mm: f64| {
            let mut gate = gate();
            let mut moved = STILL;
            moved[1][3] += mm;
            assert_eq!(expect(&gate.judge(from, after(0.0), &STILL)), Expect::Accept);
            matches!(gate.judge(to, after(arrival), &moved), Verdict::Accepted { jump: true, .. })
        };
        // 2 s at 29 mm/s and 1 mm: by the stamps, and by arrival when one of them has none.
        for (from, to, arrival) in
            [(stamp(1.0), stamp(3.0), 0.0), (0, stamp(3.0), 2.0), (stamp(1.0), 0, 2.0)]
        {
            assert!(!jumped(from, to, arrival, 58.9) && jumped(from, to, arrival, 59.1));
        }
    }

    #[test]
    fn a_matrix_near_a_turn_becomes_the_nearest_turn() {
        let mut draws = crate::trajectory::SplitMix::new(5);
        for _ in 0..500 {
            let turn = Rotation3::from_scaled_axis(Vector::from(draws.normals()));
            let matrix = turn.into_inner() + Matrix::from_fn(|_, _| 5e-4 * draws.normal());
            let svd = matrix.svd(true, true);
            let nearest = svd.u.unwrap() * svd.v_t.unwrap();
            assert!((orthogonal(matrix) - nearest).amax() < 1e-14);
            let rows = [0, 1, 2].map(|i| [matrix[(i, 0)], matrix[(i, 1)], matrix[(i, 2)], 0.0]);
            let pose = rigid(&rows).unwrap();
            let found = pose.rotation.to_rotation_matrix().into_inner();
            assert!((found - nearest).amax() < 1e-14, "{found} {nearest}");
        }
    }

    #[test]
    fn a_scale_is_refused_from_a_quarter_of_a_percent_on() {
        let scaled = |scale: f64| {
            let mut rows = STILL;
            for k in 0..3 {
                rows[k][k] *= scale;
            }
            rigid(&rows)
        };
        assert!(scaled(1.0024).is_ok() && scaled(0.9976).is_ok());
        for scale in [1.0026, 0.9974, 0.0, -1.0, 1e200, f64::MAX] {
            assert!(matches!(scaled(scale), Err(Refusal::NotRigid { .. })), "{scale}");
        }
        assert_eq!(scaled(1e200), Err(Refusal::NotRigid { worst: f64::INFINITY }));
        assert_eq!(scaled(f64::NAN), Err(Refusal::NotFinite));
    }

    #[test]
    fn what_is_far_or_has_no_distance_is_refused() {
        let at = |x: f64| {
            let mut rows = STILL;
            rows[0][3] = x;
            gate().judge(1, Duration::ZERO, &rows)
        };
        assert!(matches!(at(499.9), Verdict::Accepted { .. }));
        for x in [500.1, -3e38, f64::MAX] {
            assert!(matches!(at(x), Verdict::Refused(Refusal::Far { .. })), "{x}");
        }
        for reach in [f64::NAN, -1.0] {
            let verdict = Gate::new(Point::origin(), reach).judge(1, Duration::ZERO, &STILL);
            assert!(matches!(verdict, Verdict::Refused(Refusal::Far { .. })));
        }
    }

    #[test]
    fn the_fifth_equal_pose_with_a_new_stamp_is_frozen() {
        let mut gate = gate();
        let mut frozen = |t: f64, rows: &[[f64; 4]; 3]| match gate.judge(stamp(t), after(t), rows) {
            Verdict::Accepted { frozen, .. } => Some(frozen),
            _ => None,
        };
        for k in 0..4 {
            assert_eq!(frozen(f64::from(k), &STILL), Some(false));
            assert_eq!(frozen(f64::from(k), &STILL), None, "the same stamp does not count");
        }
        assert_eq!(frozen(4.0, &STILL), Some(true));
        assert_eq!(frozen(5.0, &STILL), Some(true));
        let mut moved = STILL;
        moved[2][3] = f64::from_bits(moved[2][3].to_bits() + 1);
        assert_eq!(frozen(6.0, &moved), Some(false));
        assert_eq!(frozen(7.0, &STILL), Some(false));
    }

    #[test]
    fn a_pose_without_stamp_is_never_dropped() {
        let mut gate = gate();
        let mut judge = |stamp, t| expect(&gate.judge(stamp, after(t), &STILL));
        assert_eq!(judge(0, 0.0), Expect::Accept);
        assert_eq!(judge(stamp(1.0), 1.0), Expect::Accept);
        assert_eq!(judge(0, 1.1), Expect::Accept);
        assert_eq!(judge(0, 1.2), Expect::Accept);
        assert_eq!(judge(stamp(1.0), 1.3), Expect::Duplicate, "the newest is still known");
        assert_eq!(judge(stamp(0.9), 1.4), Expect::Old);
    }

    #[test]
    fn what_is_refused_does_not_count_as_the_newest() {
        let mut gate = gate();
        let mut bad = STILL;
        bad[0][0] = f64::NAN;
        assert_eq!(expect(&gate.judge(stamp(1.0), after(1.0), &STILL)), Expect::Accept);
        assert_eq!(expect(&gate.judge(stamp(9.0), after(1.1), &bad)), Expect::NotFinite);
        assert_eq!(expect(&gate.judge(stamp(0.5), after(1.2), &bad)), Expect::NotFinite);
        assert_eq!(expect(&gate.judge(stamp(2.0), after(1.3), &STILL)), Expect::Accept);
    }

    /// What a stream at 10 Hz gets whose clock is `back` s behind from t = 10 s on: when it is
    /// first accepted again, and whether it is said that the clock was set.
    fn set_back(back: f64) -> (f64, bool) {
        let mut gate = gate();
        for k in 0..2_000 {
            let t = f64::from(k) * 0.1;
            let device = 5_000.0 + if k < 100 { t } else { t - back };
            let verdict = gate.judge(stamp(device), after(t), &STILL);
            match verdict {
                Verdict::Accepted { clock_restarted, .. } if k >= 100 => {
                    return (t, clock_restarted);
                }
                Verdict::Accepted { clock_restarted, .. } => assert!(!clock_restarted),
                _ => assert!(k >= 100),
            }
        }
        panic!("lost for good");
    }

    #[test]
    fn a_clock_that_is_set_back_by_an_hour_is_taken_up_after_five_seconds() {
        assert_eq!(set_back(3600.0), (15.0, true));
        let (t, restarted) = set_back(2.0);
        assert!((11.8..12.2).contains(&t) && !restarted, "{t}");
    }

    #[test]
    fn a_stamp_far_ahead_holds_the_stream_up_for_five_seconds_only() {
        let mut gate = gate();
        assert_eq!(expect(&gate.judge(u64::MAX, after(0.0), &STILL)), Expect::Accept);
        let verdicts = (1..=60).map(|k| {
            let t = f64::from(k) * 0.1;
            expect(&gate.judge(stamp(t), after(t), &STILL))
        });
        let dropped = verdicts.take_while(|verdict| *verdict == Expect::Old).count();
        assert_eq!(dropped, 50);
    }

    #[test]
    fn the_same_old_sample_over_and_over_is_never_taken() {
        let mut gate = gate();
        assert_eq!(expect(&gate.judge(stamp(9.0), after(9.0), &STILL)), Expect::Accept);
        for k in 0..200 {
            let verdict = gate.judge(stamp(8.0), after(9.0 + f64::from(k) * 0.1), &STILL);
            assert_eq!(expect(&verdict), Expect::Old);
        }
        // One newer sample in between, and the clock is as it was.
        assert_eq!(expect(&gate.judge(stamp(29.0), after(29.0), &STILL)), Expect::Accept);
        assert_eq!(expect(&gate.judge(stamp(8.5), after(29.1), &STILL)), Expect::Old);
    }

    #[test]
    fn any_numbers_get_a_verdict() {
        let mut draws = crate::trajectory::SplitMix::new(8);
        let odd = [0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, 1e308, 5e-324, 0.5, -1e200];
        let mut gate = gate();
        for _ in 0..20_000 {
            let mut pick = || odd[(draws.even() * odd.len() as f64) as usize];
            let rows = [0; 3].map(|_| [0; 4].map(|_| pick()));
            let stamp = [0, 1, u64::MAX, 1 << 40][(draws.even() * 4.0) as usize];
            let arrival = Duration::from_secs_f64(draws.even() * 1e9);
            if let Verdict::Accepted { pose, .. } = gate.judge(stamp, arrival, &rows) {
                assert!(pose.to_homogeneous().iter().all(|value| value.is_finite()));
            }
        }
    }
}

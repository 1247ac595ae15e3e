//! Where the tip of a tool is: the tool is turned about its tip, which stays in a dent.
//!
//! For all poses (R, p) of the tool's marker R t + p = c, with the tip t in the tool's frame and
//! the dent c in the tracker's. Stacked, [R, -I] [t; c] = -p is solved by least squares. How well
//! that fits says nothing about the tip: a tool that was hardly turned fits as well. What counts is
//! the deviation of the tip from the covariance, and the condition.

use crate::gate::{self, Refusal};
use crate::trajectory::{TableError, table};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use supine_space::{Point, Pose, Vector};

/// Greatest deviation of the tip in an axis that is accepted, mm.
pub const MOST_SIGMA_MM: f64 = 0.15;
/// Greatest condition that is accepted: at 180 mm a tool that is tilted by 20 degrees has 8, by 10
/// degrees 17.
pub const MOST_CONDITION: f64 = 10.0;
/// Two poses leave the tip open along the axis between them.
const LEAST: usize = 3;
/// Singular values below this share of the largest are zero: numbers of a tracker have six digits.
const RANK: f64 = 1e-6;
/// The length of a pose's quaternion is 1 to within this.
const UNIT: f64 = 1e-6;
/// No pose of a tracker is farther away, mm.
const FARTHEST_MM: f64 = 1e6;

/// Why poses give no tip. Poses are counted from 1.
#[derive(Debug, thiserror::Error, PartialEq)]
#[non_exhaustive]
pub enum PivotError {
    /// Fewer than three.
    #[error(
        "{0} poses leave the tip open: keep the tip in its dent, tilt the tool by 30 degrees in all directions and take fifty poses"
    )]
    TooFew(usize),
    /// A number is not finite, a position is beyond 1 km, or the quaternion is not of length 1.
    #[error(
        "pose {number} is not finite, is beyond 1 km or has a quaternion that is not of length 1: take it out"
    )]
    Pose {
        /// Which pose.
        number: usize,
    },
    /// The tool was turned about one axis alone, or not at all.
    #[error(
        "the {poses} poses leave the tip open (rank {rank} of 6): the tool was turned about one axis or not at all; tilt the tool by 30 degrees in all directions"
    )]
    Rank {
        /// Number of poses.
        poses: usize,
        /// Rank of the equations.
        rank: usize,
    },
    /// The tool was hardly tilted.
    #[error(
        "the tool was tilted too little: condition {condition:.1}, at most {MOST_CONDITION} is accepted (tip known to {sigma_mm:.2} mm); tilt the tool by 30 degrees in all directions"
    )]
    Condition {
        /// Condition of the equations.
        condition: f64,
        /// Greatest deviation of the tip in an axis, mm.
        sigma_mm: f64,
    },
    /// The poses scatter too much.
    #[error(
        "the tip is known to {sigma_mm:.2} mm only, at most {MOST_SIGMA_MM} mm is accepted (poses scatter by {rms_mm:.2} mm): keep the tip in its dent and take more poses, tilted by 30 degrees in all directions"
    )]
    Sigma {
        /// Greatest deviation of the tip in an axis, mm.
        sigma_mm: f64,
        /// Rms distance of the tip from the dent, mm.
        rms_mm: f64,
    },
    /// The table of poses cannot be read.
    #[error("table of poses: {0}")]
    Table(#[from] TableError),
    /// A line of the table is no pose.
    #[error("table of poses, line {line}: {refusal}; or take the line out")]
    Line {
        /// Counted from 1, the header included.
        line: u64,
        /// What is wrong with it.
        refusal: Refusal,
    },
}

/// The tip of a tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pivot {
    /// The tip in the tool's frame, mm.
    pub tip: Vector,
    /// The dent in the tracker's frame, mm.
    pub pivot: Point,
    /// Rms distance of the tip from the dent over the poses, mm. Says nothing of the error of the
    /// tip.
    pub rms_mm: f64,
    /// Standard deviations of the tip in the tool's axes, mm: from s² (A'A)^-1 with s² = r'r/(3n -
    /// 6).
    pub sigma_mm: [f64; 3],
    /// Largest over least singular value of the equations: low when the tool was tilted far in all
    /// directions.
    pub condition: f64,
}

impl Pivot {
    /// The tip from poses of the tool in the tracker's frame, mm, while the tip stayed at one
    /// place.
    ///
    /// # Errors
    /// When there are fewer than three poses, a number is not finite or beyond 1 km, the poses
    /// leave the tip open, the condition is above 10, or a deviation of the tip is above 0.15 mm.
    pub fn new(poses: &[Pose]) -> Result<Self, PivotError> {
        let pivot = Self::solve(poses)?;
        let sigma_mm = pivot.sigma_mm.into_iter().fold(0.0, f64::max);
        if pivot.condition > MOST_CONDITION {
            Err(PivotError::Condition { condition: pivot.condition, sigma_mm })
        } else if sigma_mm > MOST_SIGMA_MM {
            Err(PivotError::Sigma { sigma_mm, rms_mm: pivot.rms_mm })
        } else {
            Ok(pivot)
        }
    }

    /// The tip however well it is known.
    fn solve(poses: &[Pose]) -> Result<Self, PivotError> {
        if poses.len() < LEAST {
            return Err(PivotError::TooFew(poses.len()));
        }
        if let Some(index) = poses.iter().position(|pose| !sound(pose)) {
            return Err(PivotError::Pose { number: index + 1 });
        }
        let (a, mut b) = stack(poses);
        // The triangle of QR has the singular values of the whole.
        let qr = a.qr();
        let triangle: Matrix6<f64> = qr.r().fixed_view::<6, 6>(0, 0).into_owned();
        qr.q_tr_mul(&mut b);
        let right: Vector6<f64> = b.fixed_rows::<6>(0).into_owned();
        let svd = triangle.svd(true, true);
        let values = svd.singular_values;
        let rank = values.iter().filter(|value| **value > RANK * values[0]).count();
        let (Some(u), Some(v_t), 6) = (svd.u, svd.v_t, rank) else {
            return Err(PivotError::Rank { poses: poses.len(), rank });
        };
        let solution = v_t.tr_mul(&u.tr_mul(&right).component_div(&values));
        let tip: Vector = solution.fixed_rows::<3>(0).into_owned();
        let pivot = Point::from(solution.fixed_rows::<3>(3).into_owned());
        let off = |pose: &Pose| (pose * Point::from(tip) - pivot).norm_squared();
        let squares = poses.iter().map(off).sum::<f64>();
        let count = poses.len() as f64;
        let variance = squares / (3.0 * count - 6.0);
        let deviation =
            |k: usize| (variance * v_t.column(k).component_div(&values).norm_squared()).sqrt();
        Ok(Self {
            tip,
            pivot,
            rms_mm: (squares / count).sqrt(),
            sigma_mm: [deviation(0), deviation(1), deviation(2)],
            condition: values[0] / values[5],
        })
    }
}

/// Whether all numbers are finite, none is far away, and the turn is one.
fn sound(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|value| value.abs() <= FARTHEST_MM)
        && (pose.rotation.coords.norm() - 1.0).abs() < UNIT
}

/// The equations of all poses: matrix (3n x 6) and right side (3n).
fn stack(poses: &[Pose]) -> (DMatrix<f64>, DVector<f64>) {
    let mut a = DMatrix::zeros(3 * poses.len(), 6);
    let mut b = DVector::zeros(3 * poses.len());
    for (k, pose) in poses.iter().enumerate() {
        let turn = pose.rotation.to_rotation_matrix();
        a.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(turn.matrix());
        a.fixed_view_mut::<3, 3>(3 * k, 3).fill_diagonal(-1.0);
        b.fixed_rows_mut::<3>(3 * k).copy_from(&-pose.translation.vector);
    }
    (a, b)
}

/// Reads poses of a tool in the tracker's frame: a table of comma-separated values whose header
/// names the columns `m0` to `m11`, as the table of a recorded trajectory does. They are R11 R21
/// R31 R12 R22 R32 R13 R23 R33 TX TY TZ, the order of a TRANSFORM message, mm. Other columns are
/// passed over.
///
/// # Errors
/// When the header lacks a column, a line has another number of fields, a field is no finite
/// number, or a matrix is no rigid motion within 5e-3; the line is named.
pub fn read_poses(text: &str) -> Result<Vec<Pose>, PivotError> {
    let columns = ["m0", "m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8", "m9", "m10", "m11"];
    let lines = table::read(text, None, columns)?;
    let pose = |line: &table::Line<12>| {
        let rows = [0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| line.values[3 * column + row]));
        gate::rigid(&rows).map_err(|refusal| PivotError::Line { line: line.number, refusal })
    };
    lines.iter().map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::SplitMix;
    use std::f64::consts::{FRAC_PI_4, FRAC_PI_6, TAU};

    const TIP: [f64; 3] = [1.5, -2.0, 180.0];
    const DENT: [f64; 3] = [10.0, 20.0, -1500.0];

    fn tip() -> Vector {
        Vector::from(TIP)
    }

    /// A pose with the tip in the dent but for an error of the position.
    fn pose(turn: Vector, off: Vector) -> Pose {
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(turn);
        Pose::from_parts((Vector::from(DENT) - turn * tip() + off).into(), turn)
    }

    /// Eight poses round a cone of 30 degrees with errors that look random. The results are those
    /// of another program.
    fn fixed() -> Vec<Pose> {
        let at = |k: usize| {
            let a = k as f64 * FRAC_PI_4;
            let degrees = Vector::new(30.0 * a.cos(), 30.0 * a.sin(), 12.0 * k as f64);
            let off = |j: usize| (((7 * k + 3 * j) % 11) as f64 - 5.0) * 0.04;
            pose(degrees * 1.0_f64.to_radians(), Vector::new(off(0), off(1), off(2)))
        };
        (0..8).map(at).collect()
    }

    /// Poses within a cone, turned about the tool's axis by up to 30 degrees, with errors of the
    /// position of 0.1 mm an axis and of the turn of `tilt` rad an axis.
    fn cone(draws: &mut SplitMix, count: usize, half_angle_deg: f64, tilt: f64) -> Vec<Pose> {
        let mut one = |_| {
            let (around, out) =
                (TAU * draws.even(), half_angle_deg.to_radians() * draws.even().sqrt());
            let lean = nalgebra::UnitQuaternion::from_scaled_axis(
                Vector::new(around.cos(), around.sin(), 0.0) * out,
            );
            let spin = Vector::z() * (FRAC_PI_6 * (2.0 * draws.even() - 1.0));
            let turn = lean * nalgebra::UnitQuaternion::from_scaled_axis(spin);
            let mut pose = pose(turn.scaled_axis(), Vector::from(draws.normals()) * 0.1);
            let error = Vector::from(draws.normals()) * tilt;
            pose.rotation *= nalgebra::UnitQuaternion::from_scaled_axis(error);
            pose
        };
        (0..count).map(&mut one).collect()
    }

    fn same(ours: f64, theirs: f64, digits: f64) -> bool {
        (ours - theirs).abs() < digits
    }

    #[test]
    fn the_tip_of_fixed_data_is_that_of_another_program() {
        let pivot = Pivot::new(&fixed()).unwrap();
        let expected = Vector::new(1.600_978, -1.929_362, 179.930_088);
        assert!((pivot.tip - expected).amax() < 1e-6, "{}", pivot.tip);
        assert!(same(pivot.rms_mm, 0.207_911, 1e-6), "{}", pivot.rms_mm);
        assert!(same((pivot.tip - tip()).norm(), 0.141_683, 1e-6));
        assert!(same(pivot.condition, 4.970, 5e-4), "{}", pivot.condition);
        let sigmas = pivot.sigma_mm.iter().zip([0.093, 0.092, 0.112]);
        assert!(sigmas.into_iter().all(|(a, b)| same(*a, b, 5.1e-4)), "{:?}", pivot.sigma_mm);
        assert!((pivot.pivot - Point::from(DENT)).norm() < 0.3, "{}", pivot.pivot);
    }

    #[test]
    fn poses_without_error_give_the_tip() {
        let poses: Vec<Pose> = fixed()
            .iter()
            .map(|with_error| pose(with_error.rotation.scaled_axis(), Vector::zeros()))
            .collect();
        let pivot = Pivot::new(&poses).unwrap();
        assert!((pivot.tip - tip()).norm() < 1e-9 && pivot.rms_mm < 1e-9, "{pivot:?}");
        assert!((pivot.pivot - Point::from(DENT)).norm() < 1e-9);
        // Three poses are enough to know it, but these are too much alike to be accepted.
        assert!((Pivot::solve(&poses[..3]).unwrap().tip - tip()).norm() < 1e-9);
        assert!(matches!(Pivot::new(&poses[..3]), Err(PivotError::Condition { .. })));
    }

    #[test]
    fn two_poses_are_refused() {
        assert_eq!(Pivot::new(&fixed()[..2]), Err(PivotError::TooFew(2)));
        assert_eq!(Pivot::new(&[]), Err(PivotError::TooFew(0)));
        let text = PivotError::TooFew(2).to_string();
        assert!(text.contains("30 degrees in all directions"), "{text}");
    }

    #[test]
    fn turns_about_one_axis_leave_the_tip_open() {
        let poses: Vec<Pose> =
            (0..20).map(|k| pose(Vector::x() * 0.05 * f64::from(k), Vector::zeros())).collect();
        assert_eq!(Pivot::new(&poses), Err(PivotError::Rank { poses: 20, rank: 5 }));
        let twice = [fixed()[0], fixed()[1], fixed()[0], fixed()[1]];
        assert_eq!(Pivot::new(&twice), Err(PivotError::Rank { poses: 4, rank: 5 }));
        let still = vec![fixed()[0]; 50];
        assert_eq!(Pivot::new(&still), Err(PivotError::Rank { poses: 50, rank: 3 }));
    }

    #[test]
    fn a_tool_that_did_not_move_but_for_noise_is_refused_for_its_condition() {
        let mut draws = SplitMix::new(21);
        let error = Pivot::new(&cone(&mut draws, 200, 0.0, 0.001)).unwrap_err();
        assert!(matches!(error, PivotError::Condition { .. }), "{error}");
        let error = Pivot::new(&cone(&mut draws, 200, 5.0, 0.001)).unwrap_err();
        let PivotError::Condition { condition, .. } = error else { panic!("{error}") };
        assert!((20.0..50.0).contains(&condition), "{condition}");
        assert!(error.to_string().contains("30 degrees in all directions"), "{error}");
    }

    #[test]
    fn a_tip_that_slips_is_refused_for_its_deviation() {
        let mut draws = SplitMix::new(22);
        let slip = |pose: &Pose| {
            let mut slipped = *pose;
            slipped.translation.vector += Vector::from(draws.normals()) * 2.0;
            slipped
        };
        let poses: Vec<Pose> =
            cone(&mut SplitMix::new(23), 50, 45.0, 0.0).iter().map(slip).collect();
        let error = Pivot::new(&poses).unwrap_err();
        assert!(matches!(error, PivotError::Sigma { .. }), "{error}");
    }

    #[test]
    fn the_deviation_of_the_tip_is_that_of_many_trials() {
        const TRIALS: u32 = 400;
        let mut draws = SplitMix::new(24);
        let mut shares = Vec::new();
        for _ in 0..TRIALS {
            let pivot = Pivot::solve(&cone(&mut draws, 20, 30.0, 0.0)).unwrap();
            let off = pivot.tip - tip();
            shares.push((0..3).map(|k| (off[k] / pivot.sigma_mm[k]).powi(2)).sum::<f64>() / 3.0);
        }
        let mean = shares.iter().sum::<f64>() / f64::from(TRIALS);
        let variance = shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / f64::from(TRIALS);
        // Squares of Student's t with 3 n - 6 = 54 degrees of freedom have the mean 54/52.
        let error = (variance / f64::from(TRIALS)).sqrt();
        assert!((mean - 54.0 / 52.0).abs() < 3.0 * error && error < 0.1, "{mean} {error}");
    }

    /// Errors of the tip, rms, for 0.1 mm and 0.05 degrees of noise and 50 poses; by another
    /// program, which repeats 300 times.
    #[test]
    fn the_error_of_the_tip_falls_with_the_tilt() {
        let tilt = 0.05_f64.to_radians();
        for (angle, expected, condition) in
            [(5.0, 0.47, 33.0), (10.0, 0.25, 17.0), (30.0, 0.11, 5.6)]
        {
            let mut draws = SplitMix::new(25);
            let (mut squares, mut conditions) = (0.0, Vec::new());
            for _ in 0..200 {
                let pivot = Pivot::solve(&cone(&mut draws, 50, angle, tilt)).unwrap();
                squares += (pivot.tip - tip()).norm_squared() / 200.0;
                conditions.push(pivot.condition);
            }
            conditions.sort_by(f64::total_cmp);
            let found = squares.sqrt();
            // Of 200 squares the root has an error of 4 %, theirs of 3 %.
            assert!((found / expected - 1.0).abs() < 0.15, "{angle}: {found}");
            assert!(
                (conditions[100] / condition - 1.0).abs() < 0.05,
                "{angle}: {}",
                conditions[100]
            );
        }
    }

    #[test]
    fn numbers_that_are_none_are_refused_with_the_pose() {
        for wrong in [f64::NAN, f64::INFINITY, 1e300] {
            let mut poses = fixed();
            poses[4].translation.vector.y = wrong;
            assert_eq!(Pivot::new(&poses), Err(PivotError::Pose { number: 5 }));
            let mut poses = fixed();
            let broken = nalgebra::Quaternion::new(wrong, 0.0, 0.0, 0.0);
            poses[2].rotation = nalgebra::Unit::new_unchecked(broken);
            assert_eq!(Pivot::new(&poses), Err(PivotError::Pose { number: 3 }));
        }
    }

    /// A table of poses with another column in front.
    fn written(poses: &[Pose]) -> String {
        let header: Vec<String> = (0..12).map(|k| format!("m{k}")).collect();
        let mut text = format!("seq,{}\n", header.join(","));
        for (seq, pose) in poses.iter().enumerate() {
            let matrix = pose.to_homogeneous();
            let numbers: Vec<String> =
                (0..12).map(|k| format!("{:.9}", matrix[(k % 3, k / 3)])).collect();
            text += &format!("{seq},{}\n", numbers.join(","));
        }
        text
    }

    #[test]
    fn poses_are_read_from_a_table() {
        let poses = read_poses(&written(&fixed())).unwrap();
        assert_eq!(poses.len(), 8);
        for (read, expected) in poses.iter().zip(fixed()) {
            assert!((read.to_homogeneous() - expected.to_homogeneous()).amax() < 2e-9);
        }
        let expected = Vector::new(1.600_978, -1.929_362, 179.930_088);
        assert!((Pivot::new(&poses).unwrap().tip - expected).amax() < 1e-6);
    }

    #[test]
    fn what_is_no_table_of_poses_is_refused_with_its_line() {
        let text = written(&fixed());
        let refused = |text: &str| read_poses(text).unwrap_err().to_string();
        assert!(refused(&text.replace("m11", "m12")).contains("`m11` 0 times"));
        let scaled = text.replacen("\n1,0.", "\n1,0.1", 1);
        assert_ne!(scaled, text);
        let message = refused(&scaled);
        assert!(message.contains("line 3") && message.contains("rigid"), "{message}");
        let lost = text.replacen("\n2,0.", "\n2,nan0.", 1);
        assert!(refused(&lost).contains("line 4"), "{}", refused(&lost));
        assert_eq!(read_poses(text.lines().next().unwrap()), Ok(vec![]));
    }
}

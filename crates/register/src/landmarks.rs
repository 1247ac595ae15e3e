//! A rigid pose from points that are known in both frames.

use crate::Error;
use nalgebra::{Rotation3, Translation3, UnitQuaternion};
use supine_space::{Matrix, Point, Pose, Vector};

/// Least number of points.
const LEAST: usize = 3;
/// Points nearer to a line than this, mm rms, do not fix the turn about it.
const OFF_LINE_MM: f64 = 10.0;

/// A pose from landmarks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// From the first frame to the second.
    pub pose: Pose,
    /// What is left between the points, mm rms.
    pub rms_mm: f64,
}

/// The pose that takes the first of each pair nearest to the second, mm, in least squares.
///
/// Source: Kabsch, Acta Cryst. A34, 1978.
///
/// # Errors
/// [`Error::Landmarks`] when there are fewer than three pairs or they lie on one line.
pub fn by_landmarks(pairs: &[(Point, Point)]) -> Result<Fitted, Error> {
    if pairs.len() < LEAST {
        return Err(Error::Landmarks(format!(
            "{} landmarks are in both, three are needed",
            pairs.len()
        )));
    }
    let n = pairs.len() as f64;
    let middle = |of: fn(&(Point, Point)) -> Point| -> Vector {
        pairs.iter().map(|p| of(p).coords).sum::<Vector>() / n
    };
    let (from, to) = (middle(|p| p.0), middle(|p| p.1));
    let spread: Matrix =
        pairs.iter().map(|(a, b)| (b.coords - to) * (a.coords - from).transpose()).sum();
    let own: Matrix =
        pairs.iter().map(|(_, b)| (b.coords - to) * (b.coords - to).transpose()).sum();
    let mut wide: Vec<f64> =
        own.symmetric_eigenvalues().iter().map(|v| (v.max(0.0) / n).sqrt()).collect();
    wide.sort_by(f64::total_cmp);
    if wide[1] < OFF_LINE_MM {
        return Err(Error::Landmarks(
            "the landmarks lie on one line: name others beside it".into(),
        ));
    }
    let svd = spread.svd(true, true);
    let (Some(u), Some(v)) = (svd.u, svd.v_t) else {
        return Err(Error::Landmarks("the landmarks do not fix a pose".into()));
    };
    let mirror = (u * v).determinant().signum();
    let turn = u * Matrix::from_diagonal(&Vector::new(1.0, 1.0, mirror)) * v;
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    let pose = Pose::from_parts(Translation3::from(to - rotation * from), rotation);
    let left: f64 = pairs.iter().map(|(a, b)| (pose * a - b).norm_squared()).sum();
    Ok(Fitted { pose, rms_mm: (left / n).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn turned(angles: [f64; 3], shift: [f64; 3]) -> Pose {
        let [a, b, c] = angles;
        Pose::from_parts(
            Translation3::from(Vector::from(shift)),
            UnitQuaternion::from_euler_angles(a, b, c),
        )
    }

    proptest! {
        #[test]
        fn the_pose_between_two_frames_comes_back(
            angles in prop::array::uniform3(-3.0..3.0f64),
            shift in prop::array::uniform3(-500.0..500.0f64),
        ) {
            let pose = turned(angles, shift);
            let points = [[0.0, 0.0, 0.0], [0.0, 20.0, -170.0], [40.0, 12.0, -8.0], [-40.0, 12.0, -8.0]];
            let pairs: Vec<_> = points.map(|p| (Point::from(p), pose * Point::from(p))).into();
            let found = by_landmarks(&pairs).unwrap();
            prop_assert!(found.rms_mm < 1e-9, "{found:?}");
            prop_assert!((found.pose.inverse() * pose).rotation.angle() < 1e-7);
        }
    }

    #[test]
    fn few_points_or_points_on_a_line_are_refused() {
        let pair = |x: f64| (Point::new(x, 0.0, 0.0), Point::new(x, 0.0, 1.0));
        assert!(by_landmarks(&[pair(0.0), pair(90.0)]).is_err());
        assert!(by_landmarks(&[pair(0.0), pair(90.0), pair(40.0)]).is_err());
    }
}

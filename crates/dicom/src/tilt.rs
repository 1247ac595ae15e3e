//! Whether slices are stacked along their normal, or lean away from it (gantry tilt).

use crate::number::ROUNDING_MM;
use std::f64::consts::SQRT_2;
use supine_space::{Point, Vector};

/// Largest angle between the line through the slices and their normal, degrees. Chosen, not
/// measured: the volume that is made of the slices stands straight, so a lean of 0.1 degrees puts
/// the last slice of a chest of 300 mm aside by 0.52 mm, less than a pixel. Gantry/Detector Tilt is
/// not asked: it is nominal and "not intended for mathematical computations" (PS3.3 C.8.2.1).
const LARGEST_LEAN_DEGREES: f64 = 0.1;
/// The steepest line that least squares lay through points of a straight stack that are off by 1 at
/// most, times the length of the stack: sum of |x| over sum of x^2, for many equal steps.
const ROUNDED_LEAN: f64 = 3.0;

/// How slices lie beside the normal through the first of them.
#[derive(Debug)]
pub(crate) struct Lean {
    /// Angle of the least-squares line through the slices with their normal, degrees.
    pub(crate) degrees: f64,
    /// The slice farthest from the normal through the first, and its distance, mm.
    pub(crate) farthest: Aside,
    /// The slice farthest from the least-squares line, and its distance, mm.
    pub(crate) strayed: Aside,
    largest_degrees: f64,
}

/// A slice and how far it lies aside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aside {
    pub(crate) slice: usize,
    pub(crate) mm: f64,
}

impl Lean {
    /// Of slices with these first voxels, in order along the unit vector `normal`.
    pub(crate) fn of(positions: &[Point], normal: &Vector) -> Self {
        let offset = |p: &Point| p - positions[0];
        let places: Vec<f64> = positions.iter().map(|p| offset(p).dot(normal)).collect();
        let aside: Vec<Vector> =
            positions.iter().zip(&places).map(|(p, place)| offset(p) - normal * *place).collect();
        let count = positions.len() as f64;
        let middle = places.iter().sum::<f64>() / count;
        let mean = aside.iter().sum::<Vector>() / count;
        let moment: f64 = places.iter().map(|p| (p - middle).powi(2)).sum();
        let pairs = || places.iter().zip(&aside);
        let slope = pairs().map(|(p, a)| (p - middle) * a).sum::<Vector>() / moment.max(1e-9);
        let length = places.last().copied().unwrap_or_default();
        // Two components beside the normal are rounded, each by as much.
        let rounded = (ROUNDED_LEAN * SQRT_2 * ROUNDING_MM / length).atan().to_degrees();
        Self {
            degrees: slope.norm().atan().to_degrees(),
            farthest: farthest(aside.iter().map(Vector::norm)),
            strayed: farthest(pairs().map(|(p, a)| (a - mean - (p - middle) * slope).norm())),
            largest_degrees: LARGEST_LEAN_DEGREES.max(rounded),
        }
    }

    /// Whether the stack leans more than a straight one can whose positions were rounded.
    pub(crate) fn is_tilted(&self) -> bool {
        self.degrees > self.largest_degrees
    }

    /// Whether a slice lies off the line by more than rounding puts it there: the slice may be off
    /// by half a unit, and so may the line.
    pub(crate) fn has_stray(&self) -> bool {
        self.strayed.mm > 2.0 * SQRT_2 * ROUNDING_MM
    }
}

fn farthest(distances: impl Iterator<Item = f64>) -> Aside {
    let all = distances.enumerate().map(|(slice, mm)| Aside { slice, mm });
    all.max_by(|a, b| a.mm.total_cmp(&b.mm)).unwrap_or(Aside { slice: 0, mm: 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slices one step apart along an oblique normal, sheared along a row.
    fn sheared(count: usize, step_mm: f64, degrees: f64) -> (Vec<Point>, Vector) {
        let (row, column) = (Vector::new(0.8, 0.6, 0.0), Vector::new(-0.36, 0.48, 0.8));
        let normal = row.cross(&column);
        let along = normal + row * degrees.to_radians().tan();
        let position = |n: usize| Point::new(-250.0, -121.5, 7.25) + along * (step_mm * n as f64);
        ((0..count).map(position).collect(), normal)
    }

    fn rounded(positions: &[Point]) -> Vec<Point> {
        positions.iter().map(|p| p.map(|c| (c * 10.0).round() / 10.0)).collect()
    }

    #[test]
    fn a_small_shear_of_many_thin_slices_is_a_tilt() {
        let (positions, normal) = sheared(400, 0.6, 1.2);
        let lean = Lean::of(&positions, &normal);
        assert!(lean.is_tilted() && !lean.has_stray(), "{lean:?}");
        assert!((lean.degrees - 1.2).abs() < 1e-6, "{lean:?}");
        assert_eq!(lean.farthest.slice, 399);
        assert!((lean.farthest.mm - 5.015).abs() < 1e-3, "{lean:?}");
        let (positions, normal) = sheared(400, 0.6, 0.05);
        assert!(!Lean::of(&positions, &normal).is_tilted());
    }

    #[test]
    fn what_rounding_to_a_tenth_explains_is_no_tilt() {
        for (count, step_mm) in [(3, 0.5), (6, 3.0), (40, 1.25), (400, 0.6)] {
            for degrees in [0.0, 0.01, 0.03, 0.05] {
                let (positions, normal) = sheared(count, step_mm, degrees);
                let lean = Lean::of(&rounded(&positions), &normal);
                assert!(!lean.is_tilted() && !lean.has_stray(), "{count} {degrees} {lean:?}");
            }
        }
        // Only the last slice is rounded upwards.
        let last = |n: usize| Point::new(if n == 99 { 0.1 } else { 0.0 }, 0.0, n as f64);
        let lean = Lean::of(&(0..100).map(last).collect::<Vec<_>>(), &Vector::z());
        assert!(!lean.is_tilted() && !lean.has_stray(), "{lean:?}");
    }

    #[test]
    fn one_slice_aside_is_a_stray() {
        let (mut positions, normal) = sheared(100, 1.0, 0.0);
        positions[40] += Vector::new(0.8, 0.6, 0.0) * 0.3;
        let lean = Lean::of(&positions, &normal);
        assert!(lean.has_stray() && !lean.is_tilted(), "{lean:?}");
        assert_eq!(lean.strayed.slice, 40);
    }
}

//! A smooth distance from a rigid body, on whose level surfaces tissue slides.

use crate::rigid::RigidBody;
use rayon::prelude::*;
use supine_space::{Matrix, Point, Progress, Stopped, Vector};

/// Spacings of the samples over the reach of the coupled nodes from the body's centre.
const SPACINGS: usize = 16;
/// Samples beyond the reach, as a share of the body's size, so that nodes may slide on.
const BEYOND: f64 = 0.25;
/// Samples on each side that a cubic spline needs.
const RIM: usize = 2;
/// A distance has slope 1: far less is the middle of a body, where no part of the surface is the
/// nearest.
const MIN_SLOPE: f64 = 0.5;
/// Share of the radius of a sphere nearer to whose centre it is taken to have no normal.
const MIN_RADIUS: f64 = 0.01;
/// How exactly a level is met, as a share of the distance from the centre, and in how many steps.
const LEVEL_TOLERANCE: f64 = 1e-13;
const LEVEL_STEPS: usize = 30;

/// A distance at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Level {
    /// mm.
    pub(crate) value: f64,
    /// Its first derivative: along the normal of the level surface.
    pub(crate) slope: Vector,
    /// Its second derivative, 1/mm.
    pub(crate) curvature: Matrix,
}

/// A smooth distance in the frame in which the body was attached.
#[derive(Debug)]
pub(crate) enum SmoothedDistance {
    /// From the centre of a sphere; nearer than `min_mm` to it there is no normal.
    Sphere { centre: Vector, min_mm: f64 },
    /// From any body, to the accuracy of a spline.
    Sampled(Lattice),
}

impl SmoothedDistance {
    /// Of `rigid` as far as `reach` (mm) from its centre.
    ///
    /// # Errors
    /// When the user stops.
    pub(crate) fn new(
        rigid: &dyn RigidBody,
        reach: f64,
        progress: Progress<'_>,
    ) -> Result<Self, Stopped> {
        if rigid.is_sphere() {
            let min_mm = MIN_RADIUS * rigid.size_mm();
            return Ok(Self::Sphere { centre: rigid.centre().coords, min_mm });
        }
        Lattice::new(rigid, reach, progress).map(Self::Sampled)
    }

    /// The distance at a place (mm); `None` where it has no normal.
    pub(crate) fn at(&self, place: &Vector) -> Option<Level> {
        match self {
            Self::Sphere { centre, min_mm } => {
                let radius = place - centre;
                let value = radius.norm();
                if value < *min_mm {
                    return None;
                }
                let slope = radius / value;
                let curvature = (Matrix::identity() - slope * slope.transpose()) / value;
                Some(Level { value, slope, curvature })
            }
            Self::Sampled(lattice) => lattice.at(place),
        }
    }

    /// The distance at a place (mm), its normal trusted or not; `None` beyond the samples.
    pub(crate) fn read(&self, place: &Vector) -> Option<Level> {
        match self {
            Self::Sphere { .. } => self.at(place),
            Self::Sampled(lattice) => lattice.read(place),
        }
    }

    /// The place brought back to the surface of that level along its normal.
    pub(crate) fn brought(&self, place: &Vector, level: f64) -> Option<Vector> {
        let mut place = *place;
        let tolerance = LEVEL_TOLERANCE * place.norm().max(1.0);
        for _ in 0..LEVEL_STEPS {
            let here = self.at(&place)?;
            let off = here.value - level;
            if off.abs() <= tolerance {
                return Some(place);
            }
            place -= here.slope * (off / here.slope.norm_squared());
        }
        None
    }
}

/// Distances at the points of a cubic lattice, interpolated by a cubic spline: continuous to the
/// second derivative, so that edges of the surface are rounded over a spacing.
#[derive(Debug)]
pub(crate) struct Lattice {
    first: Vector,
    spacing: f64,
    /// Points along an edge of the lattice.
    count: usize,
    coefficients: Vec<f64>,
}

impl Lattice {
    fn new(rigid: &dyn RigidBody, reach: f64, progress: Progress<'_>) -> Result<Self, Stopped> {
        let spacing = reach.max(rigid.size_mm() * BEYOND) / SPACINGS as f64;
        let half = (reach + BEYOND * rigid.size_mm()) / spacing;
        let half = half.ceil() as usize + RIM;
        let count = 2 * half + 1;
        let first = rigid.centre().coords - Vector::repeat(half as f64 * spacing);
        let mut coefficients = Vec::with_capacity(count * count * count);
        for z in 0..count {
            progress.at(z as f64 / count as f64)?;
            let plane = (0..count * count).into_par_iter().map(|n| {
                let steps = [n % count, n / count, z].map(|k| k as f64 * spacing);
                rigid.distance(&Point::from(first + Vector::from(steps)))
            });
            coefficients.par_extend(plane);
        }
        for stride in [1, count, count * count] {
            for start in (0..coefficients.len()).filter(|n| n / stride % count == 0) {
                interpolate(&mut coefficients, start, stride, count);
            }
        }
        Ok(Self { first, spacing, count, coefficients })
    }

    fn at(&self, place: &Vector) -> Option<Level> {
        self.read(place).filter(|level| level.slope.norm() > MIN_SLOPE)
    }

    fn read(&self, place: &Vector) -> Option<Level> {
        let steps = (place - self.first) / self.spacing;
        let inside = |s: &f64| *s >= 1.0 && *s < (self.count - 2) as f64;
        if !steps.iter().all(inside) {
            return None;
        }
        let base = steps.map(|s| s.floor() as usize - 1);
        let [x, y, z] = [0, 1, 2].map(|k| basis(steps[k].fract()));
        let mut level = Level { value: 0.0, slope: Vector::zeros(), curvature: Matrix::zeros() };
        for k in 0..4 {
            for j in 0..4 {
                let row = ((base.z + k) * self.count + base.y + j) * self.count + base.x;
                for (i, c) in self.coefficients[row..row + 4].iter().enumerate() {
                    let term = |a: usize, b: usize, d: usize| c * x[a][i] * y[b][j] * z[d][k];
                    level.value += term(0, 0, 0);
                    level.slope += Vector::new(term(1, 0, 0), term(0, 1, 0), term(0, 0, 1));
                    let (xy, xz, yz) = (term(1, 1, 0), term(1, 0, 1), term(0, 1, 1));
                    let (xx, yy, zz) = (term(2, 0, 0), term(0, 2, 0), term(0, 0, 2));
                    level.curvature += Matrix::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                }
            }
        }
        level.slope /= self.spacing;
        level.curvature /= self.spacing * self.spacing;
        Some(level)
    }
}

/// The four cubic B-splines over a spacing and their first and second derivatives at share `t` of
/// it.
fn basis(t: f64) -> [[f64; 4]; 3] {
    let s = 1.0 - t;
    [
        [
            s * s * s / 6.0,
            (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
            t * t * t / 6.0,
        ],
        [-s * s / 2.0, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, t * t / 2.0],
        [s, 3.0 * t - 2.0, 3.0 * s - 2.0, t],
    ]
}

/// Replaces a line of samples by the coefficients of the cubic spline through them, mirrored at its
/// ends.
///
/// Source: Unser, IEEE Signal Processing Magazine 16 (6), 1999, box 2.
fn interpolate(values: &mut [f64], start: usize, stride: usize, count: usize) {
    let pole = 3f64.sqrt() - 2.0;
    let at = |k: usize| start + k * stride;
    let (mut sum, mut power) = (0.0, 1.0);
    for k in 0..count {
        sum += power * values[at(k)];
        power *= pole;
    }
    values[at(0)] = sum;
    for k in 1..count {
        values[at(k)] += pole * values[at(k - 1)];
    }
    let last = values[at(count - 1)] + pole * values[at(count - 2)];
    values[at(count - 1)] = pole / (pole * pole - 1.0) * last;
    for k in (0..count - 1).rev() {
        values[at(k)] = pole * (values[at(k + 1)] - values[at(k)]);
    }
    (0..count).for_each(|k| values[at(k)] *= 6.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid::{Shaft, SphereOnShaft};

    fn sampled() -> (SphereOnShaft, Lattice) {
        let centre = Point::new(3.0, -2.0, 1.0);
        let sphere = SphereOnShaft { centre, radius_mm: 20.0, shaft: None };
        let lattice = Lattice::new(&sphere, 22.0, Progress::none()).unwrap();
        (sphere, lattice)
    }

    #[test]
    fn the_spline_is_the_distance_where_that_is_smooth() {
        let (sphere, lattice) = sampled();
        for direction in [[1.0, 0.0, 0.0], [0.3, -0.5, 0.8], [-0.6, 0.7, -0.1]] {
            let way = Vector::from(direction).normalize();
            for radius in [12.0, 19.9, 23.0] {
                let place = sphere.centre.coords + way * radius;
                let level = lattice.at(&place).unwrap();
                let exact = SmoothedDistance::new(&sphere, 22.0, Progress::none()).unwrap();
                let exact = exact.at(&place).unwrap();
                assert!((level.value - sphere.distance(&place.into())).abs() < 5e-4);
                assert!((level.slope - exact.slope).norm() < 1e-3, "{}", level.slope);
                assert!((level.curvature - exact.curvature).norm() < 5e-3);
            }
        }
        assert!(lattice.at(&(sphere.centre.coords + Vector::x() * 60.0)).is_none());
        assert!(lattice.at(&sphere.centre.coords).is_none());
    }

    #[test]
    fn slopes_are_those_of_the_values() {
        let shaft = Shaft { direction: Vector::x(), radius_mm: 5.0, length_mm: 60.0 };
        let whole = SphereOnShaft { shaft: Some(shaft), ..sampled().0 };
        let lattice = Lattice::new(&whole, 30.0, Progress::none()).unwrap();
        let place = Vector::new(22.0, 3.5, 2.0);
        let level = lattice.at(&place).unwrap();
        let h = 1e-5;
        for axis in 0..3 {
            let [up, down] = [h, -h].map(|h| lattice.at(&(place + Vector::ith(axis, h))).unwrap());
            assert!(((up.value - down.value) / (2.0 * h) - level.slope[axis]).abs() < 1e-8);
            let change = (up.slope - down.slope) / (2.0 * h) - level.curvature.column(axis);
            assert!(change.norm() < 1e-6, "{change}");
        }
    }

    #[test]
    fn places_are_brought_to_their_level() {
        let (sphere, lattice) = sampled();
        let exact = SmoothedDistance::new(&sphere, 22.0, Progress::none()).unwrap();
        let place = sphere.centre.coords + Vector::new(9.0, 13.0, -12.0);
        let found = exact.brought(&place, 18.0).unwrap() - sphere.centre.coords;
        assert!((found - Vector::new(9.0, 13.0, -12.0).normalize() * 18.0).norm() < 1e-11);
        let found = SmoothedDistance::Sampled(lattice).brought(&place, -1.5).unwrap();
        assert!((sphere.distance(&found.into()) + 1.5).abs() < 5e-4);
        assert!(exact.brought(&sphere.centre.coords, 18.0).is_none());
    }
}

//! The gap between tissue and the smooth parts of a rigid body.

use crate::rigid::{RigidBody, SphereOnShaft};
use crate::smoothed_distance::SmoothedDistance;
use supine_space::{Matrix, Pose, Progress, Stopped, Vector};

/// Nearer than this (mm) to a centre or an axis the normal is any that is fixed: a node is never
/// kept there.
const MIDDLE_MM: f64 = 1e-9;
/// Samples of a body that is read from a surface reach so many times its size from its centre.
const SAMPLED_REACH: f64 = 1.25;

/// A gap at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap {
    /// Distance from the part, negative inside, mm.
    pub(crate) mm: f64,
    /// Unit normal away from it.
    pub(crate) normal: Vector,
}

/// A smooth part of a body.
#[derive(Debug)]
enum Part {
    Sphere {
        centre: Vector,
        radius: f64,
    },
    /// A round shaft from `start` along the unit vector `axis`; it acts beside its length alone.
    Shaft {
        start: Vector,
        axis: Vector,
        radius: f64,
        length: f64,
    },
    /// Distances at the points of a lattice.
    Sampled {
        distance: SmoothedDistance,
        centre: Vector,
    },
}

/// The surface of a rigid body, in the frame in which it was put in.
#[derive(Debug)]
pub(crate) struct Surface {
    parts: Vec<Part>,
    /// The smallest radius, mm: a motion by much less does not jump over a node.
    pub(crate) finest_mm: f64,
    /// How far from the centre of the body it reaches, mm.
    pub(crate) reach_mm: f64,
}

impl Surface {
    /// The parts of `rigid`.
    ///
    /// # Errors
    /// When the user stops.
    pub(crate) fn new(rigid: &dyn RigidBody, progress: Progress<'_>) -> Result<Self, Stopped> {
        let centre = rigid.centre().coords;
        let Some(SphereOnShaft { radius_mm, shaft, .. }) = rigid.sphere_on_shaft() else {
            let size = rigid.size_mm();
            let distance = SmoothedDistance::new(rigid, size, progress)?;
            let parts = vec![Part::Sampled { distance, centre }];
            return Ok(Self { parts, finest_mm: 0.25 * size, reach_mm: SAMPLED_REACH * size });
        };
        let mut parts = vec![Part::Sphere { centre, radius: radius_mm }];
        let (mut finest_mm, mut reach_mm) = (radius_mm, radius_mm);
        if let Some(shaft) = shaft
            && let Some(axis) = shaft.direction.try_normalize(0.0)
        {
            let (radius, length) = (shaft.radius_mm, shaft.length_mm);
            parts.push(Part::Shaft { start: centre, axis, radius, length });
            finest_mm = finest_mm.min(radius);
            reach_mm = reach_mm.max(length);
        }
        Ok(Self { parts, finest_mm, reach_mm })
    }

    /// Number of parts.
    pub(crate) fn parts(&self) -> usize {
        self.parts.len()
    }

    /// The gap between a place (LPS, mm) and a part with the body at `pose`; `None` where the part
    /// does not act.
    pub(crate) fn gap(&self, part: usize, pose: &Pose, place: &Vector) -> Option<Gap> {
        let own = pose.inverse_transform_point(&(*place).into()).coords;
        let gap = self.parts.get(part)?.gap(&own)?;
        Some(Gap { normal: pose.rotation * gap.normal, ..gap })
    }

    /// How the normal of a part turns along its surface at a place: tangents t (1/√mm) with ∇n = Σ
    /// t tᵀ. Where the surface is hollow they are zero.
    pub(crate) fn bends(&self, part: usize, pose: &Pose, place: &Vector) -> [Vector; 2] {
        let own = pose.inverse_transform_point(&(*place).into()).coords;
        let bends = self.parts.get(part).map_or([Vector::zeros(); 2], |part| part.bends(&own));
        bends.map(|bend| pose.rotation * bend)
    }

    /// The smallest gap of a place, mm; infinite where no part acts.
    pub(crate) fn least(&self, pose: &Pose, place: &Vector) -> f64 {
        let gaps = (0..self.parts()).filter_map(|part| self.gap(part, pose, place));
        gaps.map(|gap| gap.mm).fold(f64::INFINITY, f64::min)
    }
}

impl Part {
    /// In the frame of the body.
    fn gap(&self, place: &Vector) -> Option<Gap> {
        match self {
            Self::Sphere { centre, radius } => {
                let from = place - centre;
                let normal = from.try_normalize(MIDDLE_MM).unwrap_or_else(Vector::z);
                Some(Gap { mm: from.norm() - radius, normal })
            }
            Self::Shaft { start, axis, radius, length } => {
                let from = place - start;
                let along = from.dot(axis);
                if !(0.0..=*length).contains(&along) {
                    return None;
                }
                let beside = from - axis * along;
                let normal = beside.try_normalize(MIDDLE_MM).unwrap_or_else(|| across(axis));
                Some(Gap { mm: beside.norm() - radius, normal })
            }
            Self::Sampled { distance, centre } => {
                let level = distance.read(place)?;
                let steep = level.slope.norm();
                if steep > MIDDLE_MM && distance.at(place).is_some() {
                    return Some(Gap { mm: level.value / steep, normal: level.slope / steep });
                }
                // Deep inside: out from the centre, whatever part of the surface is the nearest.
                let out = (place - centre).try_normalize(MIDDLE_MM).unwrap_or_else(Vector::z);
                Some(Gap { mm: level.value, normal: out })
            }
        }
    }
}

impl Part {
    /// In the frame of the body.
    fn bends(&self, place: &Vector) -> [Vector; 2] {
        let none = [Vector::zeros(); 2];
        let Some(Gap { mm, normal }) = self.gap(place) else { return none };
        match self {
            Self::Sphere { radius, .. } => {
                let tangent = across(&normal);
                let bend = 1.0 / (mm + radius).max(MIDDLE_MM).sqrt();
                [tangent * bend, normal.cross(&tangent) * bend]
            }
            Self::Shaft { axis, radius, .. } => {
                let bend = 1.0 / (mm + radius).max(MIDDLE_MM).sqrt();
                [axis.cross(&normal) * bend, Vector::zeros()]
            }
            Self::Sampled { distance, .. } => {
                let Some(level) = distance.at(place) else { return none };
                let flat = Matrix::identity() - normal * normal.transpose();
                let curvature = flat * level.curvature * flat / level.slope.norm();
                let own = curvature.symmetric_eigen();
                let flattest = own.eigenvalues.iamin();
                let bend =
                    |k: usize| own.eigenvectors.column(k) * own.eigenvalues[k].max(0.0).sqrt();
                [bend((flattest + 1) % 3), bend((flattest + 2) % 3)]
            }
        }
    }
}

/// A unit vector across another.
fn across(axis: &Vector) -> Vector {
    let other = Vector::ith(axis.iamin(), 1.0);
    axis.cross(&other).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rigid::Shaft;
    use nalgebra::UnitQuaternion;
    use supine_mesh::{SurfaceDistance, TriSurface};
    use supine_space::Point;

    fn whole() -> SphereOnShaft {
        let shaft = Shaft { direction: Vector::z() * 2.0, radius_mm: 6.0, length_mm: 80.0 };
        SphereOnShaft { centre: Point::new(5.0, 0.0, -3.0), radius_mm: 20.0, shaft: Some(shaft) }
    }

    #[test]
    fn the_least_gap_is_the_distance_beside_the_shaft_and_around_the_sphere() {
        let rigid = whole();
        let surface = Surface::new(&rigid, Progress::none()).unwrap();
        assert_eq!((surface.parts(), surface.finest_mm, surface.reach_mm), (2, 6.0, 80.0));
        for from in [[25.0, 0.0, 3.0], [3.0, 4.0, 50.0], [0.0, 7.0, 30.0], [1.0, 2.0, -30.0]] {
            let place = rigid.centre.coords + Vector::from(from);
            let gap = surface.least(&Pose::identity(), &place);
            assert!((gap - rigid.distance(&place.into())).abs() < 1e-12, "{from:?} {gap}");
        }
        // Beyond its end the shaft does not act.
        let beyond = rigid.centre.coords + Vector::z() * 81.0;
        assert!(surface.gap(1, &Pose::identity(), &beyond).is_none());
    }

    #[test]
    fn normals_are_slopes_at_any_pose() {
        let rigid = whole();
        let turn = UnitQuaternion::from_scaled_axis(Vector::new(0.4, -0.3, 0.8));
        let pose = Pose::translation(3.0, 9.0, -4.0) * Pose::rotation_wrt_point(turn, rigid.centre);
        let surface = Surface::new(&rigid, Progress::none()).unwrap();
        for (part, from) in [(0, [14.0, 11.0, 4.0]), (1, [3.0, 5.0, 40.0])] {
            let place = (pose * (rigid.centre + Vector::from(from))).coords;
            let gap = surface.gap(part, &pose, &place).unwrap();
            let h = 1e-5;
            for axis in 0..3 {
                let at =
                    |t: f64| surface.gap(part, &pose, &(place + Vector::ith(axis, t))).unwrap();
                let slope = (at(h).mm - at(-h).mm) / (2.0 * h);
                assert!((slope - gap.normal[axis]).abs() < 1e-8, "{part} {axis}");
                let turn = (at(h).normal - at(-h).normal) / (2.0 * h);
                let bends = surface.bends(part, &pose, &place);
                let by_bends: Vector = bends.iter().map(|t| t * t[axis]).sum();
                assert!((turn - by_bends).norm() < 1e-8, "{part} {axis}");
            }
        }
    }

    #[test]
    fn the_middle_has_a_normal_too() {
        let surface = Surface::new(&whole(), Progress::none()).unwrap();
        let centre = whole().centre.coords;
        for part in 0..2 {
            let gap = surface.gap(part, &Pose::identity(), &centre).unwrap();
            assert!((gap.normal.norm() - 1.0).abs() < 1e-12 && gap.mm < -5.9);
        }
    }

    #[test]
    fn a_surface_is_one_part() {
        let (unit, triangles) = crate::test_mesh::icosphere(3);
        let points = unit.iter().map(|p| Point::from(p * 15.0)).collect();
        let body = SurfaceDistance::new(TriSurface::new(points, triangles).unwrap());
        let surface = Surface::new(&body, Progress::none()).unwrap();
        assert_eq!(surface.parts(), 1);
        let gap = |x: f64| surface.gap(0, &Pose::identity(), &Vector::new(x, 0.2, 0.1)).unwrap();
        assert!((gap(16.0).mm - 1.0).abs() < 0.2 && (gap(13.0).mm + 2.0).abs() < 0.2);
        assert!(gap(16.0).normal.x > 0.99 && gap(0.0).mm < -10.0);
        assert!(surface.gap(0, &Pose::identity(), &Vector::new(90.0, 0.0, 0.0)).is_none());
    }
}

//! Rigid bodies that hold tissue.

use supine_mesh::SurfaceDistance;
use supine_space::{Point, Vector};

/// A rigid body, by the distance from its surface.
pub trait RigidBody: Sync {
    /// Distance (mm) of a place (LPS, mm) from the surface, negative inside.
    fn distance(&self, place: &Point) -> f64;

    /// A point of the body about which it turns: forces have their moments about it. LPS, mm.
    fn centre(&self) -> Point;

    /// Its size, mm: a turn by 1/size moves its surface about as far as a shift by 1 mm.
    fn size_mm(&self) -> f64;

    /// Whether it is a sphere about its centre: tissue then slides on exactly that
    /// ([`crate::Contact::Frictionless`]), else on a spline through distances.
    fn is_sphere(&self) -> bool {
        false
    }

    /// The body as a sphere on a shaft, if it is one: tissue that lifts off
    /// ([`crate::Contact::Unilateral`]) then meets exactly these two surfaces, else that of a
    /// spline through distances.
    fn sphere_on_shaft(&self) -> Option<SphereOnShaft> {
        None
    }
}

/// A spherical applicator, with the shaft that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphereOnShaft {
    /// Centre of the sphere, LPS, mm.
    pub centre: Point,
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// The shaft, if it holds tissue.
    pub shaft: Option<Shaft>,
}

/// A straight round shaft from the centre of a sphere outwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Direction away from the sphere; any length.
    pub direction: Vector,
    /// Radius, mm.
    pub radius_mm: f64,
    /// Length from the centre of the sphere, mm.
    pub length_mm: f64,
}

impl RigidBody for SphereOnShaft {
    fn distance(&self, place: &Point) -> f64 {
        let from_centre = place - self.centre;
        let sphere = from_centre.norm() - self.radius_mm;
        self.shaft.map_or(sphere, |shaft| sphere.min(shaft.distance(&from_centre)))
    }

    fn centre(&self) -> Point {
        self.centre
    }

    fn size_mm(&self) -> f64 {
        self.radius_mm
    }

    fn is_sphere(&self) -> bool {
        self.shaft.is_none()
    }

    fn sphere_on_shaft(&self) -> Option<SphereOnShaft> {
        Some(*self)
    }
}

/// Any closed surface, as read from a file; it turns about the middle of its box.
impl RigidBody for SurfaceDistance {
    fn distance(&self, place: &Point) -> f64 {
        self.at(place)
    }

    fn centre(&self) -> Point {
        let (low, high) = self.surface().bounds();
        low + (high - low) / 2.0
    }

    fn size_mm(&self) -> f64 {
        let (low, high) = self.surface().bounds();
        (high - low).norm() / 2.0
    }
}

impl Shaft {
    /// Distance from the surface of a cylinder that begins at the origin.
    fn distance(&self, place: &Vector) -> f64 {
        let Some(axis) = self.direction.try_normalize(0.0) else { return f64::INFINITY };
        let along = place.dot(&axis);
        let beside = (place - axis * along).norm() - self.radius_mm;
        let beyond = (-along).max(along - self.length_mm);
        let outside = beside.max(0.0).hypot(beyond.max(0.0));
        outside + beside.max(beyond).min(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_a_sphere_on_a_shaft() {
        let shaft = Shaft { direction: Vector::z() * 3.0, radius_mm: 5.0, length_mm: 100.0 };
        let bare =
            SphereOnShaft { centre: Point::new(1.0, 0.0, 0.0), radius_mm: 20.0, shaft: None };
        let whole = SphereOnShaft { shaft: Some(shaft), ..bare };
        let at = |x: f64, z: f64| Point::new(1.0 + x, 0.0, z);
        assert_eq!(bare.distance(&at(0.0, 0.0)), -20.0);
        assert_eq!(bare.distance(&at(0.0, 50.0)), 30.0);
        assert_eq!(whole.distance(&at(0.0, 50.0)), -5.0);
        assert_eq!(whole.distance(&at(8.0, 50.0)), 3.0);
        assert_eq!(whole.distance(&at(8.0, 104.0)), 5.0);
        assert_eq!(whole.distance(&at(0.0, -30.0)), 10.0);
    }
}

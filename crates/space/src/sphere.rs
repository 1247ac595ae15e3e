//! The sphere that bounds the region of interest.

use crate::{Point, Vector};

/// A ball in patient space, LPS, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    centre: Point,
    radius: f64,
}

/// Why a sphere cannot be.
#[derive(Debug, thiserror::Error)]
#[error(
    "a sphere needs a finite centre and a radius above 0 mm, got radius {radius} at {centre:?}"
)]
pub struct SphereError {
    centre: [f64; 3],
    radius: f64,
}

impl Sphere {
    /// A sphere from its centre (LPS, mm) and radius (mm).
    ///
    /// # Errors
    /// When a number is not finite or the radius is not above 0.
    pub fn new(centre: Point, radius: f64) -> Result<Self, SphereError> {
        if radius > 0.0 && radius.is_finite() && centre.iter().all(|c| c.is_finite()) {
            Ok(Self { centre, radius })
        } else {
            Err(SphereError { centre: centre.coords.into(), radius })
        }
    }

    /// Centre, LPS, mm.
    pub fn centre(&self) -> Point {
        self.centre
    }

    /// Radius, mm.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Signed distance to the sphere's surface, mm: negative inside.
    pub fn signed_distance(&self, p: &Point) -> f64 {
        (p - self.centre).norm() - self.radius
    }

    /// Whether the point lies inside or on the sphere.
    pub fn contains(&self, p: &Point) -> bool {
        self.signed_distance(p) <= 0.0
    }

    /// Lower and upper corner of the axis-aligned box, LPS, mm.
    pub fn bounds(&self) -> (Point, Point) {
        let r = Vector::repeat(self.radius);
        (self.centre - r, self.centre + r)
    }
}

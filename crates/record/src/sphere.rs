//! A sphere as it is written.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use supine_space::{Point, Sphere, SphereError};

/// A sphere.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct SphereRecord {
    /// Centre, LPS, mm.
    pub centre_mm: [f64; 3],
    /// Radius, mm.
    pub radius_mm: f64,
}

impl From<Sphere> for SphereRecord {
    fn from(sphere: Sphere) -> Self {
        Self { centre_mm: sphere.centre().coords.into(), radius_mm: sphere.radius() }
    }
}

impl SphereRecord {
    /// The sphere.
    ///
    /// # Errors
    /// When a number is not finite or the radius is not above 0.
    pub fn sphere(self) -> Result<Sphere, SphereError> {
        Sphere::new(Point::from(self.centre_mm), self.radius_mm)
    }
}

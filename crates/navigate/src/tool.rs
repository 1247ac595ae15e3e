//! The applicator as it is tracked.

use supine_fem::{Shaft, SphereOnShaft};
use supine_space::{Point, Pose, Vector};

/// A sphere on a shaft. In its own frame the centre of the sphere is the origin, the shaft runs
/// along -z, and +z points out of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Radius of the shaft, mm.
    pub shaft_radius_mm: f64,
    /// Length of the shaft from the centre of the sphere, mm.
    pub shaft_mm: f64,
}

impl Tool {
    /// The applicator at a pose: from its own frame to the patient's, LPS, mm.
    pub fn at(&self, pose: &Pose) -> SphereOnShaft {
        let shaft = Shaft {
            direction: pose.rotation * -Vector::z(),
            radius_mm: self.shaft_radius_mm,
            length_mm: self.shaft_mm,
        };
        let centre = pose.transform_point(&Point::origin());
        SphereOnShaft { centre, radius_mm: self.radius_mm, shaft: Some(shaft) }
    }

    /// Distance of a place (LPS, mm) from the axis of the applicator at a pose, mm.
    pub fn from_axis_mm(pose: &Pose, place: &Point) -> f64 {
        let own = pose.inverse_transform_point(place);
        own.x.hypot(own.y)
    }
}

/// The turn that lets the shaft come from a direction (LPS, any length): about the shaft the
/// applicator is round, so any turn about it will do. None for no direction.
pub fn facing(outwards: &Vector) -> Option<nalgebra::UnitQuaternion<f64>> {
    let tip = -outwards.try_normalize(1e-9)?;
    nalgebra::UnitQuaternion::rotation_between(&Vector::z(), &tip).or_else(|| {
        Some(nalgebra::UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::PI))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_fem::RigidBody;

    const TOOL: Tool = Tool { radius_mm: 20.0, shaft_radius_mm: 6.0, shaft_mm: 150.0 };

    #[test]
    fn the_shaft_runs_where_it_comes_from() {
        for outwards in [Vector::new(0.36, -0.8, 0.48), Vector::z(), -Vector::z() * 3.0] {
            let rotation = facing(&outwards).unwrap();
            let centre = Point::new(3.0, -4.0, 5.0);
            let pose = Pose::from_parts(centre.into(), rotation);
            let body = TOOL.at(&pose);
            let along = outwards.normalize();
            assert!((body.distance(&(centre + along * 100.0)) + 6.0).abs() < 1e-9);
            assert!((body.distance(&(centre - along * 100.0)) - 80.0).abs() < 1e-9);
            assert!(Tool::from_axis_mm(&pose, &(centre + along * 42.0)) < 1e-9);
        }
        assert!(facing(&Vector::zeros()).is_none());
    }
}

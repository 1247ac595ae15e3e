//! Direction of gravity in the patient's frame.

use crate::Vector;

/// Standard gravity used throughout, m/s².
pub const GRAVITY_M_S2: f64 = 9.81;

/// Gravity of a patient on her back: towards the back. Unit vector, LPS.
pub fn supine() -> Vector {
    Vector::new(0.0, 1.0, 0.0)
}

/// Gravity of a patient who sits upright: towards the feet. Unit vector, LPS.
pub fn sitting() -> Vector {
    Vector::new(0.0, 0.0, -1.0)
}

/// The tilt of the operating table, degrees.
///
/// Positive AP raises the head, positive LAT lowers the patient's left side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablePose {
    /// Head-up angle, degrees.
    pub ap_deg: f64,
    /// Left-side-down angle, degrees.
    pub lat_deg: f64,
}

impl TablePose {
    /// Gravity in the patient's frame on the tilted table; unit vector, LPS.
    ///
    /// (sin LAT cos AP, cos LAT cos AP, -sin AP). The table turns, the patient's frame does not.
    pub fn gravity(self) -> Vector {
        let (ap, lat) = (self.ap_deg.to_radians(), self.lat_deg.to_radians());
        Vector::new(lat.sin() * ap.cos(), lat.cos() * ap.cos(), -ap.sin())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn level_table_is_supine_and_upright_table_is_sitting() {
        assert!((TablePose { ap_deg: 0.0, lat_deg: 0.0 }.gravity() - supine()).norm() < 1e-15);
        assert!((TablePose { ap_deg: 90.0, lat_deg: 0.0 }.gravity() - sitting()).norm() < 1e-15);
    }

    #[test]
    fn positive_lat_pulls_to_the_left() {
        let g = TablePose { ap_deg: 7.0, lat_deg: 5.0 }.gravity();
        assert!((g - Vector::new(0.086506, 0.988769, -0.121869)).norm() < 1e-6, "{g}");
        assert!((g.norm() - 1.0).abs() < 1e-15);
    }
}

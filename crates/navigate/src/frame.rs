//! The frame in which a peer speaks.

use supine_space::{Point, Pose, Vector};

/// How coordinates of the patient go over the wire; messages do not say it, peers do not convert.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Frame {
    /// DICOM's: x to the patient's left, y posterior, z superior.
    #[default]
    Lps,
    /// That of 3D Slicer: x to the patient's right, y anterior, z superior.
    Ras,
}

impl Frame {
    /// The name as it stands in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lps => "LPS",
            Self::Ras => "RAS",
        }
    }

    /// From LPS to this frame, and back: a half turn about z. The frame of a tool is its own and is
    /// not turned.
    pub fn turn(self) -> Pose {
        match self {
            Self::Lps => Pose::identity(),
            Self::Ras => Pose::rotation(Vector::z() * std::f64::consts::PI),
        }
    }

    /// A vector in LPS as it goes over the wire: exact, where [`Frame::turn`] rounds.
    pub fn out(self, vector: &Vector) -> [f32; 3] {
        let [x, y, z]: [f64; 3] = (*vector).into();
        match self {
            Self::Lps => [x as f32, y as f32, z as f32],
            Self::Ras => [-x as f32, -y as f32, z as f32],
        }
    }

    /// A place in LPS as it goes over the wire.
    pub fn place(self, place: &Point) -> [f32; 3] {
        self.out(&place.coords)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn left_is_minus_right() {
        let place = Point::new(1.0, 2.0, 3.0);
        assert_eq!(Frame::Ras.place(&place), [-1.0, -2.0, 3.0]);
        assert_eq!(Frame::Lps.place(&place), [1.0, 2.0, 3.0]);
        let turned = Frame::Ras.turn() * place;
        assert!((turned - Point::new(-1.0, -2.0, 3.0)).norm() < 1e-12);
        assert!((Frame::Ras.turn() * turned - place).norm() < 1e-12);
    }
}

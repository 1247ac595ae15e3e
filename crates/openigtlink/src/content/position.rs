//! POSITION: f32 x, y, z; then nothing, three numbers of a quaternion, or all four.

use crate::error::Refusal;
use crate::reader::{Reader, put_f32s};

/// A place, perhaps with a rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Place, mm.
    pub position: [f32; 3],
    /// Rotation, as the message has it.
    pub rotation: Rotation,
}

/// The rotation of a POSITION, in the form in which it is sent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rotation {
    /// None: 12 bytes.
    None,
    /// x, y and z of a unit quaternion: 24 bytes.
    Vector([f32; 3]),
    /// Quaternion x, y, z, w, the scalar last; trackers round it, so that it is not quite of length
    /// 1: 28 bytes.
    Quaternion([f32; 4]),
}

impl Rotation {
    /// The quaternion x, y, z, w. Where w was not sent it is sqrt(1 - x^2 - y^2 - z^2), not below
    /// 0; of a vector longer than 1 the quaternion is not of length 1.
    pub fn quaternion(&self) -> Option<[f32; 4]> {
        match *self {
            Self::None => None,
            Self::Vector([x, y, z]) => {
                let square = [x, y, z].iter().map(|v| f64::from(*v) * f64::from(*v)).sum::<f64>();
                Some([x, y, z, (1.0 - square).max(0.0).sqrt() as f32])
            }
            Self::Quaternion(quaternion) => Some(quaternion),
        }
    }
}

impl Position {
    /// Reads a POSITION: 12, 24 or 28 bytes.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let mut reader = Reader::new(
            bytes,
            "a POSITION has 12, 24 or 28 bytes: f32 x y z, then 0, 3 or 4 of a quaternion x y z w",
        );
        let position = reader.f32s()?;
        let rotation = match reader.left() {
            0 => Rotation::None,
            12 => Rotation::Vector(reader.f32s()?),
            16 => Rotation::Quaternion(reader.f32s()?),
            _ => return reader.refuse(),
        };
        Ok(Self { position, rotation })
    }

    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        put_f32s(out, &self.position);
        match &self.rotation {
            Rotation::None => {}
            Rotation::Vector(vector) => put_f32s(out, vector),
            Rotation::Quaternion(quaternion) => put_f32s(out, quaternion),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_scalar_is_that_of_the_unit_quaternion() {
        let [x, y, z, w] = Rotation::Vector([0.1, 0.2, 0.3]).quaternion().expect("a rotation");
        assert_eq!([x, y, z], [0.1, 0.2, 0.3]);
        assert!((w - 0.927_361_8).abs() < 1e-7, "{w}");
        assert_eq!(Rotation::Vector([1.0; 3]).quaternion(), Some([1.0, 1.0, 1.0, 0.0]));
        assert_eq!(Rotation::None.quaternion(), None);
    }
}

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

/// How a patient lies or sits while she is imaged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Posture {
    /// On her back.
    #[default]
    Supine,
    /// On her front.
    Prone,
    /// On her left side.
    LeftSide,
    /// On her right side.
    RightSide,
    /// Upright, sitting or standing.
    Upright,
}

impl Posture {
    /// All, in the order of [`Posture::NAMES`].
    pub const ALL: [Self; 5] =
        [Self::Supine, Self::Prone, Self::LeftSide, Self::RightSide, Self::Upright];
    /// Their names in case files.
    pub const NAMES: [&'static str; 5] = ["supine", "prone", "left_side", "right_side", "upright"];

    /// Its name in case files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Supine => "supine",
            Self::Prone => "prone",
            Self::LeftSide => "left_side",
            Self::RightSide => "right_side",
            Self::Upright => "upright",
        }
    }

    /// The one of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|posture| posture.name() == name)
    }

    /// In words, as in "the patient lay on her back".
    pub fn told(self) -> &'static str {
        match self {
            Self::Supine => "lay on her back",
            Self::Prone => "lay prone",
            Self::LeftSide => "lay on her left side",
            Self::RightSide => "lay on her right side",
            Self::Upright => "sat or stood upright",
        }
    }

    /// The one that a DICOM Patient Position (PS3.3 C.7.3.1.1.2) tells; none of a text that is not
    /// one of a patient who lies.
    pub fn of_patient_position(text: &str) -> Option<Self> {
        let (first, how) = (text.get(..2)?, text.get(2..)?);
        let how = match how {
            "S" => Self::Supine,
            "P" => Self::Prone,
            "DL" => Self::LeftSide,
            "DR" => Self::RightSide,
            _ => return None,
        };
        ["HF", "FF"].contains(&first).then_some(how)
    }

    /// Direction of gravity: unit vector, LPS.
    pub fn gravity(self) -> Vector {
        match self {
            Self::Supine => supine(),
            Self::Prone => -supine(),
            Self::LeftSide => Vector::x(),
            Self::RightSide => -Vector::x(),
            Self::Upright => sitting(),
        }
    }
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
    fn postures_have_names_and_positions() {
        assert_eq!(Posture::ALL.map(Posture::name), Posture::NAMES);
        assert_eq!(Posture::NAMES.map(Posture::named), Posture::ALL.map(Some));
        let of = Posture::of_patient_position;
        assert_eq!([of("HFP"), of("FFS")], [Some(Posture::Prone), Some(Posture::Supine)]);
        assert_eq!([of("HFDR"), of("FFDL")], [Some(Posture::RightSide), Some(Posture::LeftSide)]);
        for position in ["", "H", "HFSU", "é", "SITTING", "XFP"] {
            assert_eq!(of(position), None, "{position}");
        }
        // On a table that is turned all the way round she lies prone.
        let turned = TablePose { ap_deg: 0.0, lat_deg: 180.0 }.gravity();
        assert!((turned - Posture::Prone.gravity()).norm() < 1e-15);
    }

    #[test]
    fn positive_lat_pulls_to_the_left() {
        let g = TablePose { ap_deg: 7.0, lat_deg: 5.0 }.gravity();
        assert!((g - Vector::new(0.086506, 0.988769, -0.121869)).norm() < 1e-6, "{g}");
        assert!((g.norm() - 1.0).abs() < 1e-15);
    }
}

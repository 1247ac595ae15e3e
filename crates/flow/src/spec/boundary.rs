//! What acts on the boundary of the tissue: a chest wall on which it slides, and skin.

use super::case::PostureSpec;
use super::error::{CaseError, value};
use super::given::Given;
use super::value::Value;
use supine_fem::{Membrane, SlidingArea};

/// Shear stiffness of the layer on which the breast slides, kPa/mm, when nothing else is said.
/// Assumed: a tenth of the shear modulus of the tissue, 0.02 to 0.03 kPa, in a layer of 1 to 1.5
/// mm; nobody measured it.
const SHEAR_KPA_MM: f64 = 0.02;
/// Radius of the area, mm: that of the foot of a breast.
const RADIUS_MM: f64 = 60.0;
/// Width of the rim as a share of the radius.
const RIM: f64 = 1.0 / 3.0;
/// Thickness of the skin, mm: 1.45 ± 0.30 in breast CTs (Huang et al., Med. Phys. 35, 2008), 1.55 ±
/// 0.25 by ultrasound (Sutradhar and Miller, Skin Res. Technol. 19, 2013).
const THICKNESS_MM: f64 = 1.5;

/// Where the tissue slides on the chest wall.
///
/// # Errors
/// [`CaseError::Value`] when something is said of an area that is held.
pub(super) fn sliding(given: Given<'_>) -> Result<Option<SlidingArea>, CaseError> {
    if given.word("wall.hold") != "sliding" {
        let keys = ["wall.shear", "wall.radius", "wall.centre"];
        let alone = keys.into_iter().find(|key| given.get(key).is_some());
        return match alone {
            Some(key) => Err(value(key, "only with hold = \"sliding\"")),
            None => Ok(None),
        };
    }
    let radius_mm = given.number("wall.radius").unwrap_or(RADIUS_MM);
    let centre_mm = match given.get("wall.centre") {
        Some(Value::Point(at)) => Some(*at),
        _ => None,
    };
    Ok(Some(SlidingArea {
        centre_mm,
        radius_mm,
        rim_mm: RIM * radius_mm,
        stiffness_kpa_mm: given.number("wall.shear").unwrap_or(SHEAR_KPA_MM),
    }))
}

/// The skin as a membrane.
///
/// # Errors
/// [`CaseError::Value`] when something is said of one that is not there.
pub(super) fn skin(given: Given<'_>) -> Result<Option<Membrane>, CaseError> {
    let (thickness, stretch) = (given.number("skin.thickness"), given.number("skin.stretch"));
    let Some(young_kpa) = given.number("skin.young") else {
        let alone = [("skin.thickness", thickness), ("skin.stretch", stretch)];
        return match alone.into_iter().find(|(_, given)| given.is_some()) {
            Some((key, _)) => Err(value(key, "only with the modulus of the skin, `skin.young`")),
            None => Ok(None),
        };
    };
    Ok(Some(Membrane {
        thickness_mm: thickness.unwrap_or(THICKNESS_MM),
        young_kpa,
        stretch: stretch.unwrap_or(1.0),
    }))
}

/// Arms and breath. Where nobody says how the arms lie, they lie otherwise as likely as not.
pub(super) fn posture(given: Given<'_>) -> PostureSpec {
    let arms_moved = match given.word("posture.arms") {
        "as in the CT" => 0.0,
        "moved" => 1.0,
        _ => 0.5,
    };
    let breathing_mm = given.number("posture.breathing").unwrap_or(PostureSpec::BREATHING_MM);
    PostureSpec { arms_moved, breathing_mm }
}

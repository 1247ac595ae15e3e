//! Values of the canonical form that rest on other values: rows of the table name these functions.

use super::case::{Case, Refinement};
use serde_json::Value as Json;

pub(super) fn tumour_edge(case: &Case) -> Json {
    match case.mesh.refine {
        Refinement::Tumour { edge_mm, .. } => edge_mm.into(),
        Refinement::Nowhere | Refinement::Goal => Json::Null,
    }
}

pub(super) fn tumour_growth(case: &Case) -> Json {
    match case.mesh.refine {
        Refinement::Tumour { growth, .. } => growth.into(),
        Refinement::Nowhere | Refinement::Goal => Json::Null,
    }
}

/// One modulus for all tissues, unless each has its own or it is fitted.
pub(super) fn young(case: &Case) -> Json {
    let alone = modulus::<0>(case).is_null() && case.fit_scans().is_none();
    alone.then_some(case.tissue.young_kpa).into()
}

/// The modulus of the tissue `N` of fat, gland, skin and tumour. Proportions that nobody gave are
/// those of the method: what was asked is their mean alone.
pub(super) fn modulus<const N: usize>(case: &Case) -> Json {
    case.stiffness.filter(|stiffness| stiffness.given).map(|stiffness| stiffness.kpa[N]).into()
}

/// How much the law stiffens, where it does.
pub(super) fn stiffening(case: &Case) -> Json {
    Some(case.tissue.stiffening).filter(|_| !case.tissue.law.is_default()).into()
}

/// How fast fibres stiffen, where there are any.
pub(super) fn fibre_stiffening(case: &Case) -> Json {
    Some(case.tissue.fibre_stiffening).filter(|_| case.tissue.fibres > 0.0).into()
}

/// Shear stiffness of the layer on which the tissue slides, where it does.
pub(super) fn wall_shear(case: &Case) -> Json {
    case.sliding.map(|area| area.stiffness_kpa_mm).into()
}

/// Radius of that part of the wall.
pub(super) fn wall_radius(case: &Case) -> Json {
    case.sliding.map(|area| area.radius_mm).into()
}

/// Thickness of the skin, where it is a membrane.
pub(super) fn skin_thickness(case: &Case) -> Json {
    case.skin.map(|skin| skin.thickness_mm).into()
}

/// How far it is stretched in advance.
pub(super) fn skin_stretch(case: &Case) -> Json {
    case.skin.map(|skin| skin.stretch).into()
}

/// The rest state, unless both are fitted.
pub(super) fn rest(case: &Case) -> Json {
    let both = case.fit_scans().is_some_and(|scans| scans.states.len() > 1);
    (!both).then(|| case.rest.name()).into()
}

/// How far off the tumour's place may be, unless that was asked as dose alone.
pub(super) fn tolerance(case: &Case) -> Json {
    case.tolerance.place_mm.into()
}

/// Where the dose is asked for.
pub(super) fn dose_at(case: &Case) -> Json {
    case.tolerance.dose.map(|dose| dose.at_mm).into()
}

/// How far the sitting patient leaned back, where there is a scan of her.
pub(super) fn lean(case: &Case) -> Json {
    case.fit_scans().map(|scans| scans.lean_deg).into()
}

/// The unit of scans, where there are any.
pub(super) fn scan_unit(case: &Case) -> Json {
    case.scans.as_ref().map(|scans| scans.unit.unwrap_or("auto")).into()
}

/// A map of moduli needs the finer labels.
pub(super) fn tissues(case: &Case) -> Json {
    case.tissues.into()
}

pub(super) fn registration(case: &Case) -> Json {
    case.export.registration.into()
}

pub(super) fn clock(case: &Case) -> Json {
    case.export.clock.as_ref().map(ToString::to_string).into()
}

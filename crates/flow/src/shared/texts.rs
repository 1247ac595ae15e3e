//! The fixed texts that say what a product is.

use crate::spec::{Case, CaseError, Stiffness};
use supine_fem::{Cut, RestState};

/// Said by every slice of an export.
pub(crate) const IMAGE_COMMENTS: &str = "SIMULATED DEFORMATION - not acquired anatomy";

/// What the exported series is called (at most 64 characters, DICOM LO).
pub(crate) fn series_description(case: &Case) -> Result<String, CaseError> {
    let (frame, bed) =
        (if case.export.policy.same_frame { " SAME-FRAME" } else { "" }, case.bed()?);
    Ok(format!("DEFORMED{frame} table AP {} LAT {}", bed.ap_deg, bed.lat_deg))
}

/// Name of a rest state in files and reports.
pub(crate) fn rest_name(rest: RestState) -> &'static str {
    match rest {
        RestState::Net => "net",
        RestState::Unloaded => "unloaded",
    }
}

/// Name of what holds the cut.
pub(crate) fn cut_name(cut: Cut) -> &'static str {
    match cut {
        Cut::Free => "free",
        Cut::Fixed => "fixed",
        Cut::Spring => "spring",
    }
}

/// How the volume was made (at most 1024 characters, DICOM ST).
pub(crate) fn derivation(case: &Case) -> Result<String, CaseError> {
    let bed = case.bed()?;
    Ok(format!(
        "DERIVED: simulated deformation by supine {}; not acquired anatomy. Breast {}, operating \
         table AP {} deg (head up), LAT {} deg (left side down). Neo-Hookean finite elements of \
         order {}, E {}, nu {}, density {} kg/m3, rest state {}, cut {}; chest wall fixed. CT \
         resampled ({}), HU carried unchanged.",
        env!("CARGO_PKG_VERSION"),
        case.breast()?,
        bed.ap_deg,
        bed.lat_deg,
        case.mesh.order.number(),
        stiffness(case),
        case.tissue.poisson,
        case.tissue.density_kg_m3,
        rest_name(case.rest),
        cut_name(case.cut),
        case.interpolation.name(),
    ))
}

/// The moduli in words.
fn stiffness(case: &Case) -> String {
    let Some(Stiffness { map, kpa: [fat, gland, skin, tumour], mean_kpa }) = case.stiffness else {
        return format!("{} kPa", case.tissue.young_kpa);
    };
    let by = format!("fat {fat}, gland {gland}, skin {skin}, tumour {tumour}");
    match mean_kpa {
        Some(mean) => format!("{mean} kPa in the mean, by {} as {by}", map.name()),
        None => format!("by {}: {by} kPa", map.name()),
    }
}

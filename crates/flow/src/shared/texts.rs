//! The fixed texts that say what a product is.

use crate::spec::{Case, CaseError, Stiffness};
use supine_fem::Law;
use supine_space::Posture;

/// Said by every slice of an export.
pub(crate) const IMAGE_COMMENTS: &str = "SIMULATED DEFORMATION - not acquired anatomy";

/// What the exported series is called, 59 characters at most: with the result's short name behind
/// it a DICOM LO. Runs of one patient on other tables or with other tissue are told apart by it in
/// the planning system's list.
pub(crate) fn series_description(case: &Case) -> Result<String, CaseError> {
    let (frame, pose) =
        (if case.export.policy.same_frame { " SAME-FRAME" } else { "" }, case.table_pose()?);
    let [ap, lat] = [pose.ap_deg, pose.lat_deg].map(|angle| short(angle, 1));
    let young = match case.stiffness {
        None => format!("E {} kPa", short(case.tissue.young_kpa, 3)),
        Some(_) => "E by tissue".into(),
    };
    Ok(format!("DEFORMED{frame} AP {ap} LAT {lat} {young} {}", case.rest.name()))
}

/// A number in at most so many decimals, none from 100 on, and its order of magnitude from 10,000
/// on.
fn short(x: f64, decimals: usize) -> String {
    if x.abs() >= 9999.5 {
        return format!("{x:.0e}");
    }
    let decimals = if x.abs() < 99.5 { decimals } else { 0 };
    let text = format!("{x:.decimals$}");
    let text = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    text.into()
}

/// How the volume was made (at most 1024 characters, DICOM ST).
pub(crate) fn derivation(case: &Case) -> Result<String, CaseError> {
    let pose = case.table_pose()?;
    Ok(format!(
        "DERIVED: simulated deformation by supine {}; not acquired anatomy. {}Breast {}, operating \
         table AP {} deg (head up), LAT {} deg (left side down). {} of \
         order {}, E {}, nu {}, density {} kg/m3, rest state {}, cut {}; {}. CT \
         resampled ({}), HU carried unchanged.",
        env!("CARGO_PKG_VERSION"),
        posture(case),
        case.breast()?,
        pose.ap_deg,
        pose.lat_deg,
        law(case),
        case.mesh.order.number(),
        stiffness(case),
        case.tissue.poisson,
        case.tissue.density_kg_m3,
        case.rest.name(),
        case.cut.name(),
        boundary(case),
        case.interpolation.name(),
    ))
}

/// How the patient lay, if not on her back.
fn posture(case: &Case) -> String {
    match case.position {
        Posture::Supine => String::new(),
        other => format!("Patient {} in the CT. ", other.told()),
    }
}

/// The law in words.
fn law(case: &Case) -> String {
    let fibres = match case.tissue.fibres {
        none if none <= 0.0 => String::new(),
        fibres => format!(" with fibres from wall to skin (E {fibres} times)"),
    };
    match case.tissue.law {
        Law::NeoHookean => format!("Neo-Hookean finite elements{fibres}"),
        law => {
            format!("Finite elements (law {law}, stiffening {}){fibres}", case.tissue.stiffening)
        }
    }
}

/// What holds the tissue, and the skin, in words.
fn boundary(case: &Case) -> String {
    let wall = match &case.sliding {
        Some(area) => format!(
            "slides on the chest wall within {} mm ({} kPa/mm)",
            area.radius_mm, area.stiffness_kpa_mm
        ),
        None => "chest wall fixed".into(),
    };
    let skin = case.skin.map(|skin| {
        format!(
            "; skin {} mm of {} kPa, stretched to {}",
            skin.thickness_mm, skin.young_kpa, skin.stretch
        )
    });
    wall + &skin.unwrap_or_default()
}

/// The moduli in words.
fn stiffness(case: &Case) -> String {
    let Some(Stiffness { map, kpa: [fat, gland, skin, tumour], mean_kpa, .. }) = case.stiffness
    else {
        return format!("{} kPa", case.tissue.young_kpa);
    };
    let by = format!("fat {fat}, gland {gland}, skin {skin}, tumour {tumour}");
    match mean_kpa {
        Some(mean) => format!("{mean} kPa in the mean, by {} as {by}", map.name()),
        None => format!("by {}: {by} kPa", map.name()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;

    #[test]
    fn a_result_is_known_by_what_a_nifti_header_keeps_of_its_note() {
        let mut spec = Spec::new("");
        for (key, value) in
            [("table.ap", 7.0.into()), ("table.lat", 5.0.into()), ("breast", "left".into())]
        {
            spec.set(key, &value).unwrap();
        }
        let note = derivation(&spec.case().unwrap()).unwrap();
        assert!(supine_dicom::tells_deformation(&note[..79]), "{note}");
    }

    #[test]
    fn series_are_told_apart_by_table_and_tissue_in_59_characters() {
        let named = |keys: &[(&str, serde_json::Value)]| {
            let mut spec = Spec::new("");
            for (key, value) in keys {
                spec.set(key, value).unwrap();
            }
            series_description(&spec.case().unwrap()).unwrap()
        };
        let tilts = [("table.ap", 7.0.into()), ("table.lat", 5.0.into())];
        assert_eq!(named(&tilts), "DEFORMED AP 7 LAT 5 E 0.609 kPa net");
        let longest = named(&[
            ("table.ap", (-12.345).into()),
            ("table.lat", (-10.255).into()),
            ("tissue.young", 999_999.9.into()),
            ("tissue.rest", "unloaded".into()),
            ("export.frame", "source, although the breast has moved in it".into()),
        ]);
        assert!(longest.len() <= 59 && longest.contains("E 1e6 kPa unloaded"), "{longest}");
    }
}

//! By what a CT is known that this software deformed: it shows a simulation, not the patient in the
//! scanner.

use crate::data_set::DataSet;
use dicom_dictionary_std::tags;

/// Manufacturer and model of what this software writes.
pub(crate) const MANUFACTURER: &str = "supine";
pub(crate) const MODEL: &str = "supine (research software)";

/// What such a CT is, and what to do.
pub const DEFORMED_ALREADY: &str = "a CT that was deformed by this program already, not the patient as she lay in the \
     scanner: name the CT that it was made from";

/// Begins the Image Comments of every slice; converters keep as much of it as fits (24 bytes of a
/// NIfTI header).
const COMMENTS: &str = "SIMULATED DEFORMATION -";

/// Whether a text that came with a volume says that this software deformed it: a Derivation
/// Description, Image Comments, or the note in a file that is not DICOM.
pub fn tells_deformation(text: &str) -> bool {
    let derived = text.split_once("DERIVED: ").is_some_and(|(_, by)| by.contains(" by supine "));
    derived || text.contains(COMMENTS)
}

/// Whether one of the marks that an export bears is left in a header. Any one will do: what passes
/// through other systems loses some.
pub(crate) fn is_deformed(header: &DataSet) -> bool {
    let ours = |set: &DataSet| {
        set.text(tags::MANUFACTURER) == MANUFACTURER
            || set.text(tags::MANUFACTURER_MODEL_NAME) == MODEL
    };
    let told = [tags::DERIVATION_DESCRIPTION, tags::IMAGE_COMMENTS];
    ours(header)
        || header.items(tags::CONTRIBUTING_EQUIPMENT_SEQUENCE).iter().any(ours)
        || told.iter().any(|&tag| tells_deformation(&header.text(tag)))
        || is_our_name(&header.text(tags::SERIES_DESCRIPTION))
}

/// Whether a series is called as exports are: DEFORMED, by the tilt of its table or by its mesh.
fn is_our_name(description: &str) -> bool {
    let Some(how) = description.strip_prefix("DEFORMED ") else { return false };
    let table = how.split_once("AP ").is_some_and(|(_, angles)| angles.contains(" LAT "));
    table || how == "by a given mesh"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_our_own_words_tell_a_deformation() {
        for ours in [
            "DERIVED: simulated deformation by supine 0.1.0; not acquired anatomy. Breast le",
            "DERIVED: resampled (cubic) by supine 0.1.0 through a deformed mesh; not acquired",
            "SIMULATED DEFORMATION -",
        ] {
            assert!(tells_deformation(ours), "{ours}");
        }
        for other in [
            "",
            "DERIVED: resampled to 1 mm, patient supine",
            "made by supine CT",
            "deformation of the liver",
        ] {
            assert!(!tells_deformation(other), "{other}");
        }
    }

    #[test]
    fn series_are_known_by_what_exports_are_called() {
        for ours in [
            "DEFORMED AP 7 LAT 5 E 0.609 kPa net 3f7a",
            "DEFORMED SAME-FRAME AP 7 LAT 5",
            "DEFORMED by a given mesh",
        ] {
            assert!(is_our_name(ours), "{ours}");
        }
        for other in ["CT AP LAT scout", "Thorax DEFORMED", "DEFORMED registration of 4D CT", ""] {
            assert!(!is_our_name(other), "{other}");
        }
    }
}

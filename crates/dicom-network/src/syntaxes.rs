//! Transfer syntaxes and SOP classes that are proposed.

use dicom_dictionary_std::uids;

/// What identifiers travel in.
pub(crate) const IDENTIFIER: [&str; 2] =
    [uids::EXPLICIT_VR_LITTLE_ENDIAN, uids::IMPLICIT_VR_LITTLE_ENDIAN];

/// The transfer syntaxes in which an object of a class is taken, preferred first: those this
/// software reads, of which the ones that compress pixels are left out for objects that have none.
pub(crate) fn of(class: &str) -> &'static [&'static str] {
    let without = WITHOUT_PIXELS.iter().any(|&root| match class.strip_prefix(root) {
        Some(rest) => rest.is_empty() || rest.starts_with('.'),
        None => false,
    });
    if without { &OBJECT[..WITHOUT_COMPRESSION] } else { &OBJECT }
}

/// How many of [`OBJECT`] compress no pixels.
const WITHOUT_COMPRESSION: usize = 3;

/// Classes without Pixel Data (PS3.3 A.1.4), and what their UIDs begin with.
const WITHOUT_PIXELS: [&str; 21] = [
    // Waveforms.
    "1.2.840.10008.5.1.4.1.1.9",
    // Presentation states.
    "1.2.840.10008.5.1.4.1.1.11",
    uids::SPATIAL_REGISTRATION_STORAGE,
    uids::SPATIAL_FIDUCIALS_STORAGE,
    uids::DEFORMABLE_SPATIAL_REGISTRATION_STORAGE,
    uids::SURFACE_SEGMENTATION_STORAGE,
    uids::TRACTOGRAPHY_RESULTS_STORAGE,
    uids::REAL_WORLD_VALUE_MAPPING_STORAGE,
    // Scanned surfaces.
    "1.2.840.10008.5.1.4.1.1.68",
    // Lenses and measurements of eyes.
    "1.2.840.10008.5.1.4.1.1.78",
    "1.2.840.10008.5.1.4.1.1.79",
    "1.2.840.10008.5.1.4.1.1.80",
    // Reports and other structured documents.
    "1.2.840.10008.5.1.4.1.1.88",
    // Encapsulated documents.
    "1.2.840.10008.5.1.4.1.1.104",
    // Radiotherapy, but for images and doses.
    uids::RT_STRUCTURE_SET_STORAGE,
    uids::RT_BEAMS_TREATMENT_RECORD_STORAGE,
    uids::RT_PLAN_STORAGE,
    uids::RT_BRACHY_TREATMENT_RECORD_STORAGE,
    uids::RT_TREATMENT_SUMMARY_RECORD_STORAGE,
    uids::RT_ION_PLAN_STORAGE,
    uids::RT_ION_BEAMS_TREATMENT_RECORD_STORAGE,
];

/// What objects are taken in, preferred first: those this software reads.
pub(crate) const OBJECT: [&str; 11] = [
    uids::EXPLICIT_VR_LITTLE_ENDIAN,
    uids::IMPLICIT_VR_LITTLE_ENDIAN,
    uids::DEFLATED_EXPLICIT_VR_LITTLE_ENDIAN,
    uids::RLE_LOSSLESS,
    uids::JPEG_LOSSLESS_SV1,
    uids::JPEG_LOSSLESS,
    uids::JPEGLS_LOSSLESS,
    uids::JPEG2000_LOSSLESS,
    uids::JPEG_BASELINE8_BIT,
    uids::JPEGLS_NEAR_LOSSLESS,
    uids::JPEG2000,
];

/// The objects of a planning CT and what is made from it.
pub(crate) const KINDS: [&str; 10] = [
    uids::CT_IMAGE_STORAGE,
    uids::ENHANCED_CT_IMAGE_STORAGE,
    uids::LEGACY_CONVERTED_ENHANCED_CT_IMAGE_STORAGE,
    uids::SPATIAL_REGISTRATION_STORAGE,
    uids::DEFORMABLE_SPATIAL_REGISTRATION_STORAGE,
    uids::SEGMENTATION_STORAGE,
    uids::LABEL_MAP_SEGMENTATION_STORAGE,
    uids::RT_STRUCTURE_SET_STORAGE,
    uids::RT_DOSE_STORAGE,
    uids::ENCAPSULATED_PDF_STORAGE,
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_pixels_is_taken_compressed_too() {
        let none = [
            uids::SPATIAL_REGISTRATION_STORAGE,
            uids::DEFORMABLE_SPATIAL_REGISTRATION_STORAGE,
            uids::RT_STRUCTURE_SET_STORAGE,
            uids::ENCAPSULATED_PDF_STORAGE,
            uids::BASIC_TEXT_SR_STORAGE,
            uids::GRAYSCALE_SOFTCOPY_PRESENTATION_STATE_STORAGE,
        ];
        for class in none {
            assert_eq!(of(class), &OBJECT[..3], "{class}");
        }
        let some = [
            uids::CT_IMAGE_STORAGE,
            uids::RT_DOSE_STORAGE,
            uids::RT_IMAGE_STORAGE,
            uids::SEGMENTATION_STORAGE,
            uids::LABEL_MAP_SEGMENTATION_STORAGE,
            uids::PARAMETRIC_MAP_STORAGE,
            "1.2.3",
        ];
        for class in some {
            assert_eq!(of(class), &OBJECT, "{class}");
        }
    }
}

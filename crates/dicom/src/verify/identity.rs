//! Rules B: whose images these are, and that they are not the source's.

use super::{Checks, DEIDENTIFIED, Image, NEEDS_SOURCE, Reference, deidentified, numbers, values};
use crate::policy::{Policy, SAME_FRAME};
use dicom_core::Tag;
use dicom_dictionary_std::tags;

/// The same for patient and study in the export and in its source.
const PATIENT_AND_STUDY: &[(Tag, &str)] = &[
    (tags::PATIENT_NAME, "Patient's Name"),
    (tags::PATIENT_ID, "Patient ID"),
    (tags::PATIENT_BIRTH_DATE, "Patient's Birth Date"),
    (tags::PATIENT_SEX, "Patient's Sex"),
    (tags::STUDY_INSTANCE_UID, "Study Instance UID"),
    (tags::STUDY_ID, "Study ID"),
    (tags::STUDY_DATE, "Study Date"),
    (tags::ACCESSION_NUMBER, "Accession Number"),
];

/// The same in all images of the series besides.
const SERIES: &[(Tag, &str)] = &[
    (tags::SPECIFIC_CHARACTER_SET, "Specific Character Set"),
    (tags::SERIES_INSTANCE_UID, "Series Instance UID"),
    (tags::SERIES_NUMBER, "Series Number"),
    (tags::SERIES_DESCRIPTION, "Series Description"),
    (tags::SERIES_DATE, "Series Date"),
    (tags::SERIES_TIME, "Series Time"),
    (tags::FRAME_OF_REFERENCE_UID, "Frame of Reference UID"),
    (tags::PATIENT_POSITION, "Patient Position"),
    (tags::MANUFACTURER, "Manufacturer"),
    (tags::MANUFACTURER_MODEL_NAME, "Manufacturer's Model Name"),
    (tags::SOFTWARE_VERSIONS, "Software Versions"),
    (tags::LATERALITY, "Laterality"),
    (tags::KVP, "KVP"),
];

/// Image description, texts.
const IMAGE_TEXTS: &[(Tag, &str)] = &[
    (tags::PIXEL_SPACING, "Pixel Spacing"),
    (tags::IMAGE_ORIENTATION_PATIENT, "Image Orientation (Patient)"),
    (tags::RESCALE_SLOPE, "Rescale Slope"),
    (tags::RESCALE_INTERCEPT, "Rescale Intercept"),
    (tags::RESCALE_TYPE, "Rescale Type"),
    (tags::SLICE_THICKNESS, "Slice Thickness"),
    (tags::PHOTOMETRIC_INTERPRETATION, "Photometric Interpretation"),
    (tags::IMAGE_TYPE, "Image Type"),
];

/// Image description, 16-bit numbers.
const IMAGE_NUMBERS: &[(Tag, &str)] = &[
    (tags::ROWS, "Rows"),
    (tags::COLUMNS, "Columns"),
    (tags::SAMPLES_PER_PIXEL, "Samples per Pixel"),
    (tags::BITS_ALLOCATED, "Bits Allocated"),
    (tags::BITS_STORED, "Bits Stored"),
    (tags::HIGH_BIT, "High Bit"),
    (tags::PIXEL_REPRESENTATION, "Pixel Representation"),
    (tags::PIXEL_PADDING_VALUE, "Pixel Padding Value"),
];

pub(super) fn check(
    checks: &mut Checks,
    images: &[Image],
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let sets = || images.iter().map(|i| &i.set);
    let varying = |list: &[(Tag, &str)]| -> Vec<String> {
        let several = list.iter().filter(|(tag, _)| values(sets(), *tag).len() > 1);
        several
            .map(|(tag, name)| format!("{name}: {} values", values(sets(), *tag).len()))
            .collect()
    };
    let mut faults = varying(PATIENT_AND_STUDY);
    faults.extend(varying(SERIES));
    for (tag, name) in [
        (tags::FRAME_OF_REFERENCE_UID, "Frame of Reference UID"),
        (tags::SERIES_INSTANCE_UID, "Series Instance UID"),
        (tags::STUDY_INSTANCE_UID, "Study Instance UID"),
    ] {
        if values(sets(), tag).contains("") {
            faults.push(format!("{name} is missing"));
        }
    }
    checks.none_of(
        "B1 patient, study, series, frame and equipment are the same in all images",
        &faults,
    );
    against_source(checks, images, reference, policy);
    let mut faults = varying(IMAGE_TEXTS);
    for (tag, name) in IMAGE_NUMBERS {
        let count = numbers(sets(), *tag).len();
        if count > 1 {
            faults.push(format!("{name}: {count} values"));
        }
    }
    checks.none_of("B5 the image description is the same in all images", &faults);
}

fn against_source(
    checks: &mut Checks,
    images: &[Image],
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let equal = if policy.new_study {
        "B2 the patient is that of the source, the study is not"
    } else {
        "B2 patient and study are those of the source"
    };
    let new = "B3 series and instances are not those of the source";
    let frame = if policy.same_frame {
        "B4 the Frame of Reference is that of the source, and Series Description says SAME-FRAME"
    } else {
        "B4 the Frame of Reference is not that of the source (PS3.3 C.7.4.1)"
    };
    let Some(reference) = reference else {
        for rule in [equal, new, frame] {
            checks.skip(rule, NEEDS_SOURCE);
        }
        return;
    };
    let same =
        |tag: Tag| values(images.iter().map(|i| &i.set), tag) == values(reference.headers(), tag);
    if deidentified(images, reference) {
        checks.skip(equal, DEIDENTIFIED);
    } else {
        // The values would name the patient; the attribute is enough.
        let own = |tag: Tag| tag == tags::STUDY_INSTANCE_UID || tag == tags::STUDY_ID;
        let compared = PATIENT_AND_STUDY.iter().filter(|(tag, _)| !policy.new_study || !own(*tag));
        let differing = compared.filter(|(tag, _)| !same(*tag));
        let mut faults: Vec<String> =
            differing.map(|(_, name)| format!("{name} differs")).collect();
        if policy.new_study && same(tags::STUDY_INSTANCE_UID) {
            faults.push("Study Instance UID is reused".into());
        }
        checks.none_of(equal, &faults);
    }

    let shared = |tag: Tag| {
        let ours = values(images.iter().map(|i| &i.set), tag);
        values(reference.headers(), tag).iter().any(|v| !v.is_empty() && ours.contains(v))
    };
    let reused = [
        (tags::SERIES_INSTANCE_UID, "Series Instance UID"),
        (tags::SOP_INSTANCE_UID, "SOP Instance UID"),
        (tags::SERIES_NUMBER, "Series Number"),
    ];
    let reused = reused.iter().filter(|(tag, _)| shared(*tag));
    let faults: Vec<String> = reused.map(|(_, name)| format!("{name} is reused")).collect();
    checks.none_of(new, &faults);
    let reused = shared(tags::FRAME_OF_REFERENCE_UID);
    if policy.same_frame {
        let said = |i: &Image| i.text(tags::SERIES_DESCRIPTION).contains(SAME_FRAME);
        checks.say(frame, reused && images.iter().all(said), "");
    } else {
        checks.say(frame, !reused, if reused { "it is reused" } else { "" });
    }
}

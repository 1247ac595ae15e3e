//! Rules E: that the series says what it is.

use super::{Checks, DEIDENTIFIED, Image, NEEDS_SOURCE, Reference, deidentified, values};
use crate::data_set::DataSet;
use crate::policy::Policy;
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use std::collections::BTreeSet;

/// Elements that describe the source's pixels or its exposure and are wrong of derived pixels.
const STALE: &[Tag] = &[
    tags::SMALLEST_IMAGE_PIXEL_VALUE,
    tags::LARGEST_IMAGE_PIXEL_VALUE,
    tags::SMALLEST_PIXEL_VALUE_IN_SERIES,
    tags::LARGEST_PIXEL_VALUE_IN_SERIES,
    tags::ICON_IMAGE_SEQUENCE,
    tags::DIGITAL_SIGNATURES_SEQUENCE,
    tags::EXPOSURE,
    tags::CTD_IVOL,
    tags::IRRADIATION_EVENT_UID,
];

pub(super) fn check(
    checks: &mut Checks,
    images: &[Image],
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let without = |holds: &dyn Fn(&DataSet) -> bool| -> Vec<String> {
        images.iter().filter(|i| !holds(&i.set)).map(|i| i.file.clone()).collect()
    };
    let code = |sequence: Tag, value: &'static str| {
        move |set: &DataSet| {
            let matches = |c: &DataSet| {
                c.text(tags::CODE_VALUE) == value && c.text(tags::CODING_SCHEME_DESIGNATOR) == "DCM"
            };
            set.items(sequence).iter().any(matches)
        }
    };
    checks.none_of(
        "E1 Image Type is DERIVED\\SECONDARY\\AXIAL",
        &without(&|set| {
            set.texts(tags::IMAGE_TYPE)
                .starts_with(&["DERIVED", "SECONDARY", "AXIAL"].map(String::from))
        }),
    );
    checks.none_of(
        "E2 Derivation Description is there",
        &without(&|set| !set.text(tags::DERIVATION_DESCRIPTION).is_empty()),
    );
    checks.none_of(
        "E3 Derivation Code is 113085 DCM, spatial resampling",
        &without(&code(tags::DERIVATION_CODE_SEQUENCE, "113085")),
    );
    check_source_images(checks, images, reference);
    checks.none_of(
        "E5 Series Description says DEFORMED",
        &without(&|set| set.text(tags::SERIES_DESCRIPTION).contains("DEFORMED")),
    );
    let equipment = |set: &DataSet| {
        let purposes: Vec<String> = set
            .items(tags::CONTRIBUTING_EQUIPMENT_SEQUENCE)
            .iter()
            .flat_map(|item| item.items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE))
            .map(|code| code.text(tags::CODE_VALUE))
            .collect();
        ["109101", "109102"].iter().all(|p| purposes.iter().any(|found| found == p))
    };
    checks.none_of(
        "E6 Contributing Equipment names the scanner (109101) and the processing (109102)",
        &without(&equipment),
    );
    let stale = |set: &DataSet| {
        let bad =
            |tag: Tag| tag.0 % 2 == 1 || (0x6000..=0x60FF).contains(&tag.0) || STALE.contains(&tag);
        set.elements().iter().any(|e| bad(e.tag))
    };
    checks.none_of(
        "E7 nothing private, no overlay, no stale pixel range, icon, signature or exposure",
        &without(&|set| !stale(set)),
    );
    let lossy = reference.is_some_and(|r| r.source.slices.iter().any(|s| s.slice.lossy));
    let flagged = |set: &DataSet| match set.text(tags::LOSSY_IMAGE_COMPRESSION).as_str() {
        "01" => true,
        "00" => !lossy,
        _ => false,
    };
    checks.none_of("E8 Lossy Image Compression is there and not lost", &without(&flagged));
    let dated = |set: &DataSet| {
        let wanted = [tags::CONTENT_DATE, tags::CONTENT_TIME, tags::SERIES_DATE, tags::SERIES_TIME];
        wanted.iter().all(|&tag| !set.text(tag).is_empty())
    };
    checks.none_of("E9 content and series have date and time", &without(&dated));
    let burned =
        reference.is_some_and(|r| values(r.headers(), tags::BURNED_IN_ANNOTATION).contains("YES"));
    let expected = if burned { "YES" } else { "NO" };
    checks.none_of(
        "E10 Burned In Annotation is NO, or YES as in the source",
        &without(&|set| set.text(tags::BURNED_IN_ANNOTATION) == expected),
    );
    check_equipment(checks, images, reference, policy);
}

fn check_source_images(checks: &mut Checks, images: &[Image], reference: Option<&Reference<'_>>) {
    let why = if reference.is_none() { NEEDS_SOURCE } else { DEIDENTIFIED };
    let reference = reference.filter(|r| !deidentified(images, r));
    let known: BTreeSet<String> =
        reference.map(|r| values(r.headers(), tags::SOP_INSTANCE_UID)).unwrap_or_default();
    let mut findings = Vec::new();
    for image in images {
        let items = image.set.items(tags::SOURCE_IMAGE_SEQUENCE);
        let mut faults = BTreeSet::new();
        if items.is_empty() {
            faults.insert("none");
        }
        for item in items {
            let uid = item.text(tags::REFERENCED_SOP_INSTANCE_UID);
            if uid.is_empty() || (reference.is_some() && !known.contains(&uid)) {
                faults.insert("an image outside the source");
            }
            if item.text(tags::SPATIAL_LOCATIONS_PRESERVED) != "NO" {
                faults.insert("Spatial Locations Preserved is not NO");
            }
            let purpose = item.items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE);
            if !matches!(purpose, [code] if code.text(tags::CODE_VALUE) == "121322") {
                faults.insert("the purpose is not 121322");
            }
        }
        findings.extend(faults.into_iter().map(|fault| format!("{}: {fault}", image.file)));
    }
    let rule = "E4 source images are named, purpose 121322, locations not preserved";
    checks.none_of(rule, &findings);
    if reference.is_none() {
        checks.skip("E4b source images are those of the source", why);
    }
}

fn check_equipment(
    checks: &mut Checks,
    images: &[Image],
    reference: Option<&Reference<'_>>,
    policy: Policy,
) {
    let sets = || images.iter().map(|i| &i.set);
    let position = "E11 Patient Position is that of the source";
    let model = if policy.keep_equipment {
        "E12 the equipment is that of the source"
    } else {
        "E12 the equipment is not that of the source"
    };
    match reference {
        Some(reference) => {
            let same = |tag| values(sets(), tag) == values(reference.headers(), tag);
            checks.say(position, same(tags::PATIENT_POSITION), "");
            let kept = same(tags::MANUFACTURER_MODEL_NAME);
            checks.say(model, kept == policy.keep_equipment, "");
        }
        None => {
            checks.skip(position, NEEDS_SOURCE);
            checks.skip(model, NEEDS_SOURCE);
        }
    }
    let named = sets().all(|set| {
        !set.text(tags::MANUFACTURER).is_empty()
            && (policy.keep_equipment || !set.text(tags::SOFTWARE_VERSIONS).is_empty())
    });
    checks.say("E13 the software that made the images is named with its version", named, "");
}

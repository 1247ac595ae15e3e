//! A CT that this software deformed is known by whatever is left of its marks.

use crate::support::{Slice, deformed, export_params, folder, put, read, six};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use dicom_object::open_file;
use supine_dicom::{Accept, DEFORMED_ALREADY, Depth, ExportParams, inspect, write_series};
use supine_space::Progress;

/// Everything by which an export is known.
const MARKS: [Tag; 6] = [
    tags::MANUFACTURER,
    tags::MANUFACTURER_MODEL_NAME,
    tags::CONTRIBUTING_EQUIPMENT_SEQUENCE,
    tags::DERIVATION_DESCRIPTION,
    tags::IMAGE_COMMENTS,
    tags::SERIES_DESCRIPTION,
];

fn exported() -> Vec<Slice> {
    let (ct, source, _) = read(folder(&six()).path()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let params = ExportParams {
        series_description: "DEFORMED AP 7 LAT 5 E 0.609 kPa net 3f7a".into(),
        derivation: "DERIVED: simulated deformation by supine 0.1.0; not acquired anatomy.".into(),
        ..export_params(&source)
    };
    let dir = out.path().join("ct");
    let written = write_series(&deformed(&ct), &source, &params, &dir, Progress::none()).unwrap();
    assert_eq!(written.files.len(), 6);
    (1..=6).map(|n| open_file(dir.join(format!("CT{n:04}.dcm"))).unwrap()).collect()
}

fn is_deformed(slices: &[Slice]) -> bool {
    read(folder(slices).path()).unwrap().1.is_deformed()
}

#[test]
fn any_mark_that_is_left_gives_an_export_away() {
    let original = |slice: &mut Slice| put(slice, tags::IMAGE_TYPE, VR::CS, "ORIGINAL\\PRIMARY");
    let mut slices = exported();
    slices.iter_mut().for_each(original);
    assert!(is_deformed(&slices));
    for kept in MARKS {
        let mut slices = exported();
        for slice in &mut slices {
            original(slice);
            for tag in MARKS.into_iter().filter(|tag| *tag != kept) {
                slice.remove_element(tag);
            }
        }
        assert!(is_deformed(&slices), "{kept}");
    }
}

#[test]
fn what_others_derived_is_no_export() {
    assert!(!is_deformed(&six()));
    let mut slices = six();
    for slice in &mut slices {
        put(slice, tags::IMAGE_TYPE, VR::CS, "DERIVED\\SECONDARY\\AXIAL");
        put(slice, tags::DERIVATION_DESCRIPTION, VR::ST, "DERIVED: resampled, patient supine");
        put(slice, tags::SERIES_DESCRIPTION, VR::LO, "DEFORMED registration of 4D CT");
        put(slice, tags::IMAGE_COMMENTS, VR::LT, "supine, arms up");
    }
    assert!(!is_deformed(&slices));
}

#[test]
fn inspection_does_not_call_an_export_usable() {
    let looked = |slices: &[Slice]| {
        let dir = folder(slices);
        inspect(dir.path(), Depth::Headers, Accept::default(), Progress::none()).unwrap()
    };
    assert_eq!(looked(&six()).usable().count(), 1);
    let found = looked(&exported());
    assert_eq!(found.usable().count(), 0);
    let reason = found.series[0].reason.as_deref().unwrap_or_default();
    assert_eq!(reason, format!("it is {DEFORMED_ALREADY}"));
}

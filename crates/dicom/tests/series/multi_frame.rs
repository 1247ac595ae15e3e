//! Enhanced CT: the six slices of the fixture as the frames of one file.

use crate::support::{
    Slice, deformed, export_params, folder, put, put_samples, read, six, stored, text,
};
use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{InMemDicomObject, open_file};
use supine_dicom::{Expected, Original, verify_export, write_series};
use supine_space::Progress;

fn group(sequence: Tag, elements: &[(Tag, VR, String)]) -> DataElement<InMemDicomObject> {
    let elements = elements
        .iter()
        .map(|(tag, vr, value)| DataElement::new(*tag, *vr, PrimitiveValue::from(value.as_str())));
    let item = InMemDicomObject::from_element_iter(elements);
    DataElement::new(sequence, VR::SQ, DataSetSequence::from(vec![item]))
}

fn put_sequence(slice: &mut Slice, tag: Tag, items: Vec<InMemDicomObject>) {
    slice.put(DataElement::new(tag, VR::SQ, DataSetSequence::from(items)));
}

/// One file with the slices as its frames, in this order.
fn enhanced(order: [usize; 6]) -> Slice {
    let slices = six();
    let pixels = stored(&slices);
    let mut file = six().remove(0);
    let moved = |tag: Tag, vr: VR| (tag, vr, text(&slices[0], tag));
    let shared = InMemDicomObject::from_element_iter([
        group(
            tags::PIXEL_MEASURES_SEQUENCE,
            &[moved(tags::PIXEL_SPACING, VR::DS), moved(tags::SLICE_THICKNESS, VR::DS)],
        ),
        group(tags::PLANE_ORIENTATION_SEQUENCE, &[moved(tags::IMAGE_ORIENTATION_PATIENT, VR::DS)]),
        group(
            tags::CT_IMAGE_FRAME_TYPE_SEQUENCE,
            &[(tags::FRAME_TYPE, VR::CS, "ORIGINAL\\PRIMARY\\VOLUME\\NONE".into())],
        ),
    ]);
    let frames = order.iter().map(|&n| {
        let value = |tag: Tag, vr: VR| (tag, vr, text(&slices[n], tag));
        InMemDicomObject::from_element_iter([
            group(tags::PLANE_POSITION_SEQUENCE, &[value(tags::IMAGE_POSITION_PATIENT, VR::DS)]),
            group(
                tags::PIXEL_VALUE_TRANSFORMATION_SEQUENCE,
                &[
                    value(tags::RESCALE_INTERCEPT, VR::DS),
                    value(tags::RESCALE_SLOPE, VR::DS),
                    (tags::RESCALE_TYPE, VR::LO, "HU".into()),
                ],
            ),
        ])
    });
    let frames = frames.collect();
    put_sequence(&mut file, tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE, vec![shared]);
    put_sequence(&mut file, tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE, frames);
    for tag in [
        tags::IMAGE_POSITION_PATIENT,
        tags::IMAGE_ORIENTATION_PATIENT,
        tags::PIXEL_SPACING,
        tags::SLICE_THICKNESS,
        tags::RESCALE_INTERCEPT,
        tags::RESCALE_SLOPE,
        tags::RESCALE_TYPE,
    ] {
        file.remove_element(tag);
    }
    put(&mut file, tags::NUMBER_OF_FRAMES, VR::IS, "6");
    put(&mut file, tags::SOP_CLASS_UID, VR::UI, uids::ENHANCED_CT_IMAGE_STORAGE);
    file.meta_mut().media_storage_sop_class_uid = uids::ENHANCED_CT_IMAGE_STORAGE.into();
    put_samples(&mut file, order.iter().flat_map(|&n| pixels[n].clone()).collect());
    file
}

#[test]
fn frames_are_slices_wherever_they_stand_in_the_file() {
    let (plain, ..) = read(folder(&six()).path()).unwrap();
    let dir = folder(&[enhanced([4, 1, 0, 5, 2, 3])]);
    let (ct, source, info) = read(dir.path()).unwrap();
    assert_eq!(ct, plain);
    assert_eq!((info.slices, info.warnings), (6, vec![]));
    assert_eq!(source.files()[0], "0.dcm frame 3", "the lowest slice is the third frame");
    let (given, ..) = read(&dir.path().join("0.dcm")).unwrap();
    assert_eq!(given, plain);
}

#[test]
fn an_export_names_the_frames_it_comes_from() {
    let dir = folder(&[enhanced([4, 1, 0, 5, 2, 3])]);
    let (ct, source, _) = read(dir.path()).unwrap();
    let out = tempfile::TempDir::new().unwrap();
    let export = out.path().join("ct");
    let params = export_params(&source);
    write_series(&deformed(&ct), &source, &params, &export, Progress::none()).unwrap();
    let checked = verify_export(
        &export,
        Some(Original::Files(dir.path())),
        Expected::default(),
        Progress::none(),
    )
    .unwrap();
    let wrong: Vec<_> = checked.checks.iter().filter(|c| c.passed == Some(false)).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
    let first = open_file(export.join("CT0001.dcm")).unwrap();
    let images = first.element(tags::SOURCE_IMAGE_SEQUENCE).unwrap().items().unwrap();
    let value =
        |item: &InMemDicomObject, tag| item.element(tag).unwrap().to_str().unwrap().into_owned();
    let frames: Vec<String> =
        images.iter().map(|i| value(i, tags::REFERENCED_FRAME_NUMBER)).collect();
    assert_eq!(frames, ["3", "2", "5"]);
    assert_eq!(value(&images[0], tags::REFERENCED_SOP_CLASS_UID), uids::ENHANCED_CT_IMAGE_STORAGE);
}

#[test]
fn frames_that_do_not_go_together_are_refused() {
    type Change = fn(&mut Slice);
    let cases: [(Change, &str); 4] = [
        (|f| put(f, tags::NUMBER_OF_FRAMES, VR::IS, "5"), "has 6 items for 5 frames"),
        (|f| put(f, tags::NUMBER_OF_FRAMES, VR::IS, "2000000000"), "Number of Frames"),
        (|f| put(f, tags::NUMBER_OF_FRAMES, VR::IS, ""), "Number of Frames"),
        (|f| put_samples(f, vec![1000; 256 * 256 * 5]), "cut short"),
    ];
    for (change, expected) in cases {
        let mut file = enhanced([0, 1, 2, 3, 4, 5]);
        change(&mut file);
        let message = read(folder(&[file]).path()).unwrap_err().to_string();
        assert!(message.contains("0.dcm") && message.contains(expected), "{message}");
    }
    let mut file = enhanced([0, 1, 2, 3, 4, 5]);
    file.remove_element(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE);
    let message = read(folder(&[file]).path()).unwrap_err().to_string();
    assert!(message.contains("0.dcm frame 1: Image Orientation (Patient) is missing"), "{message}");
}

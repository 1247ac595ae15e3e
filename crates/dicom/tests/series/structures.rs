//! Structure sets, written by pydicom.

use crate::segmentation::{FRAME, data, grid, label_at};
use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, VR};
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, InMemDicomObject, open_file};
use supine_dicom::{Meaning, Structures, read_structures};
use supine_space::Warning;
use supine_volume::Volume;
use tempfile::TempDir;

fn structures() -> Structures {
    read_structures(&data("pydicom_rtstruct.dcm")).unwrap()
}

fn mask(structures: &Structures, name: &str) -> (Volume<bool>, Vec<Warning>) {
    let roi = structures.rois().iter().find(|r| r.name == name).unwrap();
    structures.mask(roi, &grid(), FRAME).unwrap()
}

fn message(structures: &Structures, name: &str, frame: Option<&str>) -> String {
    let roi = structures.rois().iter().find(|r| r.name == name).unwrap();
    structures.mask(roi, &grid(), frame).unwrap_err().to_string()
}

#[test]
fn names_types_and_colours_are_read() {
    let s = structures();
    let names: Vec<_> = s.rois().iter().map(|r| (r.name.as_str(), r.contours.len())).collect();
    let expected = [("Outline", 5), ("CHESTWALL", 5), ("Ring", 3), ("Isocentre", 0), ("Empty", 0)];
    assert_eq!(names, expected);
    assert_eq!(s.rois()[0].meaning(), Some(Meaning::Body));
    assert_eq!(s.rois()[2].meaning(), None);
    assert_eq!(s.rois()[1].colour, Some([250, 20, 0]));
    assert_eq!(s.rois()[3].lines.len(), 1);
}

#[test]
fn contours_give_back_the_voxels_they_were_drawn_round() {
    let s = structures();
    let (body, warnings) = mask(&s, "Outline");
    assert!(warnings.len() == 1 && warnings[0].to_string().contains("1 slice(s)"), "{warnings:?}");
    let (wall, _) = mask(&s, "CHESTWALL");
    for n in 0..grid().len() {
        let [i, j, k] = grid().voxel(n);
        // Slice 2 has no contours: the shape between its neighbours, which are alike.
        let like = if k == 2 { 3 } else { k };
        assert_eq!(body.data()[n], label_at([i, j, like]) > 0, "body at {i} {j} {k}");
        if k != 2 {
            assert_eq!(wall.data()[n], label_at([i, j, k]) == 2, "wall at {i} {j} {k}");
        }
    }
}

#[test]
fn an_inner_contour_is_a_hole() {
    let (ring, warnings) = mask(&structures(), "Ring");
    assert_eq!(ring.data().iter().filter(|m| **m).count(), 12 * 15 - 2 * 3);
    assert!(!ring.at([6, 8, 0]) && ring.at([5, 8, 0]));
    assert!(warnings[0].to_string().contains("1 contour(s)"), "{warnings:?}");
}

#[test]
fn regions_that_cannot_be_filled_say_why() {
    let s = structures();
    for name in ["Empty", "Isocentre"] {
        let text = message(&s, name, FRAME);
        assert!(text.contains(name) && text.contains("no contour"), "{text}");
    }
    let text = message(&s, "Outline", Some("2.25.8"));
    assert!(text.contains("Frame of Reference"), "{text}");
    let (_, warnings) = s.mask(&s.rois()[1], &grid(), None).unwrap();
    assert!(warnings.last().unwrap().to_string().contains("frame of reference"), "{warnings:?}");
}

/// The message of the error that a structure set with this contour gives.
fn refused(contour_data: &str) -> String {
    let dir = TempDir::new().unwrap();
    let mut object: DefaultDicomObject = open_file(data("pydicom_rtstruct.dcm")).unwrap();
    let mut contour = InMemDicomObject::new_empty();
    contour.put_str(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, "CLOSED_PLANAR");
    contour.put_str(tags::CONTOUR_DATA, VR::DS, contour_data);
    let mut drawn = InMemDicomObject::new_empty();
    drawn.put_str(tags::REFERENCED_ROI_NUMBER, VR::IS, "1");
    let items = |item| DataSetSequence::from(vec![item]);
    drawn.put(DataElement::new(tags::CONTOUR_SEQUENCE, VR::SQ, items(contour)));
    object.put(DataElement::new(tags::ROI_CONTOUR_SEQUENCE, VR::SQ, items(drawn)));
    let path = dir.path().join("rs.dcm");
    object.write_to_file(&path).unwrap();
    match read_structures(&path) {
        Err(error) => error.to_string(),
        Ok(s) => message(&s, "Outline", FRAME),
    }
}

#[test]
fn contours_that_are_none_are_refused_and_named() {
    for (contour_data, part) in [
        ("1\\2", "2 numbers"),
        ("1\\2\\", "not a list of numbers"),
        ("1\\b\\3", "not a list of numbers"),
        ("0\\0\\100.125\\9\\0\\100.125", "no contour of three"),
        ("0\\0\\100.125\\9\\0\\100.125\\9\\9\\120", "not parallel"),
    ] {
        let text = refused(contour_data);
        assert!(text.contains(part) && text.contains("Outline"), "{contour_data}: {text}");
    }
}

//! Structure sets, written by pydicom.

use crate::segmentation::{FRAME, data, grid, label_at};
use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, Tag, VR};
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
    let gap = warnings.iter().map(|w| (w.code(), w.to_string().contains("in 1 plane(s)")));
    assert_eq!(gap.collect::<Vec<_>>(), [("contours-gap", true)]);
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
    for (name, part) in [("Empty", "no contour"), ("Isocentre", "1 point(s), open line(s)")] {
        let text = message(&s, name, FRAME);
        assert!(text.contains(name) && text.contains(part), "{text}");
    }
    let text = message(&s, "Outline", Some("2.25.8"));
    assert!(text.contains("Frame of Reference"), "{text}");
    let (_, warnings) = s.mask(&s.rois()[1], &grid(), None).unwrap();
    assert!(warnings.last().unwrap().to_string().contains("frame of reference"), "{warnings:?}");
}

/// A structure set that was changed.
fn changed(
    change: impl FnOnce(&mut DefaultDicomObject),
) -> Result<Structures, supine_dicom::Error> {
    let dir = TempDir::new().unwrap();
    let mut object: DefaultDicomObject = open_file(data("pydicom_rtstruct.dcm")).unwrap();
    change(&mut object);
    let path = dir.path().join("rs.dcm");
    object.write_to_file(&path).unwrap();
    read_structures(&path)
}

#[test]
fn zeros_behind_a_structure_set_are_told_and_what_else_comes_there_is_refused() {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("rs.dcm");
    let with = |behind: &[u8]| {
        let whole = std::fs::read(data("pydicom_rtstruct.dcm")).unwrap();
        std::fs::write(&path, [whole.as_slice(), behind].concat()).unwrap();
        read_structures(&path)
    };
    let told = |s: &Structures| s.warnings().iter().any(|w| w.code() == "bytes-behind-data");
    assert!(!told(&with(&[]).unwrap()));
    assert!(told(&with(&[0; 300]).unwrap()));
    // Contours may be what is damaged.
    assert!(with(b"something else").is_err());
}

#[test]
fn a_region_without_a_frame_was_drawn_in_the_only_one_that_its_set_names() {
    let frames = |named: &[&str]| {
        let named: Vec<InMemDicomObject> = named
            .iter()
            .map(|uid| {
                let mut item = InMemDicomObject::new_empty();
                item.put_str(tags::FRAME_OF_REFERENCE_UID, VR::UI, *uid);
                item
            })
            .collect();
        let mut roi = InMemDicomObject::new_empty();
        roi.put_str(tags::ROI_NUMBER, VR::IS, "1");
        roi.put_str(tags::ROI_NAME, VR::LO, "Outline");
        roi.put_str(tags::REFERENCED_FRAME_OF_REFERENCE_UID, VR::UI, "");
        let s = changed(|object| {
            for (tag, items) in [
                (tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE, named),
                (tags::STRUCTURE_SET_ROI_SEQUENCE, vec![roi]),
            ] {
                object.put(DataElement::new(tag, VR::SQ, DataSetSequence::from(items)));
            }
        });
        s.unwrap().rois()[0].frame_of_reference.clone()
    };
    assert_eq!(frames(&["2.25.8"]), "2.25.8");
    assert_eq!(frames(&["2.25.8", "2.25.8"]), "2.25.8");
    assert_eq!(frames(&["2.25.8", "2.25.9"]), "");
    assert_eq!(frames(&[]), "");
}

#[test]
fn what_a_set_contradicts_itself_in_is_told() {
    assert!(structures().warnings().is_empty(), "{:?}", structures().warnings());
    let told = |change: fn(&mut DefaultDicomObject)| {
        let warnings = changed(change).unwrap().warnings().to_vec();
        warnings.iter().map(|w| (w.code().to_owned(), w.to_string())).collect::<Vec<_>>()
    };
    // Its first region's contours name a region that is not there.
    let nameless = told(|object| {
        let mut drawn = object.element(tags::ROI_CONTOUR_SEQUENCE).unwrap().clone();
        let item = &mut drawn.items_mut().unwrap()[0];
        item.put_str(tags::REFERENCED_ROI_NUMBER, VR::IS, "99");
        object.put(drawn);
    });
    assert!(nameless.len() == 1 && nameless[0].0 == "contours-of-no-region", "{nameless:?}");
    assert!(nameless[0].1.starts_with("5 contour(s) name a region"), "{nameless:?}");
    // The set as a whole names another frame of reference than its regions.
    let contradicts = told(|object| {
        let mut item = InMemDicomObject::new_empty();
        item.put_str(tags::FRAME_OF_REFERENCE_UID, VR::UI, "2.25.8");
        let items = DataSetSequence::from(vec![item]);
        let tag = tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE;
        object.put(DataElement::new(tag, VR::SQ, items));
    });
    assert!(contradicts.len() == 1 && contradicts[0].0 == "frame-contradicts", "{contradicts:?}");
    assert!(contradicts[0].1.contains("Outline"), "{contradicts:?}");
}

#[test]
fn a_set_of_open_lines_alone_is_refused_by_what_it_holds() {
    let open = drawn(&[("OPEN_PLANAR", square(1, 4.0), ""), ("OPEN_PLANAR", square(2, 4.0), "")]);
    let text = open.unwrap().refuse_open().unwrap_err().to_string();
    assert!(text.contains("\"Outline\" is drawn as 2 point(s)"), "{text}");
    assert!(structures().refuse_open().is_ok());
    // Contours of no known type are nothing in DICOM too; open lines are something there.
    let untyped = drawn(&[("", square(1, 4.0), ""), ("", square(2, 4.0), "")]).unwrap();
    let text = untyped.refuse_unknown().unwrap_err().to_string();
    assert!(text.contains("Outline"), "{text}");
    let lines = drawn(&[("OPEN_PLANAR", square(1, 4.0), ""), ("", square(2, 4.0), "")]);
    assert!(lines.unwrap().refuse_unknown().is_ok());
    // Of a region with an inside as well, what is left out is told.
    let half = [("CLOSED_PLANAR", square(1, 4.0), ""), ("OPEN_PLANAR", square(2, 4.0), "")];
    let half = drawn(&[half.as_slice(), &[("", square(0, 4.0), "")]].concat()).unwrap();
    let told = half.rois()[0].partly_open().unwrap().to_string();
    assert!(told.starts_with("2 contour(s) of the region") && told.contains("left out"), "{told}");
    let whole = drawn(&[("CLOSED_PLANAR", square(1, 4.0), "")]).unwrap();
    assert!(whole.rois()[0].partly_open().is_none());
}

/// A structure set whose first region has these contours: what they are, corners, offset.
fn drawn(contours: &[(&str, String, &str)]) -> Result<Structures, supine_dicom::Error> {
    let contours = contours.iter().map(|(kind, corners, offset)| {
        let mut contour = InMemDicomObject::new_empty();
        contour.put_str(tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, *kind);
        contour.put_str(tags::CONTOUR_DATA, VR::DS, corners.as_str());
        if !offset.is_empty() {
            contour.put_str(Tag(0x3006, 0x0045), VR::DS, *offset);
        }
        contour
    });
    let contours = DataSetSequence::from(contours.collect::<Vec<_>>());
    let mut drawn = InMemDicomObject::new_empty();
    drawn.put_str(tags::REFERENCED_ROI_NUMBER, VR::IS, "1");
    drawn.put(DataElement::new(tags::CONTOUR_SEQUENCE, VR::SQ, contours));
    let items = DataSetSequence::from(vec![drawn]);
    changed(|object| {
        object.put(DataElement::new(tags::ROI_CONTOUR_SEQUENCE, VR::SQ, items));
    })
}

/// The message of the error that a structure set with this contour gives.
fn refused(contour_data: &str) -> String {
    match drawn(&[("CLOSED_PLANAR", contour_data.to_owned(), "")]) {
        Err(error) => error.to_string(),
        Ok(s) => message(&s, "Outline", FRAME),
    }
}

/// A square about the middle of slice `k`, half its side in voxels.
fn square(k: usize, half: f64) -> String {
    let [ni, nj, _] = grid().size();
    let middle = [0.5 * ni as f64 + 0.3, 0.5 * nj as f64 + 0.3];
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| {
        let p = grid().patient_from_index([middle[0] + x, middle[1] + y, k as f64]);
        format!("{}\\{}\\{}", p.x, p.y, p.z)
    });
    corners.join("\\")
}

#[test]
fn a_contour_drawn_twice_counts_once_and_is_told() {
    let closed = |half| ("CLOSED_PLANAR", square(1, half), "");
    let filled = |contours: &[(&str, String, &str)]| mask(&drawn(contours).unwrap(), "Outline");
    let (once, warnings) = filled(&[closed(4.0)]);
    assert!(warnings.is_empty(), "{warnings:?}");
    for again in [4.0, 4.0 + 1e-3] {
        let (twice, warnings) = filled(&[closed(4.0), closed(again)]);
        assert!(twice == once);
        let told = warnings[0].to_string();
        assert_eq!(warnings[0].code(), "contours-overlap");
        assert!(told.contains("Outline") && told.contains("in 1 plane(s)"), "{told}");
    }
    let xor = |half| ("CLOSEDPLANAR_XOR", square(1, half), "");
    let (none, warnings) = filled(&[xor(4.0), xor(4.0)]);
    assert!(none.data().iter().all(|m| !m) && warnings.len() == 1, "{warnings:?}");
    let (ring, hole) = (filled(&[closed(7.0), closed(2.0)]), filled(&[closed(2.0)]).0);
    assert!(ring == filled(&[xor(7.0), xor(2.0)]));
    let count = |mask: &Volume<bool>| mask.data().iter().filter(|m| **m).count();
    assert_eq!(
        (count(&ring.0), ring.1.len()),
        (count(&filled(&[closed(7.0)]).0) - count(&hole), 0)
    );
}

#[test]
fn a_contour_is_moved_by_its_offset_vector() {
    let z = grid().spacing().z;
    let at = |k: usize, offset: &str| {
        let drawn = drawn(&[("CLOSED_PLANAR", square(k, 4.0), offset)]);
        mask(&drawn.unwrap(), "Outline").0
    };
    assert!(at(1, &format!("0\\0\\{z}")) == at(2, ""));
    assert!(at(1, "0\\0\\0") == at(1, ""));
    let error = drawn(&[("CLOSED_PLANAR", square(1, 4.0), "0\\1.5")]).unwrap_err().to_string();
    assert!(error.contains("Contour Offset Vector") && error.contains("Outline"), "{error}");
}

#[test]
fn a_coordinate_that_is_no_place_is_refused_by_region_slice_and_value() {
    let z = grid().origin().z;
    for (value, told) in [
        ("1e9", "1e9"),
        ("-244262", "-244262.0"),
        ("1e30", "1e30"),
        ("-2442", "-2442.0"),
        ("-20000", "-20000.0"),
    ] {
        let text = refused(&format!("0\\0\\{z}\\9\\0\\{z}\\9\\{value}\\{z}\\0\\9\\{z}"));
        let slice = format!("slice through (0.0, 0.0, {z:.1})");
        assert!([told, "Outline", &slice].iter().all(|part| text.contains(part)), "{text}");
        let s =
            drawn(&[("CLOSED_PLANAR", format!("0\\0\\1\\9\\0\\1\\9\\{value}\\1\\0\\9\\1"), "")]);
        let s = s.unwrap();
        let text = s.enclosed(&s.rois()[0]).unwrap_err().to_string();
        assert!(text.contains(told) && text.contains("Outline"), "{text}");
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

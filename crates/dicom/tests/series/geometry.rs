//! Orders, directions and positions of slices.

use crate::support::{
    Slice, export_params, folder, orient, place, position, put, put_samples, read, refusal, rename,
    six, slices,
};
use dicom_core::{PrimitiveValue, VR};
use dicom_dictionary_std::tags;
use supine_dicom::{Expected, Original, verify_export, write_series};
use supine_space::{Point, Posture, Progress, Vector};

#[test]
fn file_order_does_not_matter() {
    let (plain, ..) = read(folder(&six()).path()).unwrap();
    let mut slices = six();
    slices.reverse();
    slices.swap(1, 4);
    let (shuffled, source, info) = read(folder(&slices).path()).unwrap();
    assert_eq!(plain, shuffled);
    assert_eq!(plain.grid().size(), [256, 256, 6]);
    assert_eq!(plain.grid().spacing(), Vector::new(1.5, 1.5, 3.0));
    assert_eq!(plain.grid().origin(), Point::new(-188.55, -327.55, -624.0));
    assert_eq!(info.slices, 6);
    assert_eq!(source.files().len(), 6);
    assert_eq!((info.warnings.as_slice(), info.patient_position.as_str()), (&[][..], "HFS"));
}

#[test]
fn every_orientation_keeps_every_voxel_where_its_slice_says() {
    // Row and column cosines: head first, feet first, prone, decubitus, reversed, oblique.
    for cosines in [
        "1\\0\\0\\0\\1\\0",
        "-1\\0\\0\\0\\1\\0",
        "-1\\0\\0\\0\\-1\\0",
        "0\\1\\0\\-1\\0\\0",
        "1\\0\\0\\0\\-1\\0",
        "0.8\\0.6\\0\\-0.36\\0.48\\0.8",
    ] {
        let c: Vec<f64> = cosines.split('\\').map(|t| t.parse().unwrap()).collect();
        let (row, column) = (Vector::new(c[0], c[1], c[2]), Vector::new(c[3], c[4], c[5]));
        let normal = row.cross(&column);
        let origin = Point::new(12.5, -7.25, 3.0);
        let mut slices = six();
        for (n, slice) in slices.iter_mut().enumerate() {
            orient(slice, cosines);
            // Against the normal, so that the order must come from the positions.
            place(slice, (origin - normal * (2.5 * n as f64)).coords.into());
        }
        let (plain, ..) = read(folder(&six()).path()).unwrap();
        let (ct, source, _) = read(folder(&slices).path()).unwrap();
        assert!((ct.grid().spacing() - Vector::new(1.5, 1.5, 2.5)).norm() < 1e-9, "{cosines}");
        assert_eq!(source.files(), ["5.dcm", "4.dcm", "3.dcm", "2.dcm", "1.dcm", "0.dcm"]);
        for (i, j, k) in [(0, 0, 0), (255, 3, 1), (17, 255, 5), (130, 70, 3)] {
            let expected = origin - normal * (2.5 * (5 - k) as f64)
                + row * (1.5 * i as f64)
                + column * (1.5 * j as f64);
            assert!((ct.grid().centre([i, j, k]) - expected).norm() < 1e-9, "{cosines}");
            assert_eq!(ct.at([i, j, k]), plain.at([i, j, 5 - k]), "{cosines}");
        }
    }
}

#[test]
fn unequal_pixel_spacings_keep_their_order() {
    let mut slices = six();
    slices.iter_mut().for_each(|s| put(s, tags::PIXEL_SPACING, VR::DS, "1.5\\1.25"));
    let (ct, ..) = read(folder(&slices).path()).unwrap();
    assert_eq!(ct.grid().spacing(), Vector::new(1.25, 1.5, 3.0));
}

#[test]
fn a_missing_slice_is_named_with_its_gap() {
    let mut slices = six();
    slices.remove(3);
    let message = refusal(&slices);
    assert!(message.contains("gap of 6.000 mm between 2.dcm and 3.dcm"), "{message}");
    assert!(message.contains("3.000 mm"), "{message}");
}

#[test]
fn unequal_steps_and_duplicates_are_refused() {
    let mut slices = six();
    for slice in &mut slices[3..] {
        let [x, y, z] = position(slice);
        place(slice, [x, y, z + 1.0]);
    }
    assert!(refusal(&slices).contains("not equally spaced: 4.000 mm"), "{}", refusal(&slices));

    let mut slices = six();
    slices.push(six().remove(2));
    let message = refusal(&slices);
    assert!(message.contains("2.dcm and 6.dcm: they are the same image"), "{message}");

    let mut slices = six();
    let there = position(&slices[2]);
    place(&mut slices[3], there);
    let message = refusal(&slices);
    assert!(message.contains("same position: 2.dcm and 3.dcm"), "{message}");
    put(&mut slices[3], tags::ACQUISITION_NUMBER, VR::IS, "2");
    assert!(refusal(&slices).contains("several acquisitions"), "{}", refusal(&slices));

    let mut slices = six();
    let mut again = six().remove(2);
    rename(&mut again, "2.25.8");
    slices.push(again);
    let message = refusal(&slices);
    assert!(message.contains("their pixels are equal; remove one copy"), "{message}");
}

#[test]
fn phases_that_alternate_are_refused_even_where_they_make_even_steps() {
    for tag in [tags::ACQUISITION_NUMBER, tags::TEMPORAL_POSITION_IDENTIFIER] {
        let mut slices = six();
        let mut number = |n: usize, value: &str| put(&mut slices[n], tag, VR::IS, value);
        for n in 0..6 {
            number(n, if n % 2 == 0 { "1" } else { "2" });
        }
        let message = refusal(&slices);
        assert!(message.contains("several acquisitions"), "{message}");
        assert!(message.contains("in 1.dcm and 2.dcm"), "{message}");
        // One station after the other is how a long scan is made.
        for n in 0..6 {
            put(&mut slices[n], tag, VR::IS, if n < 3 { "1" } else { "2" });
        }
        read(folder(&slices).path()).unwrap();
    }
}

#[test]
fn positions_rounded_to_a_tenth_are_taken_with_a_warning() {
    let mut slices = six();
    for (n, slice) in slices.iter_mut().enumerate() {
        let z = ((-120.7 + 0.625 * n as f64) * 10.0).round() / 10.0;
        place(slice, [0.0, 0.0, z]);
    }
    let (ct, _, info) = read(folder(&slices).path()).unwrap();
    assert!((ct.grid().spacing().z - 0.625).abs() < 0.01);
    assert!(info.warnings.iter().any(|w| w.to_string().contains("rounded")), "{:?}", info.warnings);
}

#[test]
fn gantry_tilt_is_refused() {
    let mut slices = six();
    slices.iter_mut().for_each(|s| orient(s, "1\\0\\0\\0\\0.984807753\\0.173648178"));
    let message = refusal(&slices);
    assert!(message.contains("gantry tilt") && message.contains(".dcm"), "{message}");
    // 15 mm along the table, tilted by 10 degrees.
    assert!(message.contains("10.00 degrees") && message.contains("2.605 mm"), "{message}");
}

/// So many small slices 0.6 mm apart, sheared by an angle along a row; `change` gets each position.
fn sheared(count: usize, degrees: f64, change: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> Vec<Slice> {
    let one = &mut slices(40, 1)[0];
    put_samples(one, (0..256).map(|n| if n % 2 == 0 { 24 } else { 1024 }).collect());
    put(one, tags::ROWS, VR::US, PrimitiveValue::from(16u16));
    put(one, tags::COLUMNS, VR::US, PrimitiveValue::from(16u16));
    let slice = |n: usize| {
        let mut slice = one.clone();
        let z = 0.6 * n as f64;
        place(&mut slice, change(n, [z * degrees.to_radians().tan(), 0.0, z]));
        rename(&mut slice, &format!("2.25.{}", n + 1));
        slice
    };
    (0..count).map(slice).collect()
}

#[test]
fn a_small_tilt_of_many_thin_slices_is_refused() {
    let message = refusal(&sheared(400, 1.2, |_, p| p));
    assert!(message.contains("leans 1.20 degrees"), "{message}");
    assert!(message.contains("399.dcm lies 5.015 mm beside"), "{message}");
}

#[test]
fn a_lean_that_does_not_matter_is_read_exported_and_verified() {
    for rounded in [false, true] {
        let round = |c: f64| if rounded { (c * 10.0).round() / 10.0 } else { c };
        let given = folder(&sheared(400, 0.05, |_, p| p.map(round)));
        let (ct, source, _) = read(given.path()).unwrap();
        let out = tempfile::TempDir::new().unwrap();
        let dir = out.path().join("ct");
        write_series(&ct, &source, &export_params(&source), &dir, Progress::none()).unwrap();
        let checks = verify_export(
            &dir,
            Some(Original::Files(given.path())),
            Expected::default(),
            Progress::none(),
        );
        let c4 = checks.unwrap().checks.into_iter().find(|c| c.rule.starts_with("C4")).unwrap();
        assert_eq!(c4.passed, Some(true), "{}", c4.detail);
    }
}

#[test]
fn one_slice_aside_is_named() {
    let aside = |n, [x, y, z]: [f64; 3]| [if n == 11 { x + 0.3 } else { x }, y, z];
    let message = refusal(&sheared(40, 0.0, aside));
    assert!(message.starts_with("11.dcm lies 0.288 mm beside the line"), "{message}");
}

#[test]
fn slices_that_disagree_are_named() {
    type Change = fn(&mut Slice);
    let changes: [(Change, &str); 8] = [
        (|s| put(s, tags::FRAME_OF_REFERENCE_UID, VR::UI, "2.25.5"), "Frame of Reference UID"),
        (|s| orient(s, "1\\0\\0\\0\\0.9998\\0.02"), "Image Orientation"),
        (|s| put(s, tags::PIXEL_SPACING, VR::DS, "1.5\\1.4"), "Pixel Spacing"),
        (|s| put(s, tags::PATIENT_ID, VR::LO, "secret"), "Patient ID"),
        (|s| put(s, tags::PATIENT_NAME, VR::PN, "secret"), "Patient's Name"),
        (|s| put(s, tags::STUDY_INSTANCE_UID, VR::UI, "2.25.6"), "Study Instance UID"),
        (|s| put(s, tags::PATIENT_POSITION, VR::CS, "FFS"), "Patient Position"),
        (|s| put(s, tags::CONVOLUTION_KERNEL, VR::SH, "B70"), "Convolution Kernel"),
    ];
    for (change, attribute) in changes {
        let mut slices = six();
        change(&mut slices[2]);
        let message = refusal(&slices);
        assert!(message.starts_with(attribute), "{message}");
        assert!(message.contains("0.dcm and 2.dcm"), "{message}");
        assert!(!message.contains("secret") && !message.contains("PHANTOM"), "{message}");
    }
}

/// As some programs write a series anew: 275 of 275 slices had a frame of reference of their own.
#[test]
fn slices_with_a_frame_each_are_one_series_when_all_else_agrees() {
    let framed = || {
        let mut slices = six();
        for (n, slice) in slices.iter_mut().enumerate() {
            put(slice, tags::FRAME_OF_REFERENCE_UID, VR::UI, format!("2.25.{}", n + 5));
        }
        slices
    };
    let (plain, ..) = read(folder(&six()).path()).unwrap();
    let series = folder(&framed());
    let (ct, source, info) = read(series.path()).unwrap();
    assert_eq!(ct, plain);
    let codes: Vec<&str> = info.warnings.iter().map(|w| w.code()).collect();
    assert_eq!(codes, ["frame-of-reference-per-slice"]);
    // The export has one frame for all.
    let out = tempfile::TempDir::new().unwrap();
    let dir = out.path().join("ct");
    write_series(&ct, &source, &export_params(&source), &dir, Progress::none()).unwrap();
    let original = Some(Original::Files(series.path()));
    let checks = verify_export(&dir, original, Expected::default(), Progress::none()).unwrap();
    let failed: Vec<_> = checks.checks.iter().filter(|c| c.passed == Some(false)).collect();
    assert!(failed.is_empty(), "{failed:?}");
    // Two of them with the same one are two scans; another acquisition is another scan.
    let mut slices = framed();
    put(&mut slices[3], tags::FRAME_OF_REFERENCE_UID, VR::UI, "2.25.5");
    assert!(refusal(&slices).starts_with("Frame of Reference UID"));
    let mut slices = framed();
    put(&mut slices[3], tags::ACQUISITION_NUMBER, VR::IS, "7");
    assert!(refusal(&slices).starts_with("Acquisition Number"), "{}", refusal(&slices));
}

#[test]
fn unusable_geometry_is_refused_by_attribute() {
    let change = |tag, value: &'static str| {
        let mut slices = six();
        put(&mut slices[4], tag, VR::DS, value);
        refusal(&slices)
    };
    for (tag, value, expected) in [
        (tags::PIXEL_SPACING, "0\\0", "Pixel Spacing is 0 x 0 mm"),
        (tags::PIXEL_SPACING, "1,5\\1,25", "Pixel Spacing is \"1,5"),
        (tags::PIXEL_SPACING, "1.5", "not 2 decimal"),
        (tags::IMAGE_POSITION_PATIENT, "", "Image Position (Patient) is missing"),
        (tags::IMAGE_POSITION_PATIENT, "1\\2\\nan", "Image Position (Patient) is"),
        (tags::IMAGE_ORIENTATION_PATIENT, "1.02\\0\\0\\0\\1\\0", "not unit vectors"),
        (tags::IMAGE_ORIENTATION_PATIENT, "1\\0\\0\\1\\0\\0", "right angles"),
    ] {
        let message = change(tag, value);
        assert!(message.starts_with("4.dcm: ") && message.contains(expected), "{message}");
    }
}

#[test]
fn a_position_that_is_not_known_is_a_warning() {
    for (position, told) in [("HFP", false), ("SITTING", true)] {
        let mut slices = six();
        slices.iter_mut().for_each(|s| put(s, tags::PATIENT_POSITION, VR::CS, position));
        let (.., info) = read(folder(&slices).path()).unwrap();
        let named = info.warnings.iter().any(|w| w.to_string().contains(position));
        assert_eq!(named, told, "{:?}", info.warnings);
    }
}

#[test]
fn a_patient_who_lay_otherwise_than_is_taken_is_named() {
    let otherwise = supine_dicom::lay_otherwise;
    for (position, how) in [("HFP", "prone"), ("FFP", "prone"), ("HFDR", "right"), ("FFDL", "left")]
    {
        let told = otherwise(position, Posture::Supine);
        assert!(told.is_some_and(|why| why.contains(how) && why.contains(position)), "{position}");
    }
    assert_eq!(otherwise("FFP", Posture::Prone), None);
    assert_eq!(otherwise("HFS", Posture::Upright), None);
    assert!(otherwise("HFS", Posture::Prone).unwrap().contains("position = \"supine\""));
    for position in ["HFS", "FFS", "", "H", "HFSU", "é", "SITTING"] {
        assert_eq!(otherwise(position, Posture::Supine), None, "{position}");
    }
}

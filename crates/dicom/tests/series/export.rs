//! Writing a series and reading it again.

use crate::support::{
    Slice, contents, deformed, export_params, folder, orient, put, put_samples, read, six, slices,
    stored, text,
};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use dicom_object::open_file;
use std::path::Path;
use supine_dicom::{Error, ExportParams, Source, WriteInfo, write_series};
use supine_space::{Failure, Progress};
use supine_volume::Ct;
use tempfile::TempDir;

struct Export {
    source_dir: TempDir,
    source: Source,
    ct: Ct,
    out: TempDir,
    info: WriteInfo,
}

impl Export {
    fn dir(&self) -> std::path::PathBuf {
        self.out.path().join("ct")
    }
}

fn export(slices: &[Slice]) -> Export {
    let source_dir = folder(slices);
    let (ct, source, _) = read(source_dir.path()).unwrap();
    let ct = deformed(&ct);
    let out = TempDir::new().unwrap();
    let dir = out.path().join("ct");
    let info = write_series(&ct, &source, &export_params(&source), &dir, Progress::none()).unwrap();
    Export { source_dir, source, ct, out, info }
}

#[test]
fn what_is_written_reads_back_equal_and_is_marked_as_derived() {
    let e = export(&six());
    let (again, _, info) = read(&e.dir()).unwrap();
    assert_eq!(again, e.ct);
    assert_eq!(info.warnings, []);
    assert_eq!(info.series_uid, e.info.series_uid);
    assert_eq!(e.info.files.len(), 6);
    assert!(e.info.source_encoding);

    let first = open_file(e.dir().join("CT0001.dcm")).unwrap();
    let source = &six()[0];
    for tag in [
        tags::PATIENT_NAME,
        tags::PATIENT_ID,
        tags::STUDY_INSTANCE_UID,
        tags::IMAGE_POSITION_PATIENT,
        tags::IMAGE_ORIENTATION_PATIENT,
        tags::PIXEL_SPACING,
        tags::SLICE_THICKNESS,
        tags::PATIENT_POSITION,
        tags::ACQUISITION_TIME,
    ] {
        assert_eq!(text(&first, tag), text(source, tag), "{tag}");
    }
    for tag in [
        tags::SERIES_INSTANCE_UID,
        tags::SOP_INSTANCE_UID,
        tags::FRAME_OF_REFERENCE_UID,
        tags::SERIES_NUMBER,
        tags::MANUFACTURER_MODEL_NAME,
    ] {
        assert_ne!(text(&first, tag), text(source, tag), "{tag}");
    }
    assert_eq!(text(&first, tags::IMAGE_TYPE), "DERIVED\\SECONDARY\\AXIAL");
    assert_eq!(first.meta().transfer_syntax.trim_end_matches('\0'), "1.2.840.10008.1.2.1");
    assert!(first.element(tags::EXPOSURE).is_err());
    // Slice 1 may have taken from itself and, within 3 mm and a step, its two next neighbours.
    let images = first.element(tags::SOURCE_IMAGE_SEQUENCE).unwrap().items().unwrap();
    assert_eq!(images.len(), 3);
}

#[test]
fn the_same_export_has_the_same_bytes_for_any_number_of_threads() {
    let e = export(&six());
    let params = export_params(&e.source);
    let again = |params: &ExportParams, threads: usize| {
        let out = TempDir::new().unwrap();
        let dir = out.path().join("again");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| write_series(&e.ct, &e.source, params, &dir, Progress::none())).unwrap();
        contents(&dir)
    };
    let first = contents(&e.dir());
    assert!(first == again(&params, 1) && first == again(&params, 2));
    // What made the volume and the clock go into the identity.
    let mut other = params.clone();
    other.identity[0] ^= 1;
    assert!(first[0].1 != again(&other, 2)[0].1);
    let mut other = params.clone();
    other.clock.time = "101112".into();
    let series = |contents: &[(std::path::PathBuf, Vec<u8>)]| {
        let object = dicom_object::from_reader(&contents[0].1[..]).unwrap();
        text(&object, tags::SERIES_INSTANCE_UID)
    };
    assert_ne!(series(&first), series(&again(&other, 2)));
}

#[test]
fn reversed_feet_first_and_oblique_series_keep_their_order_and_strings() {
    for cosines in ["-1\\0\\0\\0\\1\\0", "0.8\\0.6\\0\\-0.36\\0.48\\0.8"] {
        let mut slices = six();
        let c: Vec<f64> = cosines.split('\\').map(|t| t.parse().unwrap()).collect();
        let row = supine_space::Vector::new(c[0], c[1], c[2]);
        let normal = row.cross(&supine_space::Vector::new(c[3], c[4], c[5]));
        for (n, slice) in slices.iter_mut().enumerate() {
            orient(slice, cosines);
            let p = normal * (-2.5 * n as f64);
            crate::support::place(slice, p.into());
        }
        let e = export(&slices);
        let (again, ..) = read(&e.dir()).unwrap();
        assert_eq!(again, e.ct, "{cosines}");
        // Instance numbers grow as in the source: against the normal here.
        for (n, slice) in slices.iter().enumerate() {
            let written = open_file(e.dir().join(format!("CT{:04}.dcm", n + 1))).unwrap();
            for tag in [tags::IMAGE_POSITION_PATIENT, tags::IMAGE_ORIENTATION_PATIENT] {
                assert_eq!(text(&written, tag).trim(), text(slice, tag).trim(), "{cosines}");
            }
        }
    }
}

#[test]
fn values_that_the_source_cannot_hold_get_sixteen_bits() {
    let mut e = export(&six());
    e.ct.data_mut()[1000] = 20_000;
    let dir = e.out.path().join("wide");
    let info = write_series(&e.ct, &e.source, &export_params(&e.source), &dir, Progress::none());
    assert!(!info.unwrap().source_encoding);
    let (again, ..) = read(&dir).unwrap();
    assert_eq!(again, e.ct);
}

#[test]
fn padding_of_the_source_is_written_back_where_nothing_moved() {
    let mut slices = six();
    let stored = stored(&slices);
    for (slice, mut samples) in slices.iter_mut().zip(stored) {
        put(slice, tags::BITS_STORED, VR::US, 16u16);
        put(slice, tags::HIGH_BIT, VR::US, 15u16);
        put(slice, tags::PIXEL_REPRESENTATION, VR::US, 1u16);
        samples[..256].fill(-1976i16 as u16);
        put_samples(slice, samples);
    }
    let e = export(&slices);
    let written = open_file(e.dir().join("CT0002.dcm")).unwrap();
    let bytes = written.element(tags::PIXEL_DATA).unwrap().to_bytes().unwrap();
    assert_eq!(bytes[..2], (-1976i16).to_le_bytes(), "-3000 HU in the source");
    let (again, ..) = read(&e.dir()).unwrap();
    assert_eq!(again, e.ct);
}

#[test]
fn over_long_decimal_strings_are_written_anew() {
    let mut slices = six();
    slices.iter_mut().for_each(|s| {
        put(s, tags::PIXEL_SPACING, VR::DS, "1.50000000000000000001\\1.2500000000000000001");
    });
    let e = export(&slices);
    let written = open_file(e.dir().join("CT0001.dcm")).unwrap();
    assert_eq!(text(&written, tags::PIXEL_SPACING).trim(), "1.5\\1.25");
}

#[test]
fn texts_that_do_not_fit_are_refused_before_anything_is_written() {
    let e = export(&six());
    let good = export_params(&e.source);
    type Change = fn(&mut ExportParams);
    let changes: [(Change, &str); 6] = [
        (|p| p.series_description = format!("DEFORMED {}", "x".repeat(60)), "Series Description"),
        (|p| p.series_description = "warped".into(), "Series Description"),
        (|p| p.derivation = "x".repeat(1025), "Derivation Description"),
        (|p| p.image_comments = "gr\u{fc}n".into(), "Image Comments"),
        (|p| p.software_version = "1\\2".into(), "Software Versions"),
        (|p| p.clock.date = "2026-03-10".into(), "Content Date"),
    ];
    for (change, attribute) in changes {
        let mut params = good.clone();
        change(&mut params);
        let dir = e.out.path().join("refused");
        let error = write_series(&e.ct, &e.source, &params, &dir, Progress::none()).unwrap_err();
        assert!(error.to_string().starts_with(attribute), "{error}");
        assert!(!dir.exists());
    }
}

#[test]
fn another_grid_is_refused() {
    let e = export(&six());
    let (other, ..) = read(folder(&slices(41, 6)).path()).unwrap();
    let dir = e.out.path().join("other");
    let error = write_series(&other, &e.source, &export_params(&e.source), &dir, Progress::none());
    let error = error.unwrap_err();
    assert!(matches!(error, Error::OtherGrid { .. }), "{error}");
    assert!(error.to_string().contains("3.000 mm"), "{error}");
}

#[test]
fn an_earlier_export_is_replaced_and_anything_else_is_left() {
    let e = export(&six());
    let params = export_params(&e.source);
    let before = contents(&e.dir());
    std::fs::write(e.dir().join("CT0099.dcm"), "stale").unwrap();
    write_series(&e.ct, &e.source, &params, &e.dir(), Progress::none()).unwrap();
    assert!(contents(&e.dir()) == before);

    std::fs::write(e.dir().join("notes.txt"), "mine").unwrap();
    let error = write_series(&e.ct, &e.source, &params, &e.dir(), Progress::none()).unwrap_err();
    assert!(matches!(error, Error::Occupied { .. }) && error.kind() == Failure::Output);
    assert!(contents(&e.dir()).len() == before.len() + 1);
    drop(e.source_dir);
}

#[test]
fn a_place_that_cannot_be_written_and_a_stop_leave_nothing() {
    let e = export(&six());
    let params = export_params(&e.source);
    let file = e.out.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = write_series(&e.ct, &e.source, &params, &file.join("ct"), Progress::none());
    assert_eq!(error.unwrap_err().kind(), Failure::Output);

    let dir = e.out.path().join("stopped");
    let sink = |share: f64| share < 0.6;
    let error = write_series(&e.ct, &e.source, &params, &dir, Progress::new(&sink)).unwrap_err();
    assert_eq!(error.kind(), Failure::Stopped);
    let left: Vec<_> = std::fs::read_dir(e.out.path()).unwrap().collect();
    assert_eq!(left.len(), 2, "{left:?}: the export and the file only");
    assert!(!Path::new(&dir).exists());
}

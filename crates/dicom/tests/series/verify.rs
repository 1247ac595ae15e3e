//! Planted defects: what verify-export finds, and that a good export has none.

use crate::support::{
    Slice, deformed, export_params, folder, orient, place, position, put, put_samples, read,
    refusal, rename, slices, stored, text,
};
use dicom_core::VR;
use dicom_core::value::DataSetSequence;
use dicom_core::{DataElement, PrimitiveValue, Tag, dicom_value};
use dicom_dictionary_std::tags;
use dicom_object::{InMemDicomObject, open_file};
use std::path::Path;
use supine_dicom::{
    Accept, Expected, ExportParams, Original, Policy, ReadParams, Verification, read_series,
    verify_export, write_series,
};
use supine_space::Progress;
use supine_volume::Ct;
use tempfile::TempDir;

const OTHER: &str = "2.25.123456789012345678901234567890";

struct Good {
    source: TempDir,
    source_slices: Vec<Slice>,
    out: TempDir,
    slices: Vec<Slice>,
}

fn good() -> Good {
    let source_slices = slices(36, 8);
    let source = folder(&source_slices);
    let (ct, series, _) = read(source.path()).unwrap();
    let out = TempDir::new().unwrap();
    let dir = out.path().join("ct");
    write_series(&deformed(&ct), &series, &export_params(&series), &dir, Progress::none()).unwrap();
    let slices = (1..9).map(|n| open_file(dir.join(format!("CT000{n}.dcm"))).unwrap()).collect();
    Good { source, source_slices, out, slices }
}

fn verify(dir: &Path, source: Option<&Path>) -> Verification {
    verify_export(dir, source.map(Original::Files), Expected::default(), Progress::none()).unwrap()
}

/// The numbers of the broken rules.
fn broken(v: &Verification) -> Vec<&str> {
    v.failures().map(|c| c.rule.split(' ').next().unwrap()).collect()
}

#[test]
fn a_good_export_passes_and_says_what_needs_the_source() {
    let good = good();
    let dir = good.out.path().join("ct");
    let with = verify(&dir, Some(good.source.path()));
    assert!(with.passed(), "{:?}", broken(&with));
    assert!(with.checks.iter().all(|c| c.passed.is_some()) && with.files == 8);
    let (ct, source, _) = read(good.source.path()).unwrap();
    let held = Some(Original::Read { ct: &ct, source: &source });
    let held = verify_export(&dir, held, Expected::default(), Progress::none()).unwrap();
    assert_eq!(held, with, "a source in memory is as good as its files");
    let without = verify(&dir, None);
    assert!(without.passed() && !without.with_source);
    let unchecked: Vec<&str> = without
        .checks
        .iter()
        .filter(|c| c.passed.is_none())
        .map(|c| c.rule.split(' ').next().unwrap())
        .collect();
    let expected =
        ["B2", "B3", "B4", "C8", "C9", "D5", "D6", "D7", "D8", "D9", "E4b", "E11", "E12"];
    assert_eq!(unchecked, expected);
}

#[test]
fn the_source_is_found_among_several_series() {
    let good = good();
    let mut others = slices(60, 8);
    for (n, slice) in others.iter_mut().enumerate() {
        put(slice, tags::SERIES_INSTANCE_UID, VR::UI, "2.25.9");
        rename(slice, &format!("2.25.9.{n}"));
        slice.write_to_file(good.source.path().join(format!("other{n}.dcm"))).unwrap();
    }
    let v = verify(&good.out.path().join("ct"), Some(good.source.path()));
    assert!(v.passed(), "{:?}", broken(&v));
}

fn each(slices: &mut [Slice], change: impl Fn(&mut Slice)) {
    slices.iter_mut().for_each(change);
}

fn samples(slice: &Slice) -> Vec<u16> {
    slice.element(tags::PIXEL_DATA).unwrap().to_multi_int().unwrap()
}

fn no(slice: &mut Slice, tag: Tag) {
    slice.remove_element(tag);
}

fn copy_of(slice: &Slice, tag: Tag) -> String {
    text(slice, tag).trim_end_matches(['\0', ' ']).to_owned()
}

fn item(slice: &Slice, tag: Tag) -> InMemDicomObject {
    slice.element(tag).unwrap().items().unwrap()[0].clone()
}

fn put_item(slice: &mut Slice, tag: Tag, item: InMemDicomObject) {
    slice.put(DataElement::new(tag, VR::SQ, DataSetSequence::from(vec![item])));
}

type Plant = fn(&mut Vec<Slice>, &[Slice]);

/// Defect, a rule that must break, how it is planted (export, source).
const IDENTITY: &[(&str, &str, Plant)] = &[
    ("frame differs in one slice", "B1", |d, _| {
        put(&mut d[5], tags::FRAME_OF_REFERENCE_UID, VR::UI, OTHER);
    }),
    ("frame of the source", "B4", |d, s| {
        let frame = copy_of(&s[0], tags::FRAME_OF_REFERENCE_UID);
        each(d, |d| put(d, tags::FRAME_OF_REFERENCE_UID, VR::UI, frame.as_str()));
    }),
    ("instance twice", "A3", |d, _| {
        let uid = copy_of(&d[4], tags::SOP_INSTANCE_UID);
        rename(&mut d[5], &uid);
    }),
    ("instance of the source", "B3", |d, s| {
        rename(&mut d[5], &copy_of(&s[5], tags::SOP_INSTANCE_UID));
    }),
    ("series of the source", "B3", |d, s| {
        let uid = copy_of(&s[0], tags::SERIES_INSTANCE_UID);
        each(d, |d| put(d, tags::SERIES_INSTANCE_UID, VR::UI, uid.as_str()));
    }),
    ("another study", "B2", |d, _| each(d, |d| put(d, tags::STUDY_INSTANCE_UID, VR::UI, OTHER))),
    ("another patient", "B2", |d, _| each(d, |d| put(d, tags::PATIENT_NAME, VR::PN, "Other^Name"))),
    ("another ID in one slice", "B1", |d, _| put(&mut d[3], tags::PATIENT_ID, VR::LO, "X")),
    ("file header names another", "A2", |d, _| {
        d[3].meta_mut().media_storage_sop_instance_uid = OTHER.to_owned();
    }),
    ("leading zero", "A4", |d, _| {
        each(d, |d| put(d, tags::SERIES_INSTANCE_UID, VR::UI, "2.25.0123456"));
    }),
    ("long UID", "A4", |d, _| {
        let uid = format!("2.25.{}", "1".repeat(62));
        each(d, |d| put(d, tags::SERIES_INSTANCE_UID, VR::UI, uid.as_str()));
    }),
    ("long description", "A4", |d, _| {
        let text = format!("DEFORMED {}", "x".repeat(60));
        each(d, |d| put(d, tags::SERIES_DESCRIPTION, VR::LO, text.as_str()));
    }),
    ("long number", "A4", |d, _| {
        each(d, |d| put(d, tags::PIXEL_SPACING, VR::DS, "1.50000000000000000001\\1.5"));
    }),
    ("decimal comma", "A4", |d, _| each(d, |d| put(d, tags::PIXEL_SPACING, VR::DS, "1,5\\1,5"))),
    ("wrong VR", "A4", |d, _| put(&mut d[0], tags::PATIENT_ID, VR::PN, "PH0143")),
    ("wrong character set", "A5", |d, _| {
        each(d, |d| put(d, tags::STUDY_DESCRIPTION, VR::LO, "Br\u{fc}ste"));
        each(d, |d| put(d, tags::SPECIFIC_CHARACTER_SET, VR::CS, "ISO_IR 192"));
        // As Latin-1 bytes under the name of UTF-8.
        each(d, |d| {
            put(
                d,
                tags::STUDY_DESCRIPTION,
                VR::LO,
                PrimitiveValue::U8((*b"Br\xFCste").as_slice().into()),
            )
        });
    }),
];

const GEOMETRY: &[(&str, &str, Plant)] = &[
    ("cosines swapped", "C8", |d, _| each(d, |d| orient(d, "0\\1\\0\\1\\0\\0"))),
    ("cosines not unit", "C1", |d, _| each(d, |d| orient(d, "1.02\\0\\0\\0\\1\\0"))),
    ("row mirrored", "C8", |d, _| each(d, |d| orient(d, "-1\\0\\0\\0\\1\\0"))),
    ("one slice turned", "B5", |d, _| orient(&mut d[6], "1\\0\\0\\0\\0.9998\\0.02")),
    ("spacing changed", "C8", |d, _| each(d, |d| put(d, tags::PIXEL_SPACING, VR::DS, "1.4\\1.5"))),
    ("inner slice missing", "C3", |d, _| drop(d.remove(4))),
    ("first slice missing", "C8", |d, _| drop(d.remove(0))),
    ("position twice", "C2", |d, _| {
        let there = position(&d[3]);
        place(&mut d[4], there);
    }),
    ("positions reversed", "C9", |d, _| {
        let places: Vec<_> = d.iter().rev().map(position).collect();
        d.iter_mut().zip(places).for_each(|(d, p)| place(d, p));
    }),
    ("sheared", "C4", |d, _| {
        for (k, d) in d.iter_mut().enumerate() {
            let [x, y, z] = position(d);
            place(d, [x + 0.3 * k as f64, y, z]);
        }
    }),
    ("half a voxel off", "C8", |d, _| {
        each(d, |d| {
            let [x, y, z] = position(d);
            place(d, [x + 0.75, y, z]);
        });
    }),
    ("instance number twice", "C5", |d, _| put(&mut d[4], tags::INSTANCE_NUMBER, VR::IS, "4")),
    ("stale slice location", "C6", |d, _| put(&mut d[4], tags::SLICE_LOCATION, VR::DS, "0")),
    ("thickness changed", "C8", |d, _| each(d, |d| put(d, tags::SLICE_THICKNESS, VR::DS, "5"))),
];

const PIXELS: &[(&str, &str, Plant)] = &[
    ("flipped along k", "D7", |d, _| {
        let all: Vec<_> = d.iter().rev().map(samples).collect();
        d.iter_mut().zip(all).for_each(|(d, s)| put_samples(d, s));
    }),
    ("flipped along i", "D9", |d, _| {
        each(d, |d| {
            let mut s = samples(d);
            s.chunks_mut(256).for_each(<[u16]>::reverse);
            put_samples(d, s);
        });
    }),
    ("two inner slices exchanged", "D8", |d, _| {
        let (a, b) = (samples(&d[1]), samples(&d[6]));
        put_samples(&mut d[1], b);
        put_samples(&mut d[6], a);
    }),
    ("intercept", "D5", |d, _| each(d, |d| put(d, tags::RESCALE_INTERCEPT, VR::DS, "0"))),
    ("intercept of one slice", "B5", |d, _| {
        put(&mut d[2], tags::RESCALE_INTERCEPT, VR::DS, "-1000")
    }),
    ("no rescale", "D1", |d, _| each(d, |d| no(d, tags::RESCALE_SLOPE))),
    ("sign", "D3", |d, _| {
        each(d, |d| {
            let s = samples(d).iter().map(|v| v.wrapping_sub(1024)).collect();
            put(d, tags::RESCALE_INTERCEPT, VR::DS, "0");
            put(d, tags::BITS_STORED, VR::US, 16u16);
            put(d, tags::HIGH_BIT, VR::US, 15u16);
            put_samples(d, s);
        });
    }),
    ("values above Bits Stored", "D4", |d, _| {
        each(d, |d| {
            let s = samples(d).iter().map(|v| v | 0x1000).collect();
            put_samples(d, s);
        });
    }),
    ("high bit", "D1", |d, _| each(d, |d| put(d, tags::HIGH_BIT, VR::US, 15u16))),
    ("bytes swapped", "D3", |d, _| {
        each(d, |d| {
            let s = samples(d).iter().map(|v| v.swap_bytes()).collect();
            put(d, tags::BITS_STORED, VR::US, 16u16);
            put(d, tags::HIGH_BIT, VR::US, 15u16);
            put_samples(d, s);
        });
    }),
    ("pixels cut", "D1", |d, _| {
        let s = samples(&d[2])[128..].to_vec();
        put_samples(&mut d[2], s);
    }),
    ("rows", "D1", |d, _| each(d, |d| put(d, tags::ROWS, VR::US, 128u16))),
];

const DERIVATION: &[(&str, &str, Plant)] = &[
    ("original", "E1", |d, _| {
        each(d, |d| put(d, tags::IMAGE_TYPE, VR::CS, "ORIGINAL\\PRIMARY\\AXIAL"))
    }),
    ("no derivation", "E2", |d, _| each(d, |d| no(d, tags::DERIVATION_DESCRIPTION))),
    ("no derivation code", "E3", |d, _| each(d, |d| no(d, tags::DERIVATION_CODE_SEQUENCE))),
    ("no source images", "E4", |d, _| each(d, |d| no(d, tags::SOURCE_IMAGE_SEQUENCE))),
    ("foreign source image", "E4", |d, _| {
        let mut image = item(&d[3], tags::SOURCE_IMAGE_SEQUENCE);
        image.put(DataElement::new(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, OTHER));
        put_item(&mut d[3], tags::SOURCE_IMAGE_SEQUENCE, image);
    }),
    ("locations preserved", "E4", |d, _| {
        each(d, |d| {
            let mut image = item(d, tags::SOURCE_IMAGE_SEQUENCE);
            image.put(DataElement::new(tags::SPATIAL_LOCATIONS_PRESERVED, VR::CS, "YES"));
            put_item(d, tags::SOURCE_IMAGE_SEQUENCE, image);
        });
    }),
    ("description of the source", "E5", |d, s| {
        let text = copy_of(&s[0], tags::SERIES_DESCRIPTION);
        each(d, |d| put(d, tags::SERIES_DESCRIPTION, VR::LO, text.as_str()));
    }),
    ("equipment of the scanner", "E12", |d, s| {
        let model = copy_of(&s[0], tags::MANUFACTURER_MODEL_NAME);
        each(d, |d| put(d, tags::MANUFACTURER_MODEL_NAME, VR::LO, model.as_str()));
    }),
    ("no contributing equipment", "E6", |d, _| {
        each(d, |d| no(d, tags::CONTRIBUTING_EQUIPMENT_SEQUENCE));
    }),
    ("private left", "E7", |d, _| put(&mut d[1], Tag(9, 0x10), VR::LO, "SCANNER WORKS 1")),
    ("stale range", "E7", |d, _| {
        each(d, |d| put(d, tags::LARGEST_IMAGE_PIXEL_VALUE, VR::US, dicom_value!(U16, 1u16)));
    }),
    ("dose counted twice", "E7", |d, _| each(d, |d| put(d, tags::EXPOSURE, VR::IS, "110"))),
    ("no lossy flag", "E8", |d, _| each(d, |d| no(d, tags::LOSSY_IMAGE_COMPRESSION))),
    ("no content date", "E9", |d, _| each(d, |d| no(d, tags::CONTENT_DATE))),
    ("annotation", "E10", |d, _| each(d, |d| put(d, tags::BURNED_IN_ANNOTATION, VR::CS, "YES"))),
    ("patient position", "E11", |d, _| each(d, |d| put(d, tags::PATIENT_POSITION, VR::CS, "HFP"))),
    ("no version", "E13", |d, _| each(d, |d| no(d, tags::SOFTWARE_VERSIONS))),
];

fn must_find(defects: &[(&str, &str, Plant)]) {
    let good = good();
    for (name, rule, plant) in defects {
        let copies = (1..9).map(|n| open_file(good.out.path().join(format!("ct/CT000{n}.dcm"))));
        let mut slices: Vec<Slice> = copies.map(Result::unwrap).collect();
        plant(&mut slices, &good.source_slices);
        let dir = folder(&slices);
        let v = verify(dir.path(), Some(good.source.path()));
        assert!(broken(&v).contains(rule), "{name}: {:?} instead of {rule}", broken(&v));
    }
    assert_eq!(good.slices.len(), 8);
}

#[test]
fn wrong_identity_is_found() {
    must_find(IDENTITY);
}

#[test]
fn wrong_geometry_is_found() {
    must_find(GEOMETRY);
}

#[test]
fn wrong_pixels_are_found() {
    must_find(PIXELS);
}

#[test]
fn wrong_semantics_are_found() {
    must_find(DERIVATION);
}

#[test]
fn damaged_files_are_found() {
    let good = good();
    let dir = good.out.path().join("ct");
    let path = dir.join("CT0003.dcm");
    let whole = std::fs::read(&path).unwrap();
    for bytes in [&whole[..whole.len() - 100], &whole[132..], &whole[128..], b"text"] {
        std::fs::write(&path, bytes).unwrap();
        let v = verify(&dir, Some(good.source.path()));
        assert!(broken(&v).contains(&"A1"), "{:?}", broken(&v));
    }
}

#[test]
fn what_a_site_asks_for_is_written_and_expected() {
    type Asked = (Policy, &'static str, &'static str);
    let none = Policy::default();
    let cases: [Asked; 3] = [
        (Policy { new_study: true, ..none }, "DEFORMED", "B2"),
        (Policy { keep_equipment: true, ..none }, "DEFORMED", "E12"),
        (Policy { same_frame: true, ..none }, "DEFORMED SAME-FRAME", "B4"),
    ];
    let source_dir = folder(&slices(40, 8));
    let (ct, source, _) = read(source_dir.path()).unwrap();
    for (policy, description, rule) in cases {
        let out = TempDir::new().unwrap();
        let dir = out.path().join("ct");
        let series_description = description.into();
        let params = ExportParams { policy, series_description, ..export_params(&source) };
        write_series(&deformed(&ct), &source, &params, &dir, Progress::none()).unwrap();
        let verify = |policy| {
            let expected = Expected { policy, ..Expected::default() };
            verify_export(
                &dir,
                Some(Original::Files(source_dir.path())),
                expected,
                Progress::none(),
            )
            .unwrap()
        };
        assert!(verify(policy).passed(), "{policy:?} {:?}", broken(&verify(policy)));
        assert_eq!(broken(&verify(none)), [rule], "{policy:?}, not expected");
    }
    // The series must say that it has the source's frame.
    let policy = Policy { same_frame: true, ..none };
    let params = ExportParams { policy, ..export_params(&source) };
    let out = TempDir::new().unwrap();
    let dir = out.path().join("ct");
    write_series(&ct, &source, &params, &dir, Progress::none()).unwrap_err();
}

#[test]
fn slices_at_unequal_steps_are_interpolated_when_asked_and_exported_at_equal_ones() {
    // Every slice but two of those between: a step of 3, then 9, then 3 mm again.
    let sparse = || {
        let mut slices = slices(40, 8);
        slices.drain(3..5);
        slices
    };
    let dir = folder(&sparse());
    let message = refusal(&sparse());
    assert!(
        message.contains("gap of 9.000 mm") && message.contains("--equalise-steps"),
        "{message}"
    );
    let accept = Accept { equalise_steps: true, ..Accept::default() };
    let params = ReadParams { accept, ..ReadParams::default() };
    let (ct, source, info) = read_series(dir.path(), &params, Progress::none()).unwrap();
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("from 6 to 8 slices")),
        "{:?}",
        info.warnings
    );
    let (whole, ..) = read(folder(&slices(40, 8)).path()).unwrap();
    assert_eq!(ct.grid(), whole.grid());
    let per_slice = 256 * 256;
    let slice = |ct: &Ct, k: usize| ct.data()[k * per_slice..(k + 1) * per_slice].to_vec();
    for k in [0, 1, 2, 5, 6, 7] {
        assert!(slice(&ct, k) == slice(&whole, k), "{k}");
    }
    let (below, above) = (slice(&ct, 2), slice(&ct, 5));
    for (n, made) in slice(&ct, 3).into_iter().enumerate() {
        let exact = (2.0 * f64::from(below[n]) + f64::from(above[n])) / 3.0;
        assert!((f64::from(made) - exact).abs() <= 0.5, "{n}");
    }
    let out = TempDir::new().unwrap();
    let export = out.path().join("ct");
    write_series(&deformed(&ct), &source, &export_params(&source), &export, Progress::none())
        .unwrap();
    let verify = |accept| {
        let expected = Expected { accept, ..Expected::default() };
        verify_export(&export, Some(Original::Files(dir.path())), expected, Progress::none())
    };
    let verified = verify(accept).unwrap();
    assert!(verified.passed(), "{:?}", broken(&verified));
    assert!(verify(Accept::default()).is_err(), "the source is not read unasked");
}

#[test]
fn padding_is_clipped_where_a_system_asks_for_it() {
    // The same HU with an intercept of -2000, but for a row of -2000 HU.
    let mut padded = slices(40, 8);
    let samples = stored(&padded);
    for (slice, mut samples) in padded.iter_mut().zip(samples) {
        samples.iter_mut().for_each(|s| *s += 976);
        samples[..40].fill(0);
        put_samples(slice, samples);
        put(slice, tags::RESCALE_INTERCEPT, VR::DS, "-2000");
    }
    let source_dir = folder(&padded);
    let (ct, source, _) = read(source_dir.path()).unwrap();
    let out = TempDir::new().unwrap();
    for (clip_padding, lowest) in [(false, -2000), (true, -1024)] {
        let policy = Policy { clip_padding, ..Policy::default() };
        let params = ExportParams { policy, ..export_params(&source) };
        let dir = out.path().join(format!("clipped-{clip_padding}"));
        write_series(&deformed(&ct), &source, &params, &dir, Progress::none()).unwrap();
        let written: Vec<Slice> =
            (1..9).map(|n| open_file(dir.join(format!("CT000{n}.dcm"))).unwrap()).collect();
        let intercept: i32 = text(&written[0], tags::RESCALE_INTERCEPT).trim().parse().unwrap();
        let raw = |s: &Slice| s.element(tags::PIXEL_DATA).unwrap().to_multi_int::<u16>().unwrap();
        let least = written.iter().flat_map(raw).map(|v| i32::from(v as i16) + intercept).min();
        assert_eq!(least, Some(lowest));
        let expected = Expected { policy, ..Expected::default() };
        let original = Some(Original::Files(source_dir.path()));
        let v = verify_export(&dir, original, expected, Progress::none()).unwrap();
        assert!(v.passed(), "{clip_padding}: {:?}", broken(&v));
    }
}

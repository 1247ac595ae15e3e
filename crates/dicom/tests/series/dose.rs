//! RT doses: every way planes are told, what is refused, and doses written for an exported CT.

use crate::support::{Slice, contents, folder, put, read, six, text};
use dicom_core::value::{DataSetSequence, PixelFragmentSequence};
use dicom_core::{DataElement, PrimitiveValue, VR};
use dicom_dictionary_std::tags;
use dicom_object::{InMemDicomObject, open_file};
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use supine_dicom::{
    CompanionParams, Dose, ObjectReference, Source, is_dose, read_dose, region_object, write_dose,
};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::Volume;
use tempfile::TempDir;

const SIZE: [usize; 3] = [5, 4, 3];
const SPACING: [f64; 3] = [2.0, 1.5, 3.0];
const ORIGIN: [f64; 3] = [10.0, -20.0, 100.0];
const CLASS: &str = "1.2.840.10008.5.1.4.1.1.481.2";

/// The stored value of a place of the dose, plane by plane along the normal.
fn stored([i, j, k]: [usize; 3]) -> u32 {
    (1 + i + 10 * j + 100 * k) as u32
}

fn frame(k: usize) -> impl Iterator<Item = u32> {
    let [columns, rows, _] = SIZE;
    (0..columns * rows).map(move |n| stored([n % columns, n / columns, k]))
}

fn joined(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join("\\")
}

/// A dose of 32 bits whose frames are these planes, with these offsets.
fn dose(planes: &[usize], offsets: &[f64]) -> Slice {
    let mut d = six().remove(0);
    d.remove_element(tags::RESCALE_SLOPE);
    d.remove_element(tags::RESCALE_INTERCEPT);
    put(&mut d, tags::SOP_CLASS_UID, VR::UI, CLASS);
    d.meta_mut().media_storage_sop_class_uid = CLASS.into();
    d.meta_mut().transfer_syntax = "1.2.840.10008.1.2.1".into();
    for (tag, vr, text) in [
        (tags::MODALITY, VR::CS, "RTDOSE"),
        (tags::DOSE_UNITS, VR::CS, "GY"),
        (tags::DOSE_TYPE, VR::CS, "PHYSICAL"),
        (tags::DOSE_SUMMATION_TYPE, VR::CS, "PLAN"),
        (tags::DOSE_GRID_SCALING, VR::DS, "0.01"),
        (tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0\\1\\0"),
    ] {
        put(&mut d, tag, vr, text);
    }
    let mut plan = InMemDicomObject::new_empty();
    plan.put_str(tags::REFERENCED_SOP_CLASS_UID, VR::UI, "1.2.840.10008.5.1.4.1.1.481.5");
    plan.put_str(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, "2.25.77");
    let plans = DataSetSequence::from(vec![plan]);
    d.put(DataElement::new(tags::REFERENCED_RT_PLAN_SEQUENCE, VR::SQ, plans));
    let first = ORIGIN[2] + SPACING[2] * planes[0] as f64;
    put(
        &mut d,
        tags::IMAGE_POSITION_PATIENT,
        VR::DS,
        joined(&[ORIGIN[0], ORIGIN[1], first]).as_str(),
    );
    put(&mut d, tags::PIXEL_SPACING, VR::DS, joined(&[SPACING[1], SPACING[0]]).as_str());
    put(&mut d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, joined(offsets).as_str());
    put(&mut d, tags::NUMBER_OF_FRAMES, VR::IS, planes.len().to_string().as_str());
    for (tag, number) in [
        (tags::ROWS, SIZE[1] as u16),
        (tags::COLUMNS, SIZE[0] as u16),
        (tags::BITS_ALLOCATED, 32),
        (tags::BITS_STORED, 32),
        (tags::HIGH_BIT, 31),
        (tags::PIXEL_REPRESENTATION, 0),
    ] {
        put(&mut d, tag, VR::US, number);
    }
    let bytes: Vec<u8> = planes.iter().flat_map(|&k| frame(k)).flat_map(u32::to_le_bytes).collect();
    put(&mut d, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U8(bytes.into()));
    d
}

fn plain() -> Slice {
    dose(&[0, 1, 2], &[0.0, 3.0, 6.0])
}

fn file(dose: &Slice, dir: &TempDir) -> PathBuf {
    let path = dir.path().join("dose.dcm");
    dose.write_to_file(&path).unwrap();
    path
}

fn reading(dose: &Slice) -> Result<Dose, String> {
    let dir = TempDir::new().unwrap();
    read_dose(&file(dose, &dir)).map_err(|e| e.to_string())
}

/// Every place holds its value, wherever its plane came in the file.
fn assert_dose(read: &Dose, bits: &str) {
    let volume = read.volume();
    assert_eq!(volume.grid().size(), SIZE, "{bits}");
    for n in 0..volume.grid().len() {
        let voxel = volume.grid().voxel(n);
        let at = [0, 1, 2].map(|a| ORIGIN[a] + SPACING[a] * voxel[a] as f64);
        let off = (volume.grid().centre(voxel) - Point::from(at)).norm();
        assert!(off < 1e-9, "{bits}: {voxel:?} lies {off} mm off");
        let meant = f64::from(stored(voxel)) * 0.01;
        assert!((f64::from(volume.at(voxel)) - meant).abs() < 1e-6, "{bits}: {voxel:?}");
    }
}

#[test]
fn planes_are_found_in_either_form_and_any_order() {
    for (planes, offsets) in [
        ([0, 1, 2], [0.0, 3.0, 6.0]),
        ([2, 1, 0], [0.0, -3.0, -6.0]),
        ([1, 2, 0], [0.0, 3.0, -3.0]),
        // What subtracting positions leaves of 0.
        ([0, 1, 2], [1e-14, 3.0, 6.0]),
        ([2, 1, 0], [-2.8e-14, -3.0, -6.0]),
        // Absolute positions: the first is that of the first plane.
        ([0, 1, 2], [100.0, 103.0, 106.0]),
        ([2, 0, 1], [106.0, 100.0, 103.0]),
    ] {
        let read = reading(&dose(&planes, &offsets)).unwrap();
        assert_dose(&read, &format!("{planes:?} {offsets:?}"));
        assert_eq!((read.dose_type(), read.summation_type()), ("PHYSICAL".into(), "PLAN".into()));
        assert!((read.step_gy() - 0.01).abs() < 1e-15 && read.warnings().is_empty());
    }
}

#[test]
fn sixteen_bits_and_fewer_stored_bits_are_read() {
    let mut d = plain();
    let samples: Vec<u16> = (0..3).flat_map(frame).map(|v| v as u16).collect();
    put(&mut d, tags::BITS_ALLOCATED, VR::US, 16u16);
    put(&mut d, tags::BITS_STORED, VR::US, 16u16);
    put(&mut d, tags::HIGH_BIT, VR::US, 15u16);
    put(&mut d, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(samples.clone().into()));
    assert_dose(&reading(&d).unwrap(), "16 of 16");
    put(&mut d, tags::BITS_STORED, VR::US, 12u16);
    put(&mut d, tags::HIGH_BIT, VR::US, 11u16);
    let above: Vec<u16> = samples.iter().map(|v| v | 0xA000).collect();
    put(&mut d, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(above.into()));
    assert_dose(&reading(&d).unwrap(), "12 of 16, with bits above");
}

/// RLE Lossless of one frame of 16 bits: two planes of bytes, the upper first, in runs of one
/// literal each (PS3.5 Annex G).
fn run_lengths(samples: &[u16]) -> Vec<u8> {
    let plane = |shift: u32| -> Vec<u8> {
        let mut packed: Vec<u8> = samples
            .chunks(8)
            .flat_map(|c| {
                [c.len() as u8 - 1].into_iter().chain(c.iter().map(move |v| (v >> shift) as u8))
            })
            .collect();
        packed.resize(packed.len().next_multiple_of(2), 0x80);
        packed
    };
    let (upper, lower) = (plane(8), plane(0));
    let mut header = [0u32; 16];
    header[..3].copy_from_slice(&[2, 64, 64 + upper.len() as u32]);
    header.iter().flat_map(|n| n.to_le_bytes()).chain(upper).chain(lower).collect()
}

#[test]
fn a_compressed_dose_is_read_frame_by_frame_or_refused_by_its_syntax() {
    let mut d = plain();
    let fragments: Vec<Vec<u8>> =
        (0..3).map(|k| run_lengths(&frame(k).map(|v| v as u16).collect::<Vec<_>>())).collect();
    for (tag, number) in [(tags::BITS_ALLOCATED, 16), (tags::BITS_STORED, 16), (tags::HIGH_BIT, 15)]
    {
        put(&mut d, tag, VR::US, number as u16);
    }
    d.meta_mut().transfer_syntax = "1.2.840.10008.1.2.5".into();
    let pixels = PixelFragmentSequence::new(Vec::<u32>::new(), fragments.clone());
    d.put(DataElement::new(tags::PIXEL_DATA, VR::OB, pixels));
    assert_dose(&reading(&d).unwrap(), "run lengths");
    let two = PixelFragmentSequence::new(Vec::<u32>::new(), fragments[..2].to_vec());
    d.put(DataElement::new(tags::PIXEL_DATA, VR::OB, two));
    let said = reading(&d).unwrap_err();
    assert!(said.contains("RLE Lossless") && said.contains("2 fragments"), "{said}");
    d.meta_mut().transfer_syntax = "1.2.840.10008.1.2.4.80".into();
    let said = reading(&d).unwrap_err();
    assert!(said.contains("JPEG-LS Lossless") && said.contains("uncompressed"), "{said}");
}

#[test]
fn an_oblique_dose_goes_along_its_normal() {
    let mut d = plain();
    put(&mut d, tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "0.6\\0.8\\0\\0\\0\\-1");
    let read = reading(&d).unwrap();
    let normal = Vector::new(-0.8, 0.6, 0.0);
    let direction = read.volume().grid().direction();
    assert!((direction.column(2) - normal).norm() < 1e-12, "{direction}");
    let off = read.volume().grid().centre([0, 0, 2]) - (Point::from(ORIGIN) + normal * 6.0);
    assert!(off.norm() < 1e-9 && (f64::from(read.volume().at([4, 3, 2])) - 2.35).abs() < 1e-6);
}

#[test]
fn what_is_no_dose_on_a_grid_is_refused_by_name() {
    type Change = (&'static str, fn(&mut Slice));
    let changes: [Change; 18] = [
        ("RELATIVE", |d| put(d, tags::DOSE_UNITS, VR::CS, "RELATIVE")),
        ("Dose Type", |d| put(d, tags::DOSE_TYPE, VR::CS, "ERROR")),
        ("Dose Grid Scaling is missing", |d| {
            d.remove_element(tags::DOSE_GRID_SCALING);
        }),
        ("Dose Grid Scaling is \"0,01\"", |d| put(d, tags::DOSE_GRID_SCALING, VR::DS, "0,01")),
        ("above 0", |d| put(d, tags::DOSE_GRID_SCALING, VR::DS, "0")),
        ("need 240", |d| {
            put(d, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U8(vec![0u8; 236].into()));
        }),
        ("need 240", |d| {
            put(d, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U8(vec![0u8; 320].into()));
        }),
        ("Number of Frames is 0", |d| put(d, tags::NUMBER_OF_FRAMES, VR::IS, "0")),
        ("Number of Frames is 1", |d| put(d, tags::NUMBER_OF_FRAMES, VR::IS, "1")),
        ("voxels, at most", |d| {
            put(d, tags::NUMBER_OF_FRAMES, VR::IS, "2147483647");
            put(d, tags::ROWS, VR::US, 65535u16);
            put(d, tags::COLUMNS, VR::US, 65535u16);
        }),
        ("unequal steps: 3.000 mm between frames 1 and 2", |d| {
            put(d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, "0\\3\\6.5");
        }),
        ("at one place", |d| put(d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, "0\\3\\3")),
        ("2 values for 3 frames", |d| put(d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, "0\\3")),
        ("neither 0 nor the z", |d| put(d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, "1\\4\\7")),
        ("1\\0\\0\\0\\1\\0 only", |d| {
            put(d, tags::GRID_FRAME_OFFSET_VECTOR, VR::DS, "100\\103\\106");
            put(d, tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0\\0\\1");
        }),
        ("right angles", |d| {
            put(d, tags::IMAGE_ORIENTATION_PATIENT, VR::DS, "1\\0\\0\\0.1\\1\\0");
        }),
        ("signed", |d| put(d, tags::PIXEL_REPRESENTATION, VR::US, 1u16)),
        ("without a grid", |d| {
            d.remove_element(tags::PIXEL_DATA);
        }),
    ];
    for (word, change) in changes {
        let mut d = plain();
        change(&mut d);
        let said = reading(&d).unwrap_err();
        assert!(said.contains(word) && said.contains("dose.dcm"), "{word}: {said}");
    }
    let dir = folder(&six());
    let said = read_dose(&dir.path().join("0.dcm")).unwrap_err().to_string();
    assert!(said.contains("not an RT dose: CT Image Storage"), "{said}");
}

#[test]
fn a_dose_is_known_by_its_content() {
    let dir = TempDir::new().unwrap();
    let path = file(&plain(), &dir);
    assert!(is_dose(&path).unwrap());
    assert!(region_object(&path).unwrap_err().to_string().contains("RT Dose Storage"));
    let ct = folder(&six());
    assert!(!is_dose(&ct.path().join("0.dcm")).unwrap());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_doses_are_refused_and_never_a_panic(at in 132usize..3000, byte: u8, cut in 0usize..400) {
        let dir = TempDir::new().unwrap();
        let path = file(&plain(), &dir);
        let mut bytes = std::fs::read(&path).unwrap();
        let n = bytes.len();
        bytes[at % n] = byte;
        bytes.truncate(n - cut);
        std::fs::write(&path, bytes).unwrap();
        if let Ok(read) = read_dose(&path) {
            prop_assert!(read.volume().data().iter().all(|d| d.is_finite()));
        }
    }
}

pub(crate) fn params(source: &Source) -> CompanionParams {
    CompanionParams {
        series_description: "DEFORMED dose [test]".into(),
        derivation: "DERIVED: moved by a test".into(),
        clock: source.clock(),
        before: 0,
        software_version: "0.1.0".into(),
    }
}

fn by() -> ObjectReference {
    ObjectReference {
        class_uid: "1.2.840.10008.5.1.4.1.1.66.3".into(),
        instance_uid: "2.25.5".into(),
        series_uid: "2.25.6".into(),
    }
}

/// A dose on another grid than its source, oblique, with a maximum that f32 does not hold exactly.
fn carried() -> Volume<f32> {
    let (sin, cos) = 0.4_f64.sin_cos();
    let direction = Matrix::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let grid =
        Grid::new([4, 3, 5], Vector::new(1.1, 1.7, 2.3), Point::new(0.1, 0.2, -0.3), direction);
    Volume::from_fn(grid.unwrap(), |[i, j, k]| (i * 7 + j * 3 + k) as f32 * 0.713_37)
}

#[test]
fn a_written_dose_reads_back_within_half_a_step_and_says_what_it_is() {
    let (ct, dir) = (folder(&six()), TempDir::new().unwrap());
    let (_, source, _) = read(ct.path()).unwrap();
    let from = read_dose(&file(&plain(), &dir)).unwrap();
    let path = dir.path().join("out.dcm");
    let by = by();
    let info = write_dose(&carried(), &from, &source, &params(&source), Some(&by), &path).unwrap();
    assert!(info.warnings.is_empty(), "{:?}", info.warnings);
    let read = read_dose(&path).unwrap();
    let meant = carried();
    let most = meant.data().iter().copied().fold(0.0, f32::max);
    assert!((info.step_gy / (f64::from(most) / 2_147_483_647.0) - 1.0).abs() < 1e-6);
    for (a, b) in read.volume().data().iter().zip(meant.data()) {
        assert!(
            (f64::from(*a) - f64::from(*b)).abs() <= 0.51 * info.step_gy + 1.2e-7 * f64::from(*b)
        );
    }
    let object = open_file(&path).unwrap();
    for (tag, meant) in [
        (tags::SOP_INSTANCE_UID, info.object.instance_uid.as_str()),
        (tags::DOSE_UNITS, "GY"),
        (tags::DOSE_TYPE, "PHYSICAL"),
        (tags::DOSE_SUMMATION_TYPE, "PLAN"),
        (tags::SPATIAL_TRANSFORM_OF_DOSE, "NON_RIGID"),
        (tags::DOSE_COMMENT, "carried with the tissue, not recalculated"),
        (tags::FRAME_OF_REFERENCE_UID, source.frame_of_reference_uid().as_str()),
        (tags::DERIVATION_DESCRIPTION, "DERIVED: moved by a test"),
    ] {
        assert_eq!(text(&object, tag).trim_end_matches(['\0', ' ']), meant, "{tag}");
    }
    let item = |tag| object.element(tag).unwrap().items().unwrap()[0].clone();
    let instance = |tag| {
        item(tag).element(tags::REFERENCED_SOP_INSTANCE_UID).unwrap().to_str().unwrap().into_owned()
    };
    assert_eq!(instance(tags::REFERENCED_RT_PLAN_SEQUENCE), "2.25.77");
    assert_eq!(instance(tags::REFERENCED_SPATIAL_REGISTRATION_SEQUENCE), "2.25.5");
    let again = write_dose(&meant, &from, &source, &params(&source), Some(&by), &path).unwrap();
    assert_eq!(again, info, "the same dose has the same identity");
    let other = write_dose(&meant, &from, &source, &params(&source), None, &path).unwrap();
    assert_ne!(other.object.instance_uid, info.object.instance_uid);
    assert!(other.warnings[0].to_string().contains("no registration"), "{:?}", other.warnings);
}

#[test]
fn a_dose_that_cannot_be_written_leaves_nothing() {
    let (ct, dir, out) = (folder(&six()), TempDir::new().unwrap(), TempDir::new().unwrap());
    let (_, source, _) = read(ct.path()).unwrap();
    let from = read_dose(&file(&plain(), &dir)).unwrap();
    let path = out.path().join("out.dcm");
    let refused = |dose: &Volume<f32>, from: &Dose, params: &CompanionParams, path: &Path| {
        let error = write_dose(dose, from, &source, params, None, path).unwrap_err().to_string();
        assert!(contents(out.path()).is_empty(), "{error}");
        error
    };
    let good = params(&source);
    let unmarked = CompanionParams { series_description: "Dose".into(), ..good.clone() };
    assert!(refused(&carried(), &from, &unmarked, &path).contains("Series Description"));
    let negative = carried().map(|d| d - 1.0);
    assert!(refused(&negative, &from, &good, &path).contains("negative"));
    let infinite = carried().map(|d| d / 0.0);
    assert!(refused(&infinite, &from, &good, &path).contains("not finite"));
    let nowhere = out.path().join("none/out.dcm");
    assert!(refused(&carried(), &from, &good, &nowhere).contains("cannot write"));
    let mut foreign = plain();
    put(&mut foreign, tags::PATIENT_ID, VR::LO, "somebody else");
    let foreign = read_dose(&file(&foreign, &dir)).unwrap();
    let said = refused(&carried(), &foreign, &good, &path);
    assert!(said.contains("another patient") && !said.contains("somebody"), "{said}");
    // What names a patient does not go with a CT that no longer does.
    let mut clean = six();
    for slice in &mut clean {
        put(slice, tags::PATIENT_ID, VR::LO, "");
        put(slice, tags::PATIENT_IDENTITY_REMOVED, VR::CS, "YES");
    }
    let mut named = plain();
    put(&mut named, tags::PATIENT_IDENTITY_REMOVED, VR::CS, "NO");
    let named = read_dose(&file(&named, &dir)).unwrap();
    let (_, clean, _) = read(folder(&clean).path()).unwrap();
    let error = write_dose(&carried(), &named, &clean, &params(&clean), None, &path).unwrap_err();
    assert!(error.to_string().contains("de-identified") && !path.exists(), "{error}");
}

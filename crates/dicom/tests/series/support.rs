//! A folder of a few slices of the fixture patient, each open to change.

use dicom_core::{DataElement, PrimitiveValue, Tag, VR};
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, open_file};
use std::path::{Path, PathBuf};
use supine_dicom::{Error, ExportParams, Policy, ReadInfo, ReadParams, Source, read_series};
use supine_space::{Progress, Side};
use supine_volume::Ct;
use tempfile::TempDir;

pub(crate) type Slice = DefaultDicomObject;

/// Slices `first..first + count` of the fixture, counted from 1 at the feet.
pub(crate) fn slices(first: usize, count: usize) -> Vec<Slice> {
    let ct = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/patient/ct");
    (first..first + count).map(|n| open_file(ct.join(format!("IM{n:04}"))).unwrap()).collect()
}

/// Six slices through the breast.
pub(crate) fn six() -> Vec<Slice> {
    slices(40, 6)
}

/// The slices as files `0.dcm` and so on in a new folder.
pub(crate) fn folder(slices: &[Slice]) -> TempDir {
    let dir = TempDir::new().unwrap();
    for (n, slice) in slices.iter().enumerate() {
        slice.write_to_file(dir.path().join(format!("{n}.dcm"))).unwrap();
    }
    dir
}

pub(crate) fn put(slice: &mut Slice, tag: Tag, vr: VR, value: impl Into<PrimitiveValue>) {
    slice.put(DataElement::new(tag, vr, value.into()));
}

pub(crate) fn text(slice: &Slice, tag: Tag) -> String {
    slice.element(tag).unwrap().to_str().unwrap().into_owned()
}

/// Gives the slice another identity, also in its file header.
pub(crate) fn rename(slice: &mut Slice, instance: &str) {
    put(slice, tags::SOP_INSTANCE_UID, VR::UI, instance);
    slice.meta_mut().media_storage_sop_instance_uid = instance.to_owned();
}

pub(crate) fn position(slice: &Slice) -> [f64; 3] {
    let numbers = slice.element(tags::IMAGE_POSITION_PATIENT).unwrap().to_multi_float64().unwrap();
    numbers.try_into().unwrap()
}

pub(crate) fn place(slice: &mut Slice, [x, y, z]: [f64; 3]) {
    put(slice, tags::IMAGE_POSITION_PATIENT, VR::DS, format!("{x:.10}\\{y:.10}\\{z:.10}").as_str());
}

pub(crate) fn orient(slice: &mut Slice, cosines: &str) {
    put(slice, tags::IMAGE_ORIENTATION_PATIENT, VR::DS, cosines);
}

/// Replaces compressed pixels by these samples in Explicit VR Little Endian.
pub(crate) fn put_samples(slice: &mut Slice, samples: Vec<u16>) {
    slice.meta_mut().transfer_syntax = "1.2.840.10008.1.2.1".to_owned();
    put(slice, tags::PIXEL_DATA, VR::OW, PrimitiveValue::U16(samples.into()));
}

/// Stored values of the six slices, from their HU.
pub(crate) fn stored(slices: &[Slice]) -> Vec<Vec<u16>> {
    let (ct, ..) = read(folder(slices).path()).unwrap();
    let per_slice = 256 * 256;
    let samples = |hu: &[i16]| hu.iter().map(|v| (v + 1024) as u16).collect();
    ct.data().chunks(per_slice).map(samples).collect()
}

pub(crate) fn read(path: &Path) -> Result<(Ct, Source, ReadInfo), Error> {
    read_series(path, &ReadParams::default(), Progress::none())
}

/// The message of the error that reading these slices gives.
pub(crate) fn refusal(slices: &[Slice]) -> String {
    read(folder(slices).path()).unwrap_err().to_string()
}

pub(crate) fn export_params(source: &Source) -> ExportParams {
    ExportParams {
        series_description: "DEFORMED table AP 7 LAT 5 [test]".into(),
        derivation: "Finite elements, E 0.609 kPa; not acquired anatomy".into(),
        image_comments: "SIMULATED DEFORMATION - not acquired anatomy".into(),
        laterality: Side::Left,
        clock: source.clock(),
        software_version: "0.1.0".into(),
        identity: [7; 32],
        reach_mm: 3.0,
        policy: Policy::default(),
    }
}

/// A volume that differs from the source in the middle.
pub(crate) fn deformed(ct: &Ct) -> Ct {
    let size = ct.grid().size();
    Ct::from_fn(ct.grid().clone(), |[i, j, k]| {
        let inside = (80..180).contains(&i) && (40..120).contains(&j) && k > 0 && k + 1 < size[2];
        ct.at(if inside { [i, j - 2, k] } else { [i, j, k] })
    })
}

/// All files below a folder with their bytes.
pub(crate) fn contents(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(dir).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.into_iter().map(|p| (p.file_name().unwrap().into(), std::fs::read(&p).unwrap())).collect()
}

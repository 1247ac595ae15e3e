//! Segmentations: those of highdicom read, ours written and read again.

use crate::support::{Slice, folder, put, read, six, slices, text};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use dicom_object::{DefaultDicomObject, open_file};
use proptest::prelude::*;
use std::path::{Path, PathBuf};
use supine_dicom::{
    Error, Meaning, RegionObject, Segmentation, SegmentationInfo, SegmentationParams, Source,
    read_segmentation, read_structures, region_object, write_carried_segmentation,
    write_segmentation,
};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::{LabelMap, Volume, label};
use tempfile::TempDir;

/// Frame of reference of the files that `data/make.py` writes.
pub(crate) const FRAME: Option<&str> = Some("2.25.1001");

pub(crate) fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The grid of `data/make.py`.
pub(crate) fn grid() -> Grid {
    let (sin, cos) = 0.3_f64.sin_cos();
    let direction = Matrix::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
    let origin = Point::new(-20.25, 5.5, 100.125);
    Grid::new([21, 19, 6], Vector::new(0.75, 1.25, 2.5), origin, direction).unwrap()
}

/// The label of a voxel in `data/make.py`.
pub(crate) fn label_at([i, j, k]: [usize; 3]) -> u8 {
    if !((3..15).contains(&i) && (2..17).contains(&j) && k != 2) {
        0
    } else if i + k >= 9 {
        2
    } else {
        1
    }
}

fn assert_labels(read: &Segmentation) {
    let grid = grid();
    for segment in read.segments() {
        let mask = read.mask(segment.number);
        let meant = |n: &usize| u16::from(label_at(grid.voxel(*n))) == segment.number;
        let off = (0..grid.len()).filter(|n| meant(n) != mask.data()[*n]).count();
        assert_eq!(off, 0, "voxels of segment {} that differ", segment.number);
    }
}

#[test]
fn segmentations_of_highdicom_are_read_voxel_by_voxel() {
    for name in ["binary", "shuffled", "labelmap", "fractional"] {
        let read =
            read_segmentation(&data(&format!("highdicom_{name}.dcm")), &grid(), FRAME).unwrap();
        let meanings: Vec<_> =
            read.segments().iter().map(|s| (s.name.as_str(), s.meaning)).collect();
        let expected = [
            ("Weichteile", Some(Meaning::Label(label::SOFT_TISSUE))),
            ("Brustwand", Some(Meaning::Label(label::CHEST_WALL))),
        ];
        assert_eq!(meanings, expected, "{name}");
        assert_labels(&read);
        assert_eq!(read.warnings().len(), usize::from(name == "fractional"), "{name}");
    }
}

#[test]
fn files_are_told_by_their_content() {
    let kind = |path: &Path| region_object(path);
    assert_eq!(kind(&data("highdicom_binary.dcm")).unwrap(), Some(RegionObject::Segmentation));
    assert_eq!(kind(&data("highdicom_labelmap.dcm")).unwrap(), Some(RegionObject::Segmentation));
    assert_eq!(kind(&data("pydicom_rtstruct.dcm")).unwrap(), Some(RegionObject::Structures));
    assert_eq!(kind(&data("make.py")).unwrap(), None);
    let dir = folder(&six());
    let error = kind(&dir.path().join("0.dcm")).unwrap_err().to_string();
    assert!(error.contains("0.dcm") && error.contains("CT Image Storage"), "{error}");
    std::fs::write(dir.path().join("empty"), b"").unwrap();
    assert_eq!(kind(&dir.path().join("empty")).unwrap(), None);
    assert!(kind(&dir.path().join("none")).is_err());
}

/// The message of the error that a changed segmentation gives.
fn refused(change: impl FnOnce(&mut DefaultDicomObject)) -> String {
    let dir = TempDir::new().unwrap();
    let mut object = open_file(data("highdicom_binary.dcm")).unwrap();
    change(&mut object);
    let path = dir.path().join("seg.dcm");
    object.write_to_file(&path).unwrap();
    read_segmentation(&path, &grid(), FRAME).unwrap_err().to_string()
}

#[test]
fn what_does_not_belong_to_the_ct_is_refused() {
    let other = refused(|o| put(o, tags::FRAME_OF_REFERENCE_UID, VR::UI, "2.25.7"));
    assert!(other.contains("Frame of Reference") && other.contains("seg.dcm"), "{other}");
    let without = read_segmentation(&data("highdicom_binary.dcm"), &grid(), None).unwrap();
    assert!(
        without.warnings()[0].to_string().contains("frame of reference"),
        "{:?}",
        without.warnings()
    );

    let g = grid();
    let moved = |by: f64, size: [usize; 3], spacing: Vector| {
        let origin = g.origin() + Vector::new(0.0, 0.0, by);
        let grid = Grid::new(size, spacing, origin, *g.direction()).unwrap();
        read_segmentation(&data("highdicom_binary.dcm"), &grid, FRAME).map(|_| ())
    };
    assert!(moved(0.009, g.size(), g.spacing()).is_ok());
    let error = moved(1.25, g.size(), g.spacing()).unwrap_err().to_string();
    assert!(error.contains("1.25 mm off") && error.contains("resample"), "{error}");
    let error = moved(0.0, [21, 19, 5], g.spacing()).unwrap_err().to_string();
    assert!(error.contains("beyond the CT"), "{error}");
    let wider = Vector::new(0.375, 1.25, 2.5);
    let error = moved(0.0, [60, 19, 6], wider).unwrap_err().to_string();
    assert!(error.contains("other spacing"), "{error}");
}

#[test]
fn a_ct_with_its_axes_turned_takes_the_same_segmentation() {
    let g = grid();
    // The same voxels, counted from the last slice and along columns first.
    let d = g.direction();
    let turned = Matrix::from_columns(&[-d.column(2), d.column(1).into(), d.column(0).into()]);
    let s = g.spacing();
    let spacing = Vector::new(s.z, s.y, s.x);
    let turned = Grid::new([6, 19, 21], spacing, g.centre([0, 0, 5]), turned).unwrap();
    let read = read_segmentation(&data("highdicom_binary.dcm"), &turned, FRAME).unwrap();
    let mask = read.mask(1);
    for n in 0..turned.len() {
        let [a, j, c] = turned.voxel(n);
        assert_eq!(mask.data()[n], label_at([c, j, 5 - a]) == 1);
    }
}

#[test]
fn headers_that_lie_are_refused_and_named() {
    let error = refused(|o| put(o, tags::NUMBER_OF_FRAMES, VR::IS, "2000000000"));
    assert!(error.contains("Number of Frames"), "{error}");
    let error = refused(|o| put(o, tags::ROWS, VR::US, 65535_u16));
    assert!(error.contains("beyond the CT"), "{error}");
    let error = refused(|o| put(o, tags::ROWS, VR::US, 0_u16));
    assert!(error.contains("Rows"), "{error}");
    let error = refused(|o| put(o, tags::SEGMENTATION_TYPE, VR::CS, "SURFACE"));
    assert!(error.contains("SURFACE"), "{error}");
    let error = refused(|o| put(o, tags::PIXEL_DATA, VR::OB, vec![0_u8; 10]));
    assert!(error.contains("Pixel Data") && error.contains("10 frames"), "{error}");
    let error = refused(|o| {
        o.remove_element(tags::SEGMENT_SEQUENCE);
    });
    assert!(error.contains("Segment Sequence"), "{error}");
}

/// Labels on six slices of the fixture, none on the first and all fine ones somewhere.
fn labels(grid: &Grid) -> LabelMap {
    LabelMap::from_fn(grid.clone(), |[i, j, k]| match (i, j, k) {
        (_, _, 0) => 0,
        (60..=200, 41..=110, 1..=4) => 1,
        (70..=190, 111..=180, _) => 2 + u8::from(i % 7 == 3 && k == 5),
        (17, 19, 3) => 9,
        _ => 0,
    })
}

fn params(source: &Source) -> SegmentationParams {
    SegmentationParams {
        series_description: "Labels of the CT [test]".into(),
        automatic: true,
        algorithm: "supine test".into(),
        clock: source.clock(),
        before: 0,
        software_version: "0.1.0".into(),
    }
}

fn written(slices: &[Slice], dir: &Path) -> (LabelMap, Source, SegmentationInfo, PathBuf) {
    let (ct, source, _) = read(folder(slices).path()).unwrap();
    let labels = labels(ct.grid());
    let path = dir.join("labels.dcm");
    let info = write_segmentation(&labels, &source, &params(&source), &path).unwrap();
    (labels, source, info, path)
}

#[test]
fn what_is_written_reads_back_equal_and_belongs_to_the_source() {
    let dir = TempDir::new().unwrap();
    let (labels, source, info, path) = written(&six(), dir.path());
    assert_eq!(info.segments, ["soft tissue", "chest wall", "lung", "tumour"]);
    assert_eq!(info.frames, 4 + 5 + 1 + 1);
    let frame = source.frame_of_reference_uid();
    let again = read_segmentation(&path, labels.grid(), Some(&frame)).unwrap();
    let numbers = [1, 2, 3, 9];
    for (segment, number) in again.segments().iter().zip(numbers) {
        assert_eq!(segment.meaning, Some(Meaning::Label(number)));
        let meant = labels.map(|l| *l == number);
        assert_eq!(again.mask(segment.number), meant, "{number}");
    }
    let (object, ct) = (open_file(&path).unwrap(), &six()[0]);
    for tag in
        [tags::PATIENT_ID, tags::STUDY_INSTANCE_UID, tags::FRAME_OF_REFERENCE_UID, tags::STUDY_DATE]
    {
        assert_eq!(text(&object, tag), text(ct, tag), "{tag}");
    }
    for tag in [tags::SERIES_INSTANCE_UID, tags::SOP_INSTANCE_UID, tags::SERIES_NUMBER] {
        assert_ne!(text(&object, tag), text(ct, tag), "{tag}");
    }
    assert_eq!(text(&object, tags::SERIES_INSTANCE_UID), info.series_uid);
}

#[test]
fn the_same_labels_have_the_same_bytes_and_others_another_identity() {
    let dir = TempDir::new().unwrap();
    let (mut labels, source, first, path) = written(&six(), dir.path());
    let bytes = std::fs::read(&path).unwrap();
    let again = write_segmentation(&labels, &source, &params(&source), &path).unwrap();
    assert_eq!((bytes, &first), (std::fs::read(&path).unwrap(), &again));
    labels.data_mut()[256 * 256 + 5] = 1;
    let other = write_segmentation(&labels, &source, &params(&source), &path).unwrap();
    assert_ne!(other.instance_uid, first.instance_uid);
    assert_ne!(other.series_uid, first.series_uid);
}

#[test]
fn labels_that_cannot_be_segments_are_refused_and_leave_nothing() {
    let dir = TempDir::new().unwrap();
    let (ct, source, _) = read(folder(&six()).path()).unwrap();
    let path = dir.path().join("labels.dcm");
    let refused = |labels: &LabelMap| -> Error {
        write_segmentation(labels, &source, &params(&source), &path).unwrap_err()
    };
    let nothing = LabelMap::from_fn(ct.grid().clone(), |_| 0);
    assert!(refused(&nothing).to_string().contains("no label"));
    let unknown = LabelMap::from_fn(ct.grid().clone(), |_| 77);
    assert!(refused(&unknown).to_string().contains("has no name"));
    let (other, ..) = read(folder(&slices(41, 6)).path()).unwrap();
    assert!(matches!(refused(&labels(other.grid())), Error::OtherGrid { .. }));
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
}

/// Masks that overlap, one of them empty, as a segmentation of another CT; names and codes are
/// those of the file.
#[test]
fn carried_segments_keep_names_codes_and_voxels() {
    let dir = TempDir::new().unwrap();
    let (labels, source, _, path) = written(&six(), dir.path());
    let frame = source.frame_of_reference_uid();
    let from = read_segmentation(&path, labels.grid(), Some(&frame)).unwrap();
    let masks: Vec<Volume<bool>> = (0..4)
        .map(|n| {
            Volume::from_fn(labels.grid().clone(), |[i, j, k]| n < 3 && k > n && (i + j) % 5 == 0)
        })
        .collect();
    let out = dir.path().join("carried.dcm");
    let carried = |masks: &[Volume<bool>]| {
        write_carried_segmentation(masks, &from, &source, &params(&source), &out)
    };
    let (info, warnings) = carried(&masks).unwrap();
    assert_eq!((info.segments.len(), info.frames, warnings.len()), (4, 5 + 4 + 3, 0));
    let read = read_segmentation(&out, labels.grid(), Some(&frame)).unwrap();
    for ((a, b), mask) in read.segments().iter().zip(from.segments()).zip(&masks) {
        assert_eq!((&a.name, a.meaning), (&b.name, b.meaning));
        assert_eq!(read.mask(a.number), *mask);
    }
    std::fs::remove_file(&out).unwrap();
    let nothing: Vec<_> = masks.iter().map(|m| m.map(|_| false)).collect();
    assert!(carried(&nothing).unwrap_err().to_string().contains("no segment holds a voxel"));
    assert!(carried(&masks[..2]).unwrap_err().to_string().contains("one mask for each"));
    assert!(!out.exists());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Files that were cut and changed anywhere give a result or an error, never a panic.
    #[test]
    fn spoiled_files_do_no_harm(
        which in 0_usize..5,
        cut in 0.3_f64..1.3,
        changes in prop::collection::vec((0.0_f64..1.0, any::<u8>()), 0..6),
    ) {
        let names = ["highdicom_binary", "highdicom_shuffled", "highdicom_labelmap",
            "highdicom_fractional", "pydicom_rtstruct"];
        let mut bytes = std::fs::read(data(&format!("{}.dcm", names[which]))).unwrap();
        bytes.truncate((cut * bytes.len() as f64) as usize);
        for (place, value) in changes {
            let at = (place * bytes.len() as f64) as usize;
            bytes[at] = value;
        }
        let dir = TempDir::new().unwrap();
        let path = dir.path().join("spoiled.dcm");
        std::fs::write(&path, bytes).unwrap();
        let _ = region_object(&path);
        if let Ok(read) = read_segmentation(&path, &grid(), FRAME) {
            for segment in read.segments() {
                read.mask(segment.number);
            }
        }
        if let Ok(read) = read_structures(&path) {
            for roi in read.rois() {
                let _ = read.mask(roi, &grid(), FRAME);
            }
        }
    }
}

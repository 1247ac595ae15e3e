//! What is written for things that were carried is read back equal: foreign labels, surfaces,
//! fields.

#![expect(clippy::disallowed_methods, reason = "looks at the files that were written")]
#![expect(clippy::unwrap_used, reason = "a test may fail")]

use std::path::PathBuf;
use supine_exchange::*;
use supine_mesh::TriSurface;
use supine_space::{Failure, Grid, Matrix, Point, Progress, Vector};
use supine_volume::Volume;

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn read(path: &std::path::Path, kind: Option<VolumeKind>) -> AnyVolume {
    read_any_volume(path, kind, Progress::none()).unwrap()
}

fn layers(volume: AnyVolume) -> LabelLayers {
    match volume {
        AnyVolume::Labels(labels) => labels,
        AnyVolume::Scalar(_) => panic!("labels were taken for values"),
    }
}

fn grid() -> Grid {
    let turn = Matrix::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    Grid::new([4, 3, 2], Vector::new(1.5, 2.0, 3.0), Point::new(-7.0, 5.0, 11.0), turn).unwrap()
}

#[test]
fn overlapping_segments_keep_names_numbers_and_layers() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["slicer_layers.seg.nrrd", "slicer5_overlap.seg.nrrd", "slicer_cropped.seg.nrrd"] {
        let given = layers(read(&data(name), None));
        assert!(!given.names.is_empty(), "{name}");
        let path = folder.path().join(name);
        write_label_layers(&given, &path, Progress::none()).unwrap();
        let again = layers(read(&path, None));
        assert_eq!(
            (&again.names, again.layers.len()),
            (&given.names, given.layers.len()),
            "{name}"
        );
        for (a, b) in again.layers.iter().zip(&given.layers) {
            assert_eq!(a.data(), b.data(), "{name}");
            assert!((a.grid().origin() - b.grid().origin()).norm() < 1e-9, "{name}");
        }
        assert_eq!(again.volumes_ml(), given.volumes_ml(), "{name}");
        assert!(given.volumes_ml().values().sum::<f64>() > 0.0, "{name}");
        let nifti = write_label_layers(&given, &folder.path().join("a.nii.gz"), Progress::none());
        assert_eq!(nifti.is_ok(), given.layers.len() == 1, "{name}");
    }
}

#[test]
fn numbers_without_names_may_be_any_and_values_are_told_from_them() {
    let folder = tempfile::tempdir().unwrap();
    let [nrrd, nifti, dose] = ["a.nrrd", "a.nii.gz", "d.nrrd"].map(|n| folder.path().join(n));
    write_labels(&Volume::from_fn(grid(), |_| 1), &nrrd, Progress::none()).unwrap();
    let seen = layers(read(&nrrd, None));
    let labels =
        seen.with_layers(vec![Volume::from_fn(grid(), |[i, j, k]| (300 * i + j + k) as u16)]);
    for path in [&nrrd, &nifti] {
        write_label_layers(&labels, path, Progress::none()).unwrap();
        let again = layers(read(path, None));
        assert_eq!(again.layers[0].data(), labels.layers[0].data());
    }
    let unnamed = write_label_layers(&labels, &folder.path().join("a.seg.nrrd"), Progress::none());
    assert!(unnamed.unwrap_err().to_string().contains("names"));
    let values = Volume::from_fn(grid(), |[i, j, k]| i as f32 * 0.25 + j as f32 - k as f32);
    for path in [&dose, &folder.path().join("d.nii")] {
        write_scalar(&values, path, Progress::none()).unwrap();
        let AnyVolume::Scalar(again) = read(path, None) else { panic!("values as labels") };
        assert_eq!(again.data(), values.data());
        assert!(read_any_volume(path, Some(VolumeKind::Labels), Progress::none()).is_err());
    }
    let AnyVolume::Scalar(numbers) = read(&nrrd, Some(VolumeKind::Scalar)) else {
        panic!("--as dose")
    };
    assert!(numbers.data().iter().zip(labels.layers[0].data()).all(|(a, b)| *a == f32::from(*b)));
}

#[test]
fn surfaces_are_read_back_in_lps() {
    let folder = tempfile::tempdir().unwrap();
    let points = [[0.0; 3], [3.0, 0.0, 0.0], [0.0, -3.0, 0.5], [0.1, 0.0, 3.0]].map(Point::from);
    let faces = vec![[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];
    let surface = TriSurface::new(points.to_vec(), faces).unwrap();
    for name in ["a.stl", "a.ply", "a.obj"] {
        let path = folder.path().join(name);
        write_surface(&surface, &path).unwrap();
        // The file says that it is in LPS, whatever is asked for.
        let (again, said) = read_surface(&path, SurfaceFrame::Ras).unwrap();
        assert_eq!(said, Some(SurfaceFrame::Lps), "{name}");
        assert_eq!(again.triangles().len(), 4);
        assert!((again.volume() - surface.volume()).abs() < 1e-6, "{name}");
        let off = |p: &Point| surface.points().iter().map(|q| (p - q).norm()).fold(9.0, f64::min);
        assert!(again.points().iter().all(|p| off(p) < 1e-6), "{name}");
    }
    let refused = write_surface(&surface, &folder.path().join("a.vtk")).unwrap_err();
    assert_eq!(refused.kind(), Failure::Output);
}

#[test]
fn a_field_in_nifti_has_vectors_as_itk_writes_them_slowest_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.nii");
    let field = Volume::from_fn(grid(), |[i, j, k]| [i as f32 + 1.0, j as f32 + 10.0, k as f32]);
    write_field(&field, &path, FieldKind::Resampling, Progress::none()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let short = |at: usize| i16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let float = |at: usize| f32::from_le_bytes(*bytes[at..].first_chunk().unwrap());
    let dimensions: Vec<i16> = (0..8).map(|n| short(40 + 2 * n)).collect();
    assert_eq!(dimensions, [5, 4, 3, 2, 1, 3, 1, 1]);
    assert_eq!((short(68), short(70)), (1007, 16), "intent VECTOR, float");
    let start = float(108) as usize;
    let voxels = field.grid().len();
    for (n, v) in field.data().iter().enumerate() {
        let read = [0, 1, 2].map(|a| float(start + 4 * (a * voxels + n)));
        assert_eq!(read, *v);
    }
    assert_eq!(bytes.len(), start + 12 * voxels);
}

#[test]
fn meta_images_hold_fields_labels_and_their_notes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("F.MHA");
    let field = Volume::from_fn(grid(), |[i, j, k]| [i as f32 + 1.0, j as f32 + 10.0, k as f32]);
    write_field(&field, &path, FieldKind::Modeling, Progress::none()).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    for line in [
        "ObjectType = Image",
        "Comment = displacement field type: modeling",
        "CompressedData = True",
        "DimSize = 4 3 2",
        "ElementNumberOfChannels = 3",
        "ElementType = MET_FLOAT",
        "ElementDataFile = LOCAL",
    ] {
        assert!(text.contains(&format!("{line}\n")), "{line}: {text}");
    }
    let error = read_ct(&path, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("3 values per voxel, a CT has one"), "{error}");
    let path = folder.path().join("l.mha");
    let labels = Volume::from_fn(grid(), |[i, ..]| [0, 300][i % 2]);
    let scalar = labels.map(|&v| f32::from(v) + 0.5);
    write_scalar(&scalar, &path, Progress::none()).unwrap();
    // A segmentation of 3D Slicer holds labels alone.
    let segmentation = folder.path().join("s.seg.nrrd");
    let told = write_scalar(&scalar, &segmentation, Progress::none()).unwrap_err().to_string();
    assert!(told.contains("written as .nrrd, .nii") && !segmentation.exists(), "{told}");
    let read = read_any_volume(&path, None, Progress::none()).unwrap();
    assert!(matches!(read, AnyVolume::Scalar(read) if read == scalar));
    let whole = labels.map(|&v| f32::from(v));
    write_scalar(&whole, &path, Progress::none()).unwrap();
    let read = read_any_volume(&path, None, Progress::none()).unwrap();
    let AnyVolume::Labels(read) = read else { panic!("labels are taken for a dose") };
    write_label_layers(&read, &path, Progress::none()).unwrap();
    let text = String::from_utf8_lossy(&std::fs::read(&path).unwrap()).into_owned();
    assert!(text.contains("ElementType = MET_USHORT\n"), "{text}");
    let read = read_any_volume(&path, None, Progress::none()).unwrap();
    assert!(matches!(read, AnyVolume::Labels(read) if read.layers == [labels]));
}

#[test]
fn a_header_beside_its_samples_is_two_files() {
    let folder = tempfile::tempdir().unwrap();
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let path = folder.path().join("big.mhd");
    std::fs::copy(data.join("big.mhd"), &path).unwrap();
    assert_eq!(volume_files(&path).unwrap(), std::slice::from_ref(&path));
    let error = read_ct(&path, Progress::none()).unwrap_err();
    assert_eq!(error.kind(), Failure::Input);
    assert!(error.to_string().contains("big.raw"), "{error}");
    let raw = folder.path().join("big.raw");
    std::fs::copy(data.join("big.raw"), &raw).unwrap();
    assert_eq!(volume_files(&path).unwrap(), [path.clone(), raw.clone()]);
    assert!(read_ct(&path, Progress::none()).is_ok());
    assert!(is_volume_name(&path) && !is_volume_name(&raw));
}

/// Five layers of one voxel each, and a reference image of 256 x 256 x 8192 around them.
#[test]
fn layers_that_would_fill_the_memory_around_themselves_are_refused() {
    let header = "NRRD0004\ntype: uint8\ndimension: 4\nspace: LPS\nsizes: 5 1 1 1\n\
        space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: raw\n\
        Segment0_ID:=S\nSegment0_Name:=skin\nSegment0_Layer:=0\nSegment0_LabelValue:=1\n\
        Segmentation_ConversionParameters:=Reference image geometry|\
        -1;0;0;0;0;-1;0;0;0;0;1;0;0;0;0;1;0;255;0;255;0;8191;|\n\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.seg.nrrd");
    std::fs::write(&path, [header.as_bytes(), &[1; 5]].concat()).unwrap();
    let message = read_any_volume(&path, None, Progress::none()).unwrap_err().to_string();
    assert!(message.contains("5 layers are too many"), "{message}");
}

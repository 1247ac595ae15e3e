//! Registrations: written, read again, and what is refused.

use crate::dose::params;
use crate::support::{contents, deformed, export_params, folder, put, read, six, text};
use dicom_core::VR;
use dicom_dictionary_std::tags;
use dicom_object::open_file;
use supine_dicom::write_series;
use supine_dicom::{CompanionParams, Source, read_deformable, write_chest_wall, write_deformable};
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::Volume;
use tempfile::TempDir;

/// A series and its export.
fn pair() -> (TempDir, Source, Source) {
    let (given, out) = (folder(&six()), TempDir::new().unwrap());
    let (ct, source, _) = read(given.path()).unwrap();
    let exported = out.path().join("ct");
    write_series(&deformed(&ct), &source, &export_params(&source), &exported, Progress::none())
        .unwrap();
    let (_, export, _) = read(&exported).unwrap();
    (out, source, export)
}

fn vectors(direction: Matrix) -> Volume<[f32; 3]> {
    let grid =
        Grid::new([4, 3, 2], Vector::new(2.5, 3.0, 3.5), Point::new(1.0, -2.0, 3.0), direction);
    Volume::from_fn(grid.unwrap(), |[i, j, k]| [i as f32 + 0.25, -(j as f32), 10.0 * k as f32])
}

#[test]
fn a_deformable_registration_keeps_every_vector_in_its_place() {
    let (dir, source, export) = pair();
    let (sin, cos) = 0.4_f64.sin_cos();
    let turned = Matrix::new(cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos);
    for (n, direction) in [Matrix::identity(), turned].into_iter().enumerate() {
        let path = dir.path().join(format!("{n}.dcm"));
        let meant = vectors(direction);
        let info = write_deformable(&meant, &source, &export, &params(&source), &path).unwrap();
        let found = read_deformable(&path).unwrap();
        assert_eq!(found.object, info);
        // The object lies in the frame of what is deformed; its vectors lead to the source.
        assert_eq!(found.registered_frame_uid, export.frame_of_reference_uid());
        assert_eq!(found.source_frame_uid, source.frame_of_reference_uid());
        assert_ne!(found.registered_frame_uid, found.source_frame_uid);
        assert_eq!(found.vectors.data(), meant.data());
        let at = |v: &Volume<[f32; 3]>| v.grid().centre([3, 1, 1]);
        assert!((at(&found.vectors) - at(&meant)).norm() < 1e-9);
        let again = write_deformable(&meant, &source, &export, &params(&source), &path).unwrap();
        assert_eq!(again, info);
    }
}

#[test]
fn the_bytes_are_laid_out_as_the_standard_says() {
    let (dir, source, export) = pair();
    let path = dir.path().join("reg.dcm");
    let meant = vectors(Matrix::identity());
    write_deformable(&meant, &source, &export, &params(&source), &path).unwrap();
    let object = open_file(&path).unwrap();
    let item =
        object.element(tags::DEFORMABLE_REGISTRATION_SEQUENCE).unwrap().items().unwrap()[0].clone();
    assert!(
        item.element(tags::REGISTRATION_TYPE_CODE_SEQUENCE).unwrap().items().unwrap().is_empty()
    );
    assert_eq!(item.element(tags::REFERENCED_IMAGE_SEQUENCE).unwrap().items().unwrap().len(), 6);
    let grid = item.element(tags::DEFORMABLE_REGISTRATION_GRID_SEQUENCE).unwrap().items().unwrap()
        [0]
    .clone();
    let element = |tag| grid.element(tag).unwrap().clone();
    assert_eq!(element(tags::GRID_DIMENSIONS).vr(), VR::UL);
    assert_eq!(element(tags::GRID_DIMENSIONS).to_multi_int::<u32>().unwrap(), [4, 3, 2]);
    assert_eq!(element(tags::GRID_RESOLUTION).vr(), VR::FD);
    assert_eq!(element(tags::GRID_RESOLUTION).to_multi_float64().unwrap(), [2.5, 3.0, 3.5]);
    assert_eq!(element(tags::VECTOR_GRID_DATA).vr(), VR::OF);
    let bytes = element(tags::VECTOR_GRID_DATA).to_bytes().unwrap().into_owned();
    // Place (3, 1, 1): x of the grid fastest, three numbers each.
    let at = 4 * 3 * ((3 + 1) * 4 + 3);
    let number =
        |n: usize| f32::from_le_bytes(bytes[at + 4 * n..at + 4 * n + 4].try_into().unwrap());
    assert_eq!([0, 1, 2].map(number), [3.25, -1.0, 10.0]);
}

#[test]
fn the_rigid_one_says_where_it_holds() {
    let (dir, source, export) = pair();
    let path = dir.path().join("rigid.dcm");
    let wall = CompanionParams { series_description: "CHEST WALL ONLY".into(), ..params(&source) };
    write_chest_wall(&source, &export, &wall, &path).unwrap();
    let object = open_file(&path).unwrap();
    assert_eq!(
        text(&object, tags::FRAME_OF_REFERENCE_UID).trim_end_matches('\0'),
        export.frame_of_reference_uid()
    );
    let items = object.element(tags::REGISTRATION_SEQUENCE).unwrap().items().unwrap();
    let frames: Vec<String> = items
        .iter()
        .map(|i| i.element(tags::FRAME_OF_REFERENCE_UID).unwrap().to_str().unwrap().into_owned())
        .collect();
    assert_eq!(frames, [export.frame_of_reference_uid(), source.frame_of_reference_uid()]);
    let said = read_deformable(&path).unwrap_err().to_string();
    assert!(said.contains("not a deformable registration: Spatial Registration"), "{said}");
}

#[test]
fn what_cannot_be_registered_is_refused_and_leaves_nothing() {
    let (dir, source, export) = pair();
    let path = dir.path().join("reg.dcm");
    let before = contents_of(&dir);
    let mut odd = vectors(Matrix::identity());
    odd.data_mut()[5][1] = f32::NAN;
    let mirrored = vectors(Matrix::from_diagonal(&Vector::new(1.0, 1.0, -1.0)));
    for (vectors, word) in [(odd, "not finite"), (mirrored, "do not follow")] {
        let error = write_deformable(&vectors, &source, &export, &params(&source), &path);
        let said = error.unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(contents_of(&dir), before);
    // A matrix besides the grid is not ignored.
    write_deformable(&vectors(Matrix::identity()), &source, &export, &params(&source), &path)
        .unwrap();
    let mut object = open_file(&path).unwrap();
    let mut item =
        object.element(tags::DEFORMABLE_REGISTRATION_SEQUENCE).unwrap().items().unwrap()[0].clone();
    let mut matrix =
        item.element(tags::PRE_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE).unwrap().items().unwrap()
            [0]
        .clone();
    matrix.put_str(
        tags::FRAME_OF_REFERENCE_TRANSFORMATION_MATRIX,
        VR::DS,
        "1\\0\\0\\5\\0\\1\\0\\0\\0\\0\\1\\0\\0\\0\\0\\1",
    );
    let items = |item| dicom_core::value::DataSetSequence::from(vec![item]);
    item.put(dicom_core::DataElement::new(
        tags::PRE_DEFORMATION_MATRIX_REGISTRATION_SEQUENCE,
        VR::SQ,
        items(matrix),
    ));
    object.put(dicom_core::DataElement::new(
        tags::DEFORMABLE_REGISTRATION_SEQUENCE,
        VR::SQ,
        items(item),
    ));
    put(&mut object, tags::CONTENT_LABEL, VR::CS, "ODD");
    object.write_to_file(&path).unwrap();
    let said = read_deformable(&path).unwrap_err().to_string();
    assert!(said.contains("a matrix besides"), "{said}");
}

fn contents_of(dir: &TempDir) -> usize {
    contents(&dir.path().join("ct")).len() + std::fs::read_dir(dir.path()).unwrap().count()
}

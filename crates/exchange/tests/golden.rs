//! Files that other tools wrote (`data/make.py`) are read with the geometry and values they have.

use std::path::PathBuf;
use supine_exchange::{
    Segments, SuppliedLabels, read_ct, read_labels, read_points, read_seeds, read_supplied_labels,
    read_vtu,
};
use supine_mesh::Order;
use supine_space::{Grid, Matrix, Point, Progress, Vector};
use supine_volume::SeedKind;

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Rz(0.5) Ry(-0.2) Rx(0.3), as `make.py` has it.
fn direction() -> Matrix {
    let turn = |axis: usize, angle: f64| {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut m = Matrix::identity();
        (m[(b, b)], m[(c, c)]) = (angle.cos(), angle.cos());
        (m[(b, c)], m[(c, b)]) = (-angle.sin(), angle.sin());
        m
    };
    turn(2, 0.5) * turn(1, -0.2) * turn(0, 0.3)
}

fn expect_grid(name: &str, grid: &Grid, left_handed: bool, tolerance: f64) {
    let mut direction = direction();
    if left_handed {
        direction.column_mut(1).neg_mut();
    }
    assert_eq!(grid.size(), [5, 6, 7], "{name}");
    assert!((grid.spacing() - Vector::new(0.7, 1.1, 2.5)).norm() < tolerance, "{name}: {grid:?}");
    assert!((grid.origin() - Point::new(-20.25, 5.5, 100.125)).norm() < tolerance, "{name}");
    assert!((grid.direction() - direction).abs().max() < tolerance, "{name}: {grid:?}");
}

#[test]
fn volumes_of_other_tools() {
    // NRRD is text with 17 digits, NIfTI f32; a qform loses more in its square root.
    for (name, left_handed, tolerance) in [
        ("sitk.nrrd", false, 1e-14),
        ("sitk_left_handed.nrrd", true, 1e-14),
        ("sitk_float.nrrd", false, 1e-14),
        ("pynrrd_ras_big_raw.nrrd", false, 1e-14),
        ("pynrrd_las_ascii.nrrd", false, 1e-14),
        ("sitk.nii.gz", false, 2e-7),
        ("nibabel_qform.nii.gz", false, 2e-7),
        ("nibabel_qform_left_handed.nii.gz", true, 5e-7),
        ("nibabel_sform_big_scaled.nii.gz", false, 2e-7),
        ("sitk.mha", false, 1e-14),
        ("sitk_left_handed.mha", true, 1e-14),
        ("big.mhd", false, 1e-14),
    ] {
        let ct = read_ct(&data(name), Progress::none()).unwrap().ct;
        expect_grid(name, ct.grid(), left_handed, tolerance);
        for (n, &value) in ct.data().iter().enumerate() {
            let [i, j, k] = ct.grid().voxel(n);
            assert_eq!(i32::from(value), (i + 10 * j + 100 * k) as i32 - 300, "{name}");
        }
    }
}

#[test]
fn segmentations_in_the_layout_of_slicer() {
    let label = |[i, j, k]: [usize; 3]| match (i, j, k) {
        (0..2, ..) => 1,
        (_, 0..3, _) => 2,
        (.., 3) => 9,
        _ => 0,
    };
    for name in ["slicer_values.seg.nrrd", "slicer_layers.seg.nrrd", "slicer_cropped.seg.nrrd"] {
        let labels = read_labels(&data(name), Progress::none()).unwrap();
        expect_grid(name, labels.grid(), false, 1e-14);
        for (n, &value) in labels.data().iter().enumerate() {
            let voxel = labels.grid().voxel(n);
            let [i, j, k] = voxel;
            let kept =
                !name.contains("cropped") || (1..4).contains(&i) && j < 5 && (2..6).contains(&k);
            assert_eq!(value, if kept { label(voxel) } else { 0 }, "{name} {voxel:?}");
        }
    }
}

fn segments(name: &str) -> Segments {
    match read_supplied_labels(&data(name), Progress::none()).expect("the file is read") {
        SuppliedLabels::Segments(segments) => segments,
        SuppliedLabels::Numbers(_) => panic!("{name}: the names are not seen"),
    }
}

#[test]
fn segments_that_overlap_keep_their_names_and_voxels() {
    let segments = segments("slicer5_overlap.seg.nrrd");
    let names: Vec<&str> = segments.names().collect();
    assert_eq!(names, ["Left breast", "Thoracic wall", "Mass", "Segment_4"]);
    // The file begins at voxel (1, 0, 2) of its reference and holds 3 x 5 x 4.
    let held = |[i, j, k]: [usize; 3]| (1..4).contains(&i) && j < 5 && (2..6).contains(&k);
    let expected: [fn([usize; 3]) -> bool; 4] = [
        |[i, ..]| i == 1,
        |[i, ..]| i > 1,
        |[i, j, k]| i == 1 && (1..3).contains(&j) && k == 3,
        |_| false,
    ];
    for (n, expected) in expected.into_iter().enumerate() {
        let mask = segments.mask(n);
        expect_grid(names[n], mask.grid(), false, 1e-14);
        for (place, &on) in mask.data().iter().enumerate() {
            let voxel = mask.grid().voxel(place);
            assert_eq!(on, held(voxel) && expected(voxel), "{} {voxel:?}", names[n]);
        }
    }
}

#[test]
fn names_in_a_nifti_header_are_read() {
    let name = "totalsegmentator_ml.nii.gz";
    let segments = segments(name);
    let names: Vec<&str> = segments.names().collect();
    assert_eq!(names, ["liver", "rib_left_1", "sternum", "costal_cartilages"]);
    let rib = segments.mask(1);
    expect_grid(name, rib.grid(), false, 2e-7);
    assert!((0..rib.data().len()).all(|n| rib.data()[n] == (rib.grid().voxel(n)[0] == 1)));
}

#[test]
fn masks_of_the_whole_body_are_seeds_where_they_are_of_the_thorax() {
    let wall = Some(SeedKind::ChestWall);
    let at = |name: &str, i: usize, j: usize| {
        let seeds = read_seeds(&data(name), Progress::none()).unwrap();
        seeds.painted[0].at([i, j, 3])
    };
    // Liver, first rib, sternum, nothing, cartilage.
    let name = "totalsegmentator_ml.nii.gz";
    let found = [at(name, 0, 0), at(name, 1, 0), at(name, 2, 0), at(name, 2, 2), at(name, 2, 5)];
    assert_eq!(found, [None, wall, wall, None, wall]);
    // In 3D Slicer the classes' names are the segments' IDs; the lungs are passed over.
    let name = "slicer_totalsegmentator.seg.nrrd";
    assert_eq!([0, 1, 2].map(|i| at(name, i, 0)), [None, wall, None]);
}

#[test]
fn markups_of_slicer_are_in_lps_whatever_they_were_saved_in() {
    for system in ["LPS", "RAS"] {
        let path = data(&format!("slicer5_{system}.mrk.json"));
        let points = read_points(&path).unwrap();
        // The third point was announced and never placed.
        assert_eq!(points.len(), 2, "{system}");
        assert!((points[0].position - Point::new(50.5, -201.25, -585.0)).norm() < 1e-12);
        let seeds = read_seeds(&path, Progress::none()).unwrap();
        assert_eq!((seeds.chest_wall.len(), seeds.soft_tissue.len()), (2, 0), "{system}");
    }
}

#[test]
fn meshes_of_other_tools() {
    let field = |p: &Point| Vector::new(p.x * p.y, p.z * p.z - p.x, 0.5 * p.y);
    for (name, order) in [
        ("meshio_zlib.vtu", Order::Linear),
        ("meshio_plain.vtu", Order::Linear),
        ("meshio_ascii.vtu", Order::Linear),
        ("pyvista_quadratic.vtu", Order::Quadratic),
        ("pyvista_ascii.vtu", Order::Quadratic),
        ("vtk_appended_raw.vtu", Order::Quadratic),
        ("vtk_appended_base64.vtu", Order::Quadratic),
    ] {
        let (mesh, displacement) = read_vtu(&data(name)).unwrap();
        assert_eq!((mesh.points().len(), mesh.tets().len()), (8, 6), "{name}");
        let tags: Vec<u8> = mesh.boundary().iter().map(|f| f.tag.number()).collect();
        assert_eq!(tags, [1, 2, 3, 1, 2, 3, 1, 2, 3, 1, 2, 3], "{name}");
        let displacement = displacement.unwrap();
        assert_eq!(displacement.order(), order, "{name}");
        let edges = supine_mesh::Edges::new(&mesh);
        let l = [0.1, 0.2, 0.3, 0.4];
        for tet in 0..6 {
            let corners = mesh.corners(tet);
            let p = corners.iter().zip(l).map(|(c, l)| c.coords * l).sum::<Vector>();
            let expected = match order {
                Order::Linear => corners.iter().zip(l).map(|(c, l)| field(c) * l).sum(),
                Order::Quadratic => field(&p.into()),
            };
            let got = displacement.at(&mesh, &edges, tet, l);
            assert!((got - expected).norm() < 1e-6, "{name}, tetrahedron {tet}: {got}");
        }
    }
}

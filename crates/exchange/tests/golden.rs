//! Files that other tools wrote (`data/make.py`) are read with the geometry and values they have.

use std::path::PathBuf;
use supine_exchange::{read_ct, read_labels, read_vtu};
use supine_mesh::Order;
use supine_space::{Grid, Matrix, Point, Vector};

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
    ] {
        let ct = read_ct(&data(name)).unwrap();
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
        let labels = read_labels(&data(name)).unwrap();
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

//! Sections of a mesh, on the block of the phantom.

use crate::phantom::block;
use supine_mesh::{BoundaryTag, Displacement, Edges, FaceCut, Faces, TetMesh, below, det_f};
use supine_space::{Plane, Point, Vector, View};

fn plane() -> Plane {
    let frame = [Point::new(-30.0, -30.0, -30.0), Point::new(30.0, 30.0, 30.0)];
    Plane::new(View::Sagittal, &Point::new(3.3, 0.0, 0.0), frame, 0.5)
}

/// The displacement x -> field(x) - x of a block, of second order.
fn quadratic(mesh: &TetMesh, edges: &Edges, u: impl Fn(Vector) -> Vector) -> Displacement {
    let mut values: Vec<Vector> = mesh.points().iter().map(|p| u(p.coords)).collect();
    values.extend(edges.ends().iter().map(|e| {
        let [a, b] = e.map(|p| mesh.points()[p as usize].coords);
        u((a + b) / 2.0)
    }));
    Displacement::new(mesh, edges, values).unwrap()
}

#[test]
fn every_pixel_inside_has_its_tetrahedron() {
    let (mesh, plane) = (block(3, 40.0), plane());
    let below = below(&mesh, &plane);
    for (n, found) in below.iter().enumerate() {
        let spot = [n % plane.width, n / plane.width].map(|c| c as f64);
        let p = plane.patient(spot);
        let inside = p.coords.abs().max() <= 20.0;
        assert_eq!(found.is_some(), inside, "{p}");
        if let Some((tet, l)) = found {
            let corners = mesh.corners(*tet);
            let back: Vector = corners.iter().zip(l).map(|(c, l)| c.coords * *l).sum();
            assert!((back - p.coords).norm() < 1e-12);
        }
    }
    assert_eq!(below.iter().flatten().count(), 80 * 80);
}

#[test]
fn det_f_of_a_quadratic_field_is_exact() {
    let mesh = block(2, 40.0);
    let edges = Edges::new(&mesh);
    let u = |p: Vector| Vector::new(0.002 * p.x * p.x, 0.1 * p.y + 0.01 * p.x * p.z, 0.0);
    let field = quadratic(&mesh, &edges, u);
    let l = [0.1, 0.2, 0.3, 0.4];
    for tet in 0..mesh.tets().len() {
        let x: f64 = mesh.corners(tet).iter().zip(l).map(|(c, l)| c.x * l).sum();
        let want = (1.0 + 0.004 * x) * 1.1;
        let j = det_f(&mesh, &edges, &field, tet, l);
        assert!((j - want).abs() < 1e-12, "tetrahedron {tet}: {j} {want}");
    }
    let linear = mesh.points().iter().map(|p| p.coords * 0.1).collect();
    let linear = Displacement::new(&mesh, &edges, linear).unwrap();
    assert!((det_f(&mesh, &edges, &linear, 5, l) - 1.331).abs() < 1e-12);
}

#[test]
fn the_boundary_is_cut_in_a_closed_line_of_the_right_length() {
    let mesh = block(3, 40.0);
    let edges = Edges::new(&mesh);
    let (faces, plane) = (Faces::new(&mesh), plane());
    let length = |cuts: &[FaceCut], tag| -> f64 {
        let lines = cuts.iter().filter(|c| c.tag == Some(tag)).map(|c| c.segment);
        lines.map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]) * plane.pixel_mm).sum()
    };
    let cuts = faces.cut(&edges, None, &plane);
    for (tag, want) in
        [(BoundaryTag::Skin, 40.0), (BoundaryTag::ChestWall, 40.0), (BoundaryTag::Cut, 80.0)]
    {
        assert!((length(&cuts, tag) - want).abs() < 1e-9, "{tag:?}");
    }
    let stretch = quadratic(&mesh, &edges, |p| Vector::new(0.0, 0.0, 0.25 * p.z));
    let cuts = faces.cut(&edges, Some(&stretch), &plane);
    assert!((length(&cuts, BoundaryTag::Skin) - 50.0).abs() < 1e-9);
    let skin = cuts.iter().find(|c| c.tag == Some(BoundaryTag::Skin)).unwrap();
    assert!((plane.patient(skin.segment[0]).y + 20.0).abs() < 1e-9, "the skin is in front");
}

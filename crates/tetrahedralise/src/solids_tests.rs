//! Meshes of closed surfaces whose shape is known.

use crate::{Domain, Error, Params, SolidError, Solids};
use supine_mesh::{BoundaryTag, TetMesh, TriSurface, quality};
use supine_space::{Point, Progress, Sphere, Vector};
use supine_volume::{Region, label};

/// A body that lies on its back (front at -y) and the rigid part in it: centre and half axes, mm.
const BODY: ([f64; 3], [f64; 3]) = ([0.0, 40.0, 0.0], [90.0, 80.0, 95.0]);
const WALL: ([f64; 3], [f64; 3]) = ([0.0, 48.0, 0.0], [78.0, 58.0, 80.0]);

/// An ellipsoid of quads on a cube, cut into triangles; the corners lie on it.
fn ellipsoid((centre, axes): ([f64; 3], [f64; 3])) -> TriSurface {
    const STEPS: u32 = 48;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for face in 0..6 {
        let (axis, up) = (face / 2, f64::from(face as u8 % 2) * 2.0 - 1.0);
        let first = points.len() as u32;
        for n in 0..(STEPS + 1) * (STEPS + 1) {
            let across = |m: u32| f64::from(m) / f64::from(STEPS) * 2.0 - 1.0;
            let mut p = [0.0; 3];
            (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) =
                (up, across(n % (STEPS + 1)), across(n / (STEPS + 1)));
            let d = Vector::from(p).normalize();
            points.push(Point::from(centre) + d.component_mul(&Vector::from(axes)));
        }
        for n in 0..STEPS * STEPS {
            let a = first + n % STEPS + n / STEPS * (STEPS + 1);
            let [b, c, d] = [a + 1, a + STEPS + 2, a + STEPS + 1];
            let quad = if up > 0.0 { [a, b, c, d] } else { [a, d, c, b] };
            triangles.push([quad[0], quad[1], quad[2]]);
            triangles.push([quad[0], quad[2], quad[3]]);
        }
    }
    TriSurface::new(points, triangles).unwrap()
}

/// About mm outside an ellipsoid, near it.
fn outside((centre, axes): ([f64; 3], [f64; 3]), p: &Point) -> f64 {
    let q = (p - Point::from(centre)).component_div(&Vector::from(axes));
    let slope = q.component_div(&Vector::from(axes)) / q.norm();
    (q.norm() - 1.0) / slope.norm()
}

fn sphere() -> Sphere {
    Sphere::new(Point::new(0.0, -35.0, 0.0), 45.0).unwrap()
}

fn meshed(skin: &TriSurface, wall: &TriSurface) -> (TetMesh, Vec<supine_space::Warning>) {
    let params = Params { tetrahedra: 2000, ..Params::default() };
    let solids = Solids::new(skin, wall, sphere(), &params, Progress::none()).unwrap();
    let region = Region::new(solids.labels.clone(), sphere()).unwrap();
    let region = region.with_surfaces(solids.surfaces.clone()).unwrap();
    let domain = Domain::new(&region, &params, Progress::none()).unwrap();
    (domain.mesh(2000, Progress::none()).unwrap().0, solids.warnings)
}

/// Mean and largest distance of points of the boundary with a tag from an ellipsoid, mm.
fn off(mesh: &TetMesh, tag: BoundaryTag, shape: ([f64; 3], [f64; 3])) -> (f64, f64) {
    let centroids = mesh.boundary().iter().filter(|f| f.tag == tag).map(|f| {
        let [a, b, c] = f.points.map(|p| mesh.points()[p as usize].coords);
        outside(shape, &Point::from((a + b + c) / 3.0)).abs()
    });
    let all: Vec<f64> = centroids.collect();
    (all.iter().sum::<f64>() / all.len() as f64, all.iter().copied().fold(0.0, f64::max))
}

fn assert_right(mesh: &TetMesh) {
    assert_eq!(mesh.tets().len(), 2000);
    assert!(quality(mesh).min_dihedral_deg >= 30.0, "{:?}", quality(mesh));
    let (skin, wall) =
        (off(mesh, BoundaryTag::Skin, BODY), off(mesh, BoundaryTag::ChestWall, WALL));
    assert!(skin.0 < 0.08 && skin.1 < 0.4, "{skin:?}");
    assert!(wall.0 < 0.08 && wall.1 < 0.4, "{wall:?}");
    assert!(mesh.area(BoundaryTag::Cut) > 100.0);
}

#[test]
fn a_mesh_lies_on_the_surfaces_it_was_made_of() {
    let (mesh, warnings) = meshed(&ellipsoid(BODY), &ellipsoid(WALL));
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_right(&mesh);
}

/// The soft tissue alone as a surface: the body, and the chest wall `gap` mm wider as a hollow in
/// it.
fn hollow(gap: f64) -> TriSurface {
    let (body, wall) = (ellipsoid(BODY), ellipsoid((WALL.0, WALL.1.map(|a| a + gap))));
    let first = body.points().len() as u32;
    let inwards = wall.triangles().iter().map(|&[a, b, c]| [a, c, b].map(|p| p + first));
    let triangles = body.triangles().iter().copied().chain(inwards).collect();
    TriSurface::new([body.points(), wall.points()].concat(), triangles).unwrap()
}

#[test]
fn a_surface_of_the_soft_tissue_alone_gives_the_same_with_a_gap_to_the_chest_wall() {
    for gap in [-0.4, 0.0, 0.4] {
        let (mesh, warnings) = meshed(&hollow(gap), &ellipsoid(WALL));
        assert!(warnings.is_empty(), "{warnings:?}");
        let skin = off(&mesh, BoundaryTag::Skin, BODY);
        assert!(skin.0 < 0.08 && skin.1 < 0.4, "gap {gap}: {skin:?}");
        let wall = off(&mesh, BoundaryTag::ChestWall, WALL);
        assert!(wall.0 < 0.08 + gap.max(0.0), "gap {gap}: {wall:?}");
        assert_eq!(mesh.tets().len(), 2000);
        assert!(quality(&mesh).min_dihedral_deg >= 30.0, "gap {gap}: {:?}", quality(&mesh));
    }
}

#[test]
fn surfaces_that_overlap_count_once_and_are_told() {
    let (whole, inner) = (ellipsoid(BODY), ellipsoid(([30.0, 30.0, 0.0], [40.0; 3])));
    let first = whole.points().len() as u32;
    let beside = inner.triangles().iter().map(|t| t.map(|p| p + first));
    let triangles = whole.triangles().iter().copied().chain(beside).collect();
    let both = TriSurface::new([whole.points(), inner.points()].concat(), triangles).unwrap();
    let (mesh, warnings) = meshed(&both, &ellipsoid(WALL));
    assert!(warnings.len() == 1 && warnings[0].code() == "surface-crosses-itself", "{warnings:?}");
    assert_right(&mesh);
}

fn refusal(skin: &TriSurface, wall: &TriSurface) -> SolidError {
    match Solids::new(skin, wall, sphere(), &Params::default(), Progress::none()) {
        Err(Error::Solid(error)) => error,
        other => panic!("not refused: {:?}", other.map(|s| s.warnings)),
    }
}

#[test]
fn surfaces_of_another_size_or_place_are_refused_by_name() {
    let (body, wall) = (ellipsoid(BODY), ellipsoid(WALL));
    let metres = ellipsoid((BODY.0.map(|c| c / 1e3), BODY.1.map(|a| a / 1e3)));
    let error = refusal(&metres, &wall).to_string();
    assert!(error.contains("skin is only 0.190 mm") && error.contains("metres"), "{error}");
    let centimetres = ellipsoid((WALL.0.map(|c| c / 10.0), WALL.1.map(|a| a / 10.0)));
    let error = refusal(&body, &centimetres).to_string();
    assert!(error.contains("chest wall") && error.contains("centimetres"), "{error}");
    let turned = ellipsoid(([0.0, 80.0, 0.0], [47.0, 35.0, 48.0]));
    let error = refusal(&body, &turned).to_string();
    assert!(error.contains("does not reach") && error.contains("other frame"), "{error}");
    let apart = ellipsoid(([0.0, -110.0, 0.0], [60.0, 60.0, 60.0]));
    let behind = ellipsoid(([0.0, 60.0, 0.0], [60.0; 3]));
    let error = refusal(&apart, &behind);
    assert!(matches!(error, SolidError::Apart { .. }), "{error}");
}

#[test]
fn labels_and_distances_agree() {
    let params = Params::default();
    let solids = Solids::new(&hollow(0.4), &ellipsoid(WALL), sphere(), &params, Progress::none());
    let Solids { labels, surfaces, .. } = solids.unwrap();
    for (n, &value) in labels.data().iter().enumerate() {
        let (skin, wall) = (surfaces.skin.is_inside(n), surfaces.chest_wall.is_inside(n));
        let expected = match (skin, wall) {
            (true, true) => label::CHEST_WALL,
            (true, false) => label::SOFT_TISSUE,
            (false, false) => label::OUTSIDE,
            (false, true) => panic!("chest wall outside the body at voxel {n}"),
        };
        assert_eq!(value, expected);
    }
}

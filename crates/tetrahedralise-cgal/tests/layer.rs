//! CGAL on a flat layer inside a sphere, whose volume, areas and rims are known.
#![cfg(feature = "cgal")]
#![expect(clippy::unwrap_used, reason = "a panic is a failed test")]

use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Point, Progress, Sphere};
use supine_tetrahedralise_cgal::{Error, Params, Solid, tetrahedralise};

const CENTRE: Point = Point::new(40.0, -110.0, -500.0);
const RADIUS: f64 = 30.0;
/// The layer lies between these heights above the centre, mm.
const WALL: f64 = -6.0;
const SKIN: f64 = 9.0;

fn beyond(p: &Point) -> Option<BoundaryTag> {
    let off = p - CENTRE;
    if off.z > SKIN {
        Some(BoundaryTag::Skin)
    } else if off.z < WALL {
        Some(BoundaryTag::ChestWall)
    } else if off.norm() > RADIUS {
        Some(BoundaryTag::Cut)
    } else {
        None
    }
}

/// Where the plane at a height meets the sphere.
fn circle(height: f64) -> Vec<Point> {
    let radius = (RADIUS * RADIUS - height * height).sqrt();
    let at = |n: usize| {
        let angle = std::f64::consts::TAU * (n % 200) as f64 / 200.0;
        CENTRE + supine_space::Vector::new(radius * angle.cos(), radius * angle.sin(), height)
    };
    (0..=200).map(at).collect()
}

fn mesh(params: &Params, progress: Progress<'_>) -> Result<TetMesh, Error> {
    let sphere = Sphere::new(CENTRE, RADIUS).unwrap();
    let rims = [circle(WALL), circle(SKIN)];
    let solid = Solid { beyond: &beyond, sphere, rims: &rims };
    tetrahedralise(&solid, params, progress)
}

fn assert_near(what: &str, found: f64, true_value: f64, share: f64) {
    assert!((found / true_value - 1.0).abs() < share, "{what}: {found} where {true_value} is true");
}

#[test]
fn volume_tags_and_rims_are_those_of_the_layer() {
    let params = Params { edge_mm: 5.0, ..Params::default() };
    let mesh = mesh(&params, Progress::none()).unwrap();
    assert!(mesh.tets().len() > 500, "{}", mesh.tets().len());
    let pi = std::f64::consts::PI;
    let below = |h: f64| pi * (RADIUS * RADIUS * h - h.powi(3) / 3.0);
    assert_near("volume", mesh.total_volume(), below(SKIN) - below(WALL), 0.03);
    let disc = |h: f64| pi * (RADIUS * RADIUS - h * h);
    assert_near("skin", mesh.area(BoundaryTag::Skin), disc(SKIN), 0.02);
    assert_near("chest wall", mesh.area(BoundaryTag::ChestWall), disc(WALL), 0.02);
    assert_near("cut", mesh.area(BoundaryTag::Cut), 2.0 * pi * RADIUS * (SKIN - WALL), 0.03);
    for face in mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin) {
        for p in face.points.map(|v| mesh.points()[v as usize]) {
            assert!((p.z - CENTRE.z - SKIN).abs() < 0.02, "{p} is not on the skin");
        }
    }
}

#[test]
fn the_same_mesh_each_time() {
    let params = Params { edge_mm: 8.0, ..Params::default() };
    let [a, b] = [(); 2].map(|()| mesh(&params, Progress::none()).unwrap());
    assert_eq!(a, b);
}

#[test]
fn it_stops_when_told() {
    let params = Params { edge_mm: 3.0, ..Params::default() };
    let stop = |share: f64| share < 0.3;
    assert!(matches!(mesh(&params, Progress::new(&stop)), Err(Error::Stopped(_))));
}

#[test]
fn settings_out_of_range_are_named() {
    let params = Params { edge_mm: 0.0, ..Params::default() };
    let error = mesh(&params, Progress::none()).unwrap_err().to_string();
    assert!(error.contains("edge_mm = 0") && error.contains("0.1 to 100"), "{error}");
}

use super::*;
use crate::tet_mesh::tests::cube;
use crate::{BoundaryFace, Edges, TetMesh};
use proptest::prelude::*;
use std::sync::Arc;
use supine_space::Point;

/// A cube of side 20 mm from the origin: chest wall at z = 0, cut at x = 0, the rest skin.
fn block() -> Arc<TetMesh> {
    let small = cube();
    let points: Vec<Point> = small.points().iter().map(|p| p * 10.0).collect();
    let tag = |f: &BoundaryFace| {
        let all = |axis: usize| f.points.iter().all(|&p| points[p as usize][axis] == 0.0);
        match (all(2), all(0)) {
            (true, _) => BoundaryTag::ChestWall,
            (_, true) => BoundaryTag::Cut,
            _ => BoundaryTag::Skin,
        }
    };
    let boundary = small.boundary().iter().map(|f| BoundaryFace { tag: tag(f), ..*f }).collect();
    Arc::new(TetMesh::new(points.clone(), small.tets().to_vec(), boundary).unwrap())
}

fn moved(mesh: &TetMesh, order: Order, field: impl Fn(&Point) -> Vector) -> Displacement {
    let edges = Edges::new(mesh);
    let mut values: Vec<Vector> = mesh.points().iter().map(&field).collect();
    if order == Order::Quadratic {
        values.extend(edges.ends().iter().map(|ends| {
            let [a, b] = ends.map(|p| mesh.points()[p as usize]);
            field(&(a + (b - a) * 0.5))
        }));
    }
    Displacement::new(mesh, &edges, values).unwrap()
}

/// Nothing at the chest wall, twisted and stretched above it.
fn bent(p: &Point) -> Vector {
    let z = p.z / 20.0;
    Vector::new(
        6.0 * z * z - 0.2 * p.y * z,
        3.0 * z + 0.01 * p.x * p.z,
        -4.0 * z * z + 0.1 * p.x * z,
    )
}

const BOTH: [Order; 2] = [Order::Linear, Order::Quadratic];
const NEAR: Surround = Surround { rigid_mm: 3.0, reach_mm: 11.0 };

fn around() -> impl Strategy<Value = Point> {
    [-16.0..36.0f64, -16.0..36.0f64, -16.0..36.0f64].prop_map(Point::from)
}

/// Whether places lie in the same tetrahedron, or their feet on the same face, edge or corner.
fn same_region(a: &Place, b: &Place) -> bool {
    match (a, b) {
        (Place::Inside(a), Place::Inside(b)) => a.tet == b.tet,
        (Place::Beside(a), Place::Beside(b)) => a.face == b.face && a.slopes == b.slopes,
        _ => a == b,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_derivative_is_that_of_the_value(p in around(), quadratic: bool) {
        let mesh = block();
        let u = moved(&mesh, BOTH[usize::from(quadratic)], bent);
        let embedding = Arc::new(Embedding::new(mesh.clone()));
        let motion = Motion::new(embedding.clone(), u, NEAR).unwrap();
        let here = embedding.place(&p);
        let Some(gradient) = motion.gradient(&here) else {
            prop_assert!(motion.at(&here).is_none());
            return Ok(());
        };
        let step = 1e-5;
        for axis in 0..3 {
            let mut along = Vector::zeros();
            along[axis] = step;
            let [up, down] = [p + along, p - along].map(|p| embedding.place(&p));
            if !same_region(&up, &here) || !same_region(&down, &here) {
                continue;
            }
            let slope = (motion.at(&up).unwrap() - motion.at(&down).unwrap()) / (2.0 * step);
            let error = (slope - gradient.column(axis)).norm();
            prop_assert!(error < 1e-7, "axis {axis} at {p}: {error:e} in {here:?}");
        }
    }

    /// From anywhere to close by: inside, through the skin, over edges and corners, past the reach.
    #[test]
    fn the_value_has_no_steps(p in around(), way in around(), quadratic: bool) {
        let mesh = block();
        let u = moved(&mesh, BOTH[usize::from(quadratic)], bent);
        let embedding = Arc::new(Embedding::new(mesh.clone()));
        let motion = Motion::new(embedding.clone(), u, NEAR).unwrap();
        let steps = 2000;
        let mut last: Option<Vector> = None;
        for n in 0..=steps {
            let q = p + (way - p) * (f64::from(n) / f64::from(steps));
            let here = motion.at(&embedding.place(&q));
            if let (Some(last), Some(here)) = (last, here) {
                let step = (way - p).norm() / f64::from(steps);
                prop_assert!((here - last).norm() < 6.0 * step, "{last} to {here} at {q}");
            }
            last = here;
        }
    }

    /// A body that moves as a whole takes along what is near its skin as if it were part of it.
    #[test]
    fn what_is_near_follows_a_rigid_motion(
        p in around(),
        axis in [-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64],
        angle in 0.0..1.5f64,
        quadratic: bool,
    ) {
        let small = cube();
        let points = small.points().iter().map(|p| p * 10.0).collect();
        let mesh = TetMesh::new(points, small.tets().to_vec(), small.boundary().to_vec()).unwrap();
        let mesh = Arc::new(mesh);
        let axis = Vector::from(axis);
        prop_assume!(axis.norm() > 0.1);
        let axis = axis.normalize() * angle;
        // Rodrigues' formula.
        let cross = axis.cross_matrix();
        let turn = cross * (angle.sin() / angle.max(1e-9))
            + cross * cross * ((1.0 - angle.cos()) / (angle * angle).max(1e-18));
        let field = |p: &Point| turn * p.coords + Vector::new(3.0, -7.0, 5.0);
        let u = moved(&mesh, BOTH[usize::from(quadratic)], field);
        let embedding = Arc::new(Embedding::new(mesh.clone()));
        let motion = Motion::new(embedding.clone(), u, Surround { rigid_mm: 30.0, reach_mm: 31.0 }).unwrap();
        let place = embedding.place(&p);
        prop_assert!((motion.at(&place).unwrap() - field(&p)).norm() < 1e-9);
        prop_assert!((motion.gradient(&place).unwrap() - turn).norm() < 1e-9);
    }
}

#[test]
fn the_skin_itself_moves_as_the_tissue_does() {
    let mesh = block();
    let embedding = Arc::new(Embedding::new(mesh.clone()));
    for order in BOTH {
        let u = moved(&mesh, order, bent);
        let motion = Motion::new(embedding.clone(), u, Surround::default()).unwrap();
        for (n, face) in mesh.boundary().iter().enumerate() {
            let l = [0.2, 0.5, 0.3];
            let corners = face.points.map(|p| mesh.points()[p as usize]);
            let on: Vector = corners.iter().zip(l).map(|(c, l)| c.coords * l).sum();
            let out = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            let at = |t: f64| embedding.place(&Point::from(on + out * t));
            let inside = motion.at(&at(-1e-7)).unwrap();
            match face.tag {
                BoundaryTag::Skin => {
                    let Place::Beside(beside) = at(1e-7) else { panic!("face {n}") };
                    assert_eq!(mesh.boundary()[beside.face].tag, BoundaryTag::Skin);
                    assert!((motion.at(&at(1e-7)).unwrap() - inside).norm() < 1e-6, "face {n}");
                }
                BoundaryTag::ChestWall => {
                    assert_eq!((at(1e-7), at(80.0)), (Place::Wall, Place::Wall));
                    assert_eq!(motion.at(&at(80.0)), Some(Vector::zeros()));
                    assert!(inside.norm() < 1e-6);
                }
                BoundaryTag::Cut => {
                    assert_eq!(at(1e-7), Place::Beyond);
                    assert_eq!((motion.at(&at(2.0)), motion.gradient(&at(2.0))), (None, None));
                }
            }
        }
    }
}

#[test]
fn rims_belong_to_the_cut_then_to_the_wall() {
    let mesh = block();
    let embedding = Arc::new(Embedding::new(mesh.clone()));
    // Beyond the edge of cut and skin, of wall and skin, and the corner of all three.
    assert_eq!(embedding.place(&Point::new(-1.0, 21.0, 7.0)), Place::Beyond);
    assert_eq!(embedding.place(&Point::new(7.0, 21.0, -1.0)), Place::Wall);
    assert_eq!(embedding.place(&Point::new(-1.0, 21.0, -1.0)), Place::Beyond);
    assert_eq!(embedding.place(&Point::new(21.0, 21.0, -1.0)), Place::Wall);
    assert_eq!(embedding.place(&Point::new(f64::NAN, 0.0, 0.0)), Place::Beyond);
    let Place::Beside(corner) = embedding.place(&Point::new(23.0, 24.0, 20.0 + 12.0)) else {
        panic!("beside a corner of the skin")
    };
    assert!((corner.distance_mm() - 13.0).abs() < 1e-12);
}

#[test]
fn the_decay_begins_and_ends_as_stated() {
    let Surround { rigid_mm, reach_mm } = Surround::default();
    let share = |d: f64| Surround::default().share(d);
    assert_eq!((share(0.0), share(rigid_mm)), ((1.0, 0.0), (1.0, 0.0)));
    assert_eq!((share(reach_mm), share(1e6)), ((0.0, 0.0), (0.0, 0.0)));
    let step = 1e-6;
    for d in [rigid_mm, rigid_mm + 1.0, 0.5 * (rigid_mm + reach_mm), reach_mm] {
        let slope = (share(d + step).0 - share(d - step).0) / (2.0 * step);
        assert!((slope - share(d).1).abs() < 1e-6, "{d}");
        assert!(share(d).1 <= 0.0 && share(d).1 >= -1.5 / (reach_mm - rigid_mm));
    }
}

#[test]
fn many_places_are_those_of_each() {
    let mesh = block();
    let embedding = Arc::new(Embedding::new(mesh.clone()));
    let u = moved(&mesh, Order::Quadratic, bent);
    let motion = Motion::new(embedding.clone(), u, NEAR).unwrap();
    let points: Vec<Point> =
        (0..500).map(f64::from).map(|n| Point::new(n % 31.0, n % 37.0, n % 29.0)).collect();
    let places = embedding.places(&points);
    let one_by_one: Vec<_> = points.iter().map(|p| motion.at(&embedding.place(p))).collect();
    assert_eq!(motion.all(&places), one_by_one);
    assert!(one_by_one.iter().any(Option::is_none) && one_by_one.iter().any(Option::is_some));
    let points = mesh.corners(0).to_vec();
    let faces = crate::TET_FACES.map(|f| f.map(|c| c as u32));
    let boundary = faces.map(|points| BoundaryFace { points, tag: BoundaryTag::Skin }).to_vec();
    let other = TetMesh::new(points, vec![[0, 1, 2, 3]], boundary).unwrap();
    assert!(Motion::new(embedding, Displacement::zero(&other), NEAR).is_err());
}

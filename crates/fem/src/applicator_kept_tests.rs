//! What an applicator keeps from step to step, and what it must not keep.

use crate::test_mesh::block;
use crate::{
    Applicator, Body, Budget, Contact, Error, Insertion, Load, Params, RigidBody, SphereOnShaft,
    Tissue,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::{Edges, Order, TetMesh};
use supine_space::{Point, Pose, Progress, Vector, sitting, supine};

const TOLERANCE: f64 = 1e-11;
/// Nodal difference of solutions to that tolerance, mm.
const CLOSE_MM: f64 = 1e-9;
const BOTH: [Order; 2] = [Order::Linear, Order::Quadratic];

/// A cube with so many cells along its sides.
fn mesh(cells: usize) -> Arc<TetMesh> {
    block([cells; 3], 60.0 / cells as f64, 0.1)
}

/// It lies within the block as gravity has it, which is elsewhere than in the CT.
fn sphere() -> SphereOnShaft {
    SphereOnShaft { centre: Point::new(30.0, 24.0, 26.0), radius_mm: 16.0, shaft: None }
}

fn attached(cells: usize, order: Order) -> Applicator {
    let tissue = Tissue { young_kpa: 6.0, ..Tissue::default() };
    let load = Load { ct: supine(), target: sitting() };
    let params = Params { order, tolerance: TOLERANCE, ..Params::default() };
    let body = mesh(cells);
    let body = Body::new(body.clone(), tissue);
    Applicator::attach(
        &body,
        &load,
        &params,
        &Insertion::new(&sphere(), Contact::Tied),
        Progress::none(),
    )
    .unwrap()
    .0
}

/// A shift (mm), and a turn (radians) about the centre of the sphere.
fn pose(shift: [f64; 3], turn: [f64; 3]) -> Pose {
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector::from(turn));
    let turn = Pose::rotation_wrt_point(turn, sphere().centre);
    Pose::translation(shift[0], shift[1], shift[2]) * turn
}

/// Positions of all nodes, mm.
fn positions(applicator: &Applicator, mesh: &TetMesh) -> Vec<Point> {
    let edges = Edges::new(mesh);
    let mut places = mesh.points().to_vec();
    let middle = |[a, b]: &[u32; 2]| {
        nalgebra::center(&mesh.points()[*a as usize], &mesh.points()[*b as usize])
    };
    places.extend(edges.ends().iter().map(middle));
    let u = applicator.deformation().unwrap();
    places.iter().zip(u.displacement().values()).map(|(p, u)| p + u).collect()
}

fn apart(a: &[Point], b: &[Point]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn settled(applicator: &mut Applicator, mesh: &TetMesh, pose: &Pose) -> Vec<Point> {
    applicator.settle(pose, TOLERANCE, Progress::none()).unwrap();
    positions(applicator, mesh)
}

/// Trap: the nodes that follow are those within the sphere where it was attached, in the tissue as
/// gravity has it, and stay so wherever the sphere goes.
#[test]
fn the_coupled_nodes_are_those_of_the_attachment_for_good() {
    let mut others_within = 0;
    for order in BOTH {
        let (mesh, mut applicator) = (mesh(6), attached(6, order));
        let (points, first) = (mesh.points(), positions(&applicator, &mesh));
        let (wall, close) = (|p: &Point| p.z.abs() < 1e-9, 1e-4 * sphere().radius_mm);
        let within: Vec<usize> = (0..first.len())
            .filter(|&n| !wall(&first[n]) && sphere().distance(&first[n]) <= close)
            .collect();
        let in_ct: Vec<usize> =
            (0..points.len()).filter(|&n| sphere().distance(&points[n]) <= close).collect();
        let corners: Vec<usize> = within.iter().copied().filter(|&n| n < points.len()).collect();
        assert_ne!(corners, in_ct, "{order:?}: the block does not show where the set is taken");
        assert_eq!(within.len(), applicator.coupled_nodes(), "{order:?}");
        // Near, far, turned, and where other nodes come to lie within the sphere.
        let away = [
            pose([1.0, 0.5, 0.0], [0.0; 3]),
            pose([6.0, -4.0, 3.0], [0.0; 3]),
            pose([0.0, 3.0, 2.0], [0.2, 0.0, 0.3]),
        ];
        for to in away {
            let moved = settled(&mut applicator, &mesh, &to);
            let follow: Vec<usize> =
                (0..first.len()).filter(|&n| (to * first[n] - moved[n]).norm() < 1e-9).collect();
            assert_eq!(follow, within, "{order:?}");
            let centre = to * sphere().centre;
            let inside = |n: &usize| (moved[*n] - centre).norm() < sphere().radius_mm;
            others_within +=
                (0..first.len()).filter(inside).filter(|n| !within.contains(n)).count();
            assert_eq!(applicator.coupled_nodes(), within.len());
        }
        // Back where it was, everything is as it was.
        let back = settled(&mut applicator, &mesh, &Pose::identity());
        assert!(apart(&back, &first) < CLOSE_MM, "{order:?}: {:e}", apart(&back, &first));
    }
    assert!(others_within > 0, "no pose had other nodes within the sphere");
}

/// Trap: what a failed or stopped step leaves behind spoils the steps after it.
#[test]
fn a_failed_step_leaves_nothing_behind() {
    for order in BOTH {
        let to = pose([2.0, -1.0, 1.5], [0.1, 0.0, -0.2]);
        let (mesh, mut applicator) = (mesh(4), attached(4, order));
        let fresh = settled(&mut attached(4, order), &mesh, &to);
        let bad = pose([f64::NAN, 0.0, 0.0], [0.0; 3]);
        assert!(matches!(applicator.step(&bad), Err(Error::ApplicatorPose)));
        assert_eq!(applicator.pose(), &Pose::identity());
        assert!(apart(&settled(&mut applicator, &mesh, &to), &fresh) < CLOSE_MM, "{order:?}");
        // Through the held wall, by a step and by settling.
        let through = pose([0.0, 0.0, -60.0], [0.0; 3]);
        assert!(matches!(applicator.step(&through), Err(Error::ApplicatorStuck { .. })));
        assert!(apart(&settled(&mut applicator, &mesh, &to), &fresh) < CLOSE_MM, "{order:?}");
        let stuck = applicator.settle(&through, TOLERANCE, Progress::none());
        assert!(matches!(stuck, Err(Error::ApplicatorStuck { .. })));
        assert!(apart(&settled(&mut applicator, &mesh, &to), &fresh) < CLOSE_MM, "{order:?}");
        // Stopped by the user at every place.
        let other = pose([-9.0, 6.0, 7.0], [0.3, 0.2, 0.0]);
        for calls_before in 1.. {
            let calls = AtomicUsize::new(0);
            let stop = |_: f64| calls.fetch_add(1, Ordering::Relaxed) + 1 < calls_before;
            match applicator.settle(&other, TOLERANCE, Progress::new(&stop)) {
                Ok(_) => break,
                Err(error) => assert!(matches!(error, Error::Stopped(_)), "{error}"),
            }
            assert!(
                apart(&settled(&mut applicator, &mesh, &to), &fresh) < CLOSE_MM,
                "{order:?} {calls_before}"
            );
        }
    }
}

/// Trap: where the coupled nodes alone are placed at the next pose, elements around them fold;
/// predicted first, the tissue gets there at once.
#[test]
fn tissue_is_predicted_before_the_coupled_nodes_are_placed() {
    let (mesh, mut applicator) = (mesh(6), attached(6, Order::Linear));
    let first = positions(&applicator, &mesh)[..mesh.points().len()].to_vec();
    let to = pose([10.0, 6.0, 0.0], [0.0; 3]);
    let coupled = |p: &Point| sphere().distance(p) <= 1e-4 * sphere().radius_mm;
    let placed: Vec<Point> = first.iter().map(|p| if coupled(p) { to * p } else { *p }).collect();
    let folds = |places: &[Point]| {
        let volume = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|p| places[p as usize]);
            (b - a).dot(&(c - a).cross(&(d - a)))
        };
        mesh.tets().iter().filter(|tet| volume(tet) <= 0.0).count()
    };
    assert!(folds(&placed) > 0);
    let made = applicator.settle(&to, TOLERANCE, Progress::none()).unwrap();
    // Parts of the way would each take as many.
    assert!(made.corrections <= 7, "{made:?}");
    assert_eq!(folds(&positions(&applicator, &mesh)), 0);
}

/// A step whose corrections are spent tells what it leaves; the next one to the same pose goes on
/// with it, to where a step with all corrections ends.
#[test]
fn what_a_budget_leaves_is_told_and_made_good() {
    for order in BOTH {
        let (mut live, mut exact) = (attached(4, order), attached(4, order));
        let goal = pose([2.5, 1.0, -1.5], [0.0, 0.08, 0.0]);
        let block = mesh(4);
        exact.settle(&goal, TOLERANCE, Progress::none()).unwrap();
        let exact = positions(&exact, &block);
        let one = Budget { error_mm: 0.002, corrections: 1, partly: true };
        let (mut told, mut off) = (vec![], vec![]);
        for _ in 0..16 {
            let step = live.step_quickly(&goal, one).unwrap().unwrap();
            assert_eq!((step.corrections, live.pose()), (1, &goal));
            told.push(step.error_mm);
            off.push(apart(&positions(&live, &block), &exact));
        }
        assert!(told[0] > 0.01 && off[0] > 0.01, "{order:?}: {told:?} {off:?}");
        assert!(told[15] <= 0.002 && off[15] <= 0.002, "{order:?}: {told:?} {off:?}");
        // Without leave to do so it is not made.
        let mut whole = attached(4, order);
        let none = whole.step_quickly(&goal, Budget { partly: false, ..one }).unwrap();
        assert_eq!((none, whole.pose()), (None, &Pose::identity()));
    }
}

use super::*;
use crate::rigid::SphereOnShaft;
use crate::test_mesh::block;
use crate::{Law, Membrane, RestState, SlidingArea, Tissue};
use nalgebra::UnitQuaternion;
use supine_space::{sitting, supine};

const SIDE_MM: f64 = 60.0;
pub(super) const TOLERANCE: f64 = 1e-11;

pub(super) fn sphere() -> SphereOnShaft {
    SphereOnShaft { centre: Point::new(30.0, 30.0, 32.0), radius_mm: 16.0, shaft: None }
}

fn attach(order: Order, rest: RestState, rigid: &dyn RigidBody) -> Result<Applicator, Error> {
    attach_with(order, rest, (rigid, Contact::Tied))
}

pub(super) fn attach_with(
    order: Order,
    rest: RestState,
    applicator: (&dyn RigidBody, Contact),
) -> Result<Applicator, Error> {
    let params = Params { order, rest, ..Params::default() };
    attach_in(Tissue { young_kpa: 3.0, ..Tissue::default() }, params, applicator)
}

fn attach_in(
    tissue: Tissue,
    params: Params,
    applicator: (&dyn RigidBody, Contact),
) -> Result<Applicator, Error> {
    let mesh = block([4; 3], SIDE_MM / 4.0, 0.1);
    let load = Load { ct: supine(), target: sitting() };
    let params = Params { tolerance: TOLERANCE, ..params };
    let body = Body::new(mesh.clone(), tissue);
    Ok(Applicator::attach(
        &body,
        &load,
        &params,
        &Insertion::new(applicator.0, applicator.1),
        Progress::none(),
    )?
    .0)
}

fn attached(order: Order) -> Applicator {
    attach(order, RestState::Net, &sphere()).unwrap()
}

pub(super) fn turn_about(turn: Vector, place: Point) -> Pose {
    Pose::rotation_wrt_point(UnitQuaternion::from_scaled_axis(turn), place)
}

/// A shift (mm) and a turn (radians) about the centre of the sphere.
pub(super) fn pose(shift: [f64; 3], turn: [f64; 3]) -> Pose {
    let pivot = sphere().centre;
    Pose::translation(shift[0], shift[1], shift[2]) * turn_about(Vector::from(turn), pivot)
}

/// Elastic energy less the work of gravity, mN mm.
pub(super) fn potential(applicator: &Applicator) -> f64 {
    either!(&applicator.coupling, c => {
        let (energy, _) = c.site.model.evaluate(&c.place.u).unwrap();
        energy - c.place.u.iter().zip(&c.site.load).map(|(u, f)| u.dot(f)).sum::<f64>()
    })
}

/// The work of the applicator is what the potential energy gains: force and moment are its slopes.
#[test]
fn the_reaction_is_the_slope_of_the_potential() {
    let plain = Tissue { young_kpa: 3.0, ..Tissue::default() };
    let bare = Params::default();
    let area = SlidingArea {
        centre_mm: Some([30.0, 30.0, 0.0]),
        radius_mm: 28.0,
        rim_mm: 10.0,
        stiffness_kpa_mm: 0.02,
    };
    let skin = Membrane { thickness_mm: 1.5, young_kpa: 20.0, stretch: 1.02 };
    let bodies = [
        (plain, bare),
        (Tissue { law: Law::Exponential, stiffening: 0.5, ..plain }, bare),
        (Tissue { law: Law::Gent, stiffening: 0.05, ..plain }, bare),
        (Tissue { fibres: 2.0, ..plain }, bare),
        (plain, Params { sliding: Some(area), skin: Some(skin), ..bare }),
    ];
    let orders = [Order::Linear, Order::Quadratic];
    for (order, (tissue, params)) in orders.into_iter().flat_map(|order| bodies.map(|b| (order, b)))
    {
        let held: (&dyn RigidBody, Contact) = (&sphere(), Contact::Tied);
        let mut applicator = attach_in(tissue, Params { order, ..params }, held).unwrap();
        let (shift, turn) = ([3.0, -2.0, 4.0], [0.1, 0.2, -0.1]);
        applicator.settle(&pose(shift, turn), TOLERANCE, Progress::none()).unwrap();
        let reaction = applicator.reaction();
        let h = 1e-3;
        for axis in 0..3 {
            let mut at = |t: f64, turned: bool| {
                let mut moved = shift;
                let mut more = Vector::zeros();
                if turned {
                    more[axis] = t;
                } else {
                    moved[axis] += t;
                }
                // The further turn is about the centre where it lies.
                let centre = sphere().centre + Vector::from(shift);
                let pose = turn_about(more, centre) * pose(moved, turn);
                applicator.settle(&pose, TOLERANCE, Progress::none()).unwrap();
                potential(&applicator) * 1e-3
            };
            let mut slope = |turned: bool| (at(h, turned) - at(-h, turned)) / (2.0 * h);
            let (force, moment) = (-slope(false), -slope(true));
            let (force_size, moment_size) = (reaction.force_n.norm(), reaction.moment_n_mm.norm());
            assert!((force - reaction.force_n[axis]).abs() < 1e-5 * force_size, "{order:?} {axis}");
            let apart = (moment - reaction.moment_n_mm[axis]).abs();
            assert!(apart < 1e-5 * moment_size, "{order:?} {axis}: {apart}");
        }
    }
}

/// By the elements round the nodes alone, as by all of them.
#[test]
fn forces_on_the_nodes_it_holds_are_what_is_out_of_balance_there() {
    for contact in [Contact::Tied, Contact::Frictionless] {
        let mut applicator =
            attach_with(Order::Quadratic, RestState::Net, (&sphere(), contact)).unwrap();
        applicator.step(&pose([0.6, -0.4, 0.5], [0.02, 0.0, 0.03])).unwrap();
        let all = either!(&applicator.coupling, c => c.site.out_of_balance(&c.place.u).unwrap());
        let forces = applicator.contact_forces();
        assert!(forces.len() > 20, "{contact:?}: {}", forces.len());
        let largest = forces.iter().map(|(_, force)| force.norm()).fold(0.0, f64::max);
        for (node, force) in forces {
            let off = (force - all[node as usize]).norm();
            assert!(off <= 1e-9 * largest, "{contact:?} {node}: {off} of {largest} mN");
        }
    }
}

#[test]
fn an_applicator_that_has_not_moved_bears_only_what_it_holds() {
    let applicator = attached(Order::Linear);
    // Nodes in equilibrium before they were coupled need no force.
    assert!(applicator.reaction().force_n.norm() < 1e-9);
    assert_eq!(applicator.pose(), &Pose::identity());
}

/// Trap: the nodes in the applicator placed before the others follow would fold elements.
#[test]
fn a_large_step_is_made_in_parts() {
    for order in [Order::Linear, Order::Quadratic] {
        let mut steps = attached(order);
        let far = pose([12.0, 9.0, -8.0], [0.4, 0.0, 0.5]);
        let made = steps.step(&far).unwrap();
        assert!(made.by_newton);
        let mut small = attached(order);
        for k in 1..=8 {
            let share = f64::from(k) / 8.0;
            let part =
                pose([12.0, 9.0, -8.0].map(|v| share * v), [0.4, 0.0, 0.5].map(|v| share * v));
            small.settle(&part, TOLERANCE, Progress::none()).unwrap();
        }
        let [a, b] = [&steps, &small].map(|a| a.deformation().unwrap());
        let apart = a
            .displacement()
            .values()
            .iter()
            .zip(b.displacement().values())
            .map(|(a, b)| (a - b).norm());
        assert!(apart.fold(0.0, f64::max) < 1e-4);
    }
}

/// On the way of a part the centre goes straight, wherever the frame's origin lies.
#[test]
fn parts_of_a_way_go_straight() {
    let applicator = attached(Order::Linear);
    let (from, to) =
        (pose([1.0, 0.0, 0.0], [0.1, 0.0, 0.0]), pose([1.0, 4.0, 0.0], [0.1, 3.0, 0.0]));
    either!(&applicator.coupling, c => {
        for (share, end) in [(0.0, &from), (1.0, &to)] {
            let apart = c.site.between(&from, &to, share).to_matrix() - end.to_matrix();
            assert!(apart.norm() < 1e-12, "{share}: {apart}");
        }
        let half = c.site.between(&from, &to, 0.5).transform_point(&sphere().centre);
        assert!((half - sphere().centre - Vector::new(1.0, 2.0, 0.0)).norm() < 1e-12, "{half}");
    });
}

/// A half turn has no shorter way: it is gone about some axis, or refused.
#[test]
fn a_half_turn_does_not_end_the_program() {
    let mut applicator = attached(Order::Linear);
    let half = pose([0.0; 3], [0.0, 0.0, std::f64::consts::PI]);
    match applicator.step(&half) {
        Ok(step) => assert!(step.by_newton),
        Err(error) => assert!(matches!(error, Error::ApplicatorStuck { .. }), "{error}"),
    }
}

#[test]
fn a_pose_out_of_reach_is_refused_and_the_applicator_goes_on() {
    let mut applicator = attached(Order::Linear);
    let bad = pose([f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert!(matches!(applicator.step(&bad), Err(Error::ApplicatorPose)));
    assert_eq!(applicator.pose(), &Pose::identity());
    // Through the held wall.
    let through = pose([0.0, 0.0, -60.0], [0.0; 3]);
    assert!(matches!(applicator.step(&through), Err(Error::ApplicatorStuck { .. })));
    let reached = applicator.pose().translation.vector.z;
    assert!((-60.0..0.0).contains(&reached), "{reached}");
    applicator.step(&pose([0.0, 0.0, -1.0], [0.0; 3])).unwrap();
    let mut fresh = attached(Order::Linear);
    fresh.step(&pose([0.0, 0.0, -1.0], [0.0; 3])).unwrap();
    let [a, b] = [&applicator, &fresh].map(|a| a.deformation().unwrap());
    let apart = a
        .displacement()
        .values()
        .iter()
        .zip(b.displacement().values())
        .map(|(a, b)| (a - b).norm());
    assert!(apart.fold(0.0, f64::max) < 0.01);
}

#[test]
fn an_applicator_outside_the_tissue_is_refused() {
    let away = SphereOnShaft { centre: Point::new(200.0, 0.0, 0.0), ..sphere() };
    let found = attach(Order::Linear, RestState::Net, &away);
    assert!(matches!(found, Err(Error::ApplicatorOutside { .. })), "{found:?}");
    let all = SphereOnShaft { radius_mm: 500.0, ..sphere() };
    let found = attach(Order::Linear, RestState::Net, &all);
    assert!(matches!(found, Err(Error::NothingFree)), "{found:?}");
}

#[test]
fn factors_renewed_beside_the_steps_leave_the_steps_right() {
    for rest in [RestState::Net, RestState::Unloaded] {
        let mut live = attach(Order::Quadratic, rest, &sphere()).unwrap();
        let mut exact = attach(Order::Quadratic, rest, &sphere()).unwrap();
        for k in 1..=8 {
            let pose = pose(
                [0.8 * f64::from(k), 0.3 * f64::from(k), 0.0],
                [0.0, 0.04 * f64::from(k), 0.0],
            );
            live.step(&pose).unwrap();
            live.renew_beside();
            exact.settle(&pose, TOLERANCE, Progress::none()).unwrap();
            let [a, b] = [&live, &exact].map(|a| a.deformation().unwrap());
            let apart = a
                .displacement()
                .values()
                .iter()
                .zip(b.displacement().values())
                .map(|(a, b)| (a - b).norm());
            assert!(apart.fold(0.0, f64::max) < 0.01, "step {k}");
        }
    }
}

#[test]
fn any_closed_surface_holds_the_nodes_within_it() {
    let corner = |n: u32| {
        let side = |bit: u32| if n >> bit & 1 == 1 { 44.0 } else { 16.0 };
        Point::new(side(0), side(1), side(2))
    };
    let quads =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let surface = supine_mesh::TriSurface::new((0..8).map(corner).collect(), triangles).unwrap();
    let cuboid = supine_mesh::SurfaceDistance::new(surface);
    assert_eq!(
        (cuboid.centre(), cuboid.distance(&Point::new(30.0, 30.0, 30.0))),
        (Point::new(30.0, 30.0, 30.0), -14.0)
    );
    let mut applicator = attach(Order::Linear, RestState::Net, &cuboid).unwrap();
    // The middle points of the block, some a little off.
    assert!((1..=27).contains(&applicator.coupled_nodes()), "{}", applicator.coupled_nodes());
    applicator.step(&Pose::translation(1.0, 2.0, 0.0)).unwrap();
    assert!(applicator.reaction().force_n.dot(&Vector::new(1.0, 2.0, 0.0)) < 0.0);
}

#[test]
fn points_are_moved_onto_the_surface() {
    let mesh = block([6; 3], SIDE_MM / 6.0, 0.1);
    let tissue = Tissue { young_kpa: 3.0, ..Tissue::default() };
    let load = Load { ct: supine(), target: sitting() };
    let body = Body::new(mesh.clone(), tissue);
    let params = Params { order: Order::Linear, ..Params::default() };
    let near = |mesh: &Arc<TetMesh>| {
        let body = Body { mesh: mesh.clone(), ..body.clone() };
        let (u, _) = crate::solve(&body, &load, &params, Progress::none()).unwrap();
        let moved = mesh.points().iter().zip(u.displacement().values());
        moved.filter(|(p, u)| sphere().distance(&(**p + **u)).abs() < 1.6e-3).count()
    };
    let (snapped, moved) =
        crate::snapped(&body, &load, &params, &sphere(), Progress::none()).unwrap();
    assert_eq!(snapped.tets(), mesh.tets());
    let (before, after) = (near(&mesh), near(&snapped));
    assert!(before < 2 && after >= 12 && moved == after, "{before} {after} {moved}");
    for (t, face) in snapped.boundary().iter().enumerate() {
        for p in face.points {
            assert_eq!(snapped.points()[p as usize], mesh.points()[p as usize], "{t}");
        }
    }
}

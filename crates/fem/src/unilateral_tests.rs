//! Tissue that lifts off an applicator.

use super::*;
use crate::test_mesh::{ball, block};
use crate::wall::Target;
use crate::{Shaft, SphereOnShaft};
use nalgebra::UnitQuaternion;
use supine_space::{sitting, supine};

/// Relative residual of settled solutions: rounding keeps quadratic ones from much less.
pub(super) const TOLERANCE: f64 = 1e-8;
const BOTH: [Order; 2] = [Order::Linear, Order::Quadratic];

/// In the middle of the block, with a shaft out of its skin.
pub(super) fn on_shaft(radius_mm: f64) -> SphereOnShaft {
    let shaft = Shaft { direction: Vector::z(), radius_mm: radius_mm - 5.0, length_mm: 60.0 };
    SphereOnShaft { centre: Point::new(30.0, 30.0, 30.0), radius_mm, shaft: Some(shaft) }
}

/// A little wider than what is put in.
fn cavity() -> SphereOnShaft {
    on_shaft(16.0)
}

/// Above the skin at z = 60 mm.
fn above() -> SphereOnShaft {
    let direction = Vector::new(1.0, 0.3, 0.5);
    let shaft = Shaft { direction, radius_mm: 5.0, length_mm: 90.0 };
    SphereOnShaft { centre: Point::new(26.0, 32.0, 75.0), radius_mm: 12.0, shaft: Some(shaft) }
}

fn mesh(order: Order) -> Arc<TetMesh> {
    let cells = if order == Order::Linear { 8 } else { 6 };
    let ragged = block([cells; 3], 60.0 / cells as f64, 0.05);
    crate::snapped_to_cavity(&ragged, &cavity()).unwrap().0
}

/// Sitting shifts the tissue by 9 mm, into the applicator.
fn target(order: Order) -> Vector {
    let tilted = supine_space::TablePose { ap_deg: 12.0, lat_deg: 8.0 };
    if order == Order::Linear { sitting() } else { tilted.gravity() }
}

pub(super) fn attached(order: Order, insertion: &Insertion<'_>) -> Result<Applicator, Error> {
    let tissue = crate::Tissue { young_kpa: 12.0, ..crate::Tissue::default() };
    let load = Load { ct: supine(), target: target(order) };
    let params = Params { order, tolerance: TOLERANCE, ..Params::default() };
    let body = Body::new(mesh(order), tissue);
    Ok(Applicator::attach(&body, &load, &params, insertion, Progress::none())?.0)
}

/// In its cavity.
pub(super) fn pressed(order: Order, rigid: &dyn RigidBody) -> Applicator {
    let cavity = cavity();
    let insertion = Insertion { rigid, contact: Contact::Unilateral, cavity: Some(&cavity) };
    attached(order, &insertion).unwrap()
}

/// Outside.
pub(super) fn outside(order: Order) -> Applicator {
    attached(order, &Insertion::new(&above(), Contact::Unilateral)).unwrap()
}

pub(super) fn pose(shift: [f64; 3], turn: [f64; 3]) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector::from(turn));
    let turn = Pose::rotation_wrt_point(turn, on_shaft(16.0).centre);
    Pose::translation(shift[0], shift[1], shift[2]) * turn
}

pub(super) fn values(applicator: &Applicator) -> Vec<Vector> {
    applicator.deformation().unwrap().displacement().values().to_vec()
}

pub(super) fn apart(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Deepest node, largest gap at a pressed node (mm), smallest force along its normal (mN); the
/// nodes at each part.
fn contact(applicator: &Applicator) -> ([f64; 3], [usize; 2]) {
    either!(&applicator.coupling, c => {
        let pressing = c.pressing().unwrap();
        let (wall, target) = (&pressing.wall, Target::at(&c.place.pose));
        let mut found = [wall.clearance(&c.place.u, target), 0.0, f64::INFINITY];
        let mut parts = [0; 2];
        for press in &pressing.presses {
            let gap = wall.gap(press.part, &wall.place(press.node, &c.place.u), target).unwrap();
            found[1] = found[1].max(gap.mm.abs());
            found[2] = found[2].min(press.force * press.normal.dot(&gap.normal));
            parts[press.part] += 1;
        }
        (found, parts)
    })
}

/// In the cavity: shifted and turned so that sphere and shaft press.
fn in_cavity(order: Order, k: u32) -> Pose {
    let t = if order == Order::Linear { 0.4 } else { 0.2 } * f64::from(k);
    pose([t, 0.3 * t, -0.4 * t], [0.0, 0.02 * t, 0.01 * t])
}

/// From above: down onto the skin, along it, and off.
fn from_above(k: u32) -> Pose {
    let t = f64::from(k);
    let along = (t - 8.0).max(0.0);
    let down = if k <= 14 { t.min(9.0) } else { 9.0 - 2.0 * (t - 14.0) };
    pose([0.6 * along, -0.3 * along, -down], [0.0; 3])
}

/// Trap: tissue that is held in tension, or that enters the body.
#[test]
fn tissue_is_pressed_and_neither_pulled_nor_entered() {
    let mut both = [0; 2];
    for order in BOTH {
        let (mut inner, mut outer) = (pressed(order, &on_shaft(15.0)), outside(order));
        let untouched = values(&outer);
        for k in 1..=18 {
            for (live, to) in [(&mut inner, in_cavity(order, k)), (&mut outer, from_above(k))] {
                live.step(&to).unwrap();
                let ([deepest, off, least], parts) = contact(live);
                assert!(deepest >= -1e-3 && off <= 1e-3 && least > 0.0, "{order:?} {k}");
                both.iter_mut().zip(parts).for_each(|(both, part)| *both += part);
                let sum: Vector = live.contact_forces().iter().map(|(_, force)| force).sum();
                let force = live.reaction().force_n;
                assert!((sum * 1e-3 + force).norm() < 1e-9, "{order:?} {k}");
                let candidate = |n: &u32| live.contact_candidates().contains(n);
                assert!(live.contact_forces().iter().all(|(n, _)| candidate(n)));
            }
            let touches = outer.coupled_nodes() > 0;
            // In between it may touch or not, as the nodes lie.
            if !(4..=17).contains(&k) || (8..16).contains(&k) {
                assert_eq!(touches, (8..16).contains(&k), "{order:?} {k}");
            }
        }
        // Off, the tissue is as it was, to within what a step leaves.
        outer.step(&pose([0.0, 0.0, 30.0], [0.0; 3])).unwrap();
        let off = apart(&values(&outer), &untouched);
        assert!(off < crate::quasi_newton::ERROR_MM, "{order:?} {off}");
        assert_eq!(outer.reaction().force_n, Vector::zeros());
    }
    assert!(both.iter().all(|touches| *touches > 50), "{both:?}");
}

#[test]
fn steps_agree_with_the_settled_solution() {
    for order in BOTH {
        let (mut inner, mut outer) = (pressed(order, &on_shaft(15.0)), outside(order));
        let (mut cold_in, mut cold_out) = (pressed(order, &on_shaft(15.0)), outside(order));
        // Cold solutions of quadratic elements take seconds each.
        let last = if order == Order::Linear { 18 } else { 6 };
        for k in 1..=last {
            for (live, cold, to) in [
                (&mut inner, &mut cold_in, in_cavity(order, k)),
                (&mut outer, &mut cold_out, from_above(k)),
            ] {
                live.step(&to).unwrap();
                if k % 2 == 0 {
                    cold.settle(&to, TOLERANCE, Progress::none()).unwrap();
                    let off = apart(&values(live), &values(cold));
                    assert!(off < 0.01, "{order:?} {k}: {off}");
                    let ([deepest, off, least], _) = contact(cold);
                    assert!(deepest > -1e-6 && off < 1e-6 && least > 0.0, "{order:?} {k}");
                }
            }
        }
    }
}

#[test]
fn five_hundred_steps_come_back_to_where_they_began() {
    let mut live = pressed(Order::Linear, &on_shaft(15.0));
    let on_circle = |k: u32| {
        let angle = f64::from(k) * std::f64::consts::TAU / 50.0;
        let (sin, cos) = angle.sin_cos();
        pose([2.0 * cos - 2.0, 2.0 * sin, 1.0 - cos], [0.0, 0.05 * sin, 0.0])
    };
    let (first, mut newton) = (values(&live), 0);
    for k in 1..=500 {
        newton += usize::from(live.step(&on_circle(k)).unwrap().by_newton);
        if k % 7 == 0 || live.wants_renewal() {
            live.renew().unwrap();
        }
    }
    let off = apart(&values(&live), &first);
    assert!(off < 0.01 && newton < 10, "{off} {newton}");
}

/// Where tissue presses, it is as if it were held at just these nodes.
#[test]
fn pressed_tissue_is_as_if_it_were_held_where_it_presses() {
    let (mesh, _) = ball(10.0, 40.0, 4, 1);
    let load = Load { ct: supine(), target: supine() };
    let params = Params { order: Order::Linear, tolerance: TOLERANCE, ..Params::default() };
    let body = Body::new(mesh, crate::Tissue::default());
    let sphere = |radius_mm| SphereOnShaft { centre: Point::origin(), radius_mm, shaft: None };
    let (snug, swollen) = (sphere(10.0), sphere(12.0));
    let attach = |insertion: &Insertion<'_>| {
        Applicator::attach(&body, &load, &params, insertion, Progress::none()).unwrap().0
    };
    let insertion =
        Insertion { rigid: &swollen, contact: Contact::Unilateral, cavity: Some(&snug) };
    let mut pressed = attach(&insertion);
    // All but a few: the elements are not alike, and at some nodes those around lift off.
    assert!((34..42).contains(&pressed.coupled_nodes()), "{}", pressed.coupled_nodes());
    for to in [Pose::identity(), Pose::translation(0.4, -0.3, 0.2)] {
        pressed.step(&to).unwrap();
        let touched: Vec<u32> = pressed.contact_forces().iter().map(|(n, _)| *n).collect();
        let mut held = attach(&Insertion::new(&snug, Contact::Frictionless));
        let Either::Linear(coupling) = &mut held.coupling else { panic!("linear") };
        let site = Arc::get_mut(&mut coupling.site).unwrap();
        let sliding = Arc::get_mut(site.sliding.as_mut().unwrap()).unwrap();
        sliding.nodes.retain(|slider| touched.contains(&slider.node));
        sliding.nodes.iter_mut().for_each(|slider| slider.level = 12.0);
        held.settle(&to, TOLERANCE, Progress::none()).unwrap();
        // The node in the middle is of the cavity alone.
        let off = apart(&values(&held)[1..], &values(&pressed)[1..]);
        let forces = [&held, &pressed].map(|applicator| applicator.reaction().force_n);
        assert!(off < 4e-3, "{off}");
        assert!((forces[0] - forces[1]).norm() < 5e-3 * forces[0].norm() + 1e-4, "{forces:?}");
    }
}

/// Trap: sums in an order that depends on how many threads there are.
#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut live = pressed(Order::Linear, &on_shaft(15.5));
            for k in 1..=4 {
                live.step(&in_cavity(Order::Linear, k)).unwrap();
                live.renew().unwrap();
            }
            (values(&live), live.contact_forces())
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn poses_that_cannot_be_are_refused_and_leave_the_tissue_as_it_was() {
    let mut live = pressed(Order::Linear, &on_shaft(15.0));
    let to = in_cavity(Order::Linear, 3);
    live.step(&to).unwrap();
    let before = (values(&live), live.contact_forces());
    let bad = pose([f64::NAN, 0.0, 0.0], [0.0; 3]);
    assert!(matches!(live.step(&bad), Err(Error::ApplicatorPose)));
    // Through the held wall, and out through the neck of the cavity.
    for far in [[0.0, 0.0, -80.0], [1e7, 0.0, 0.0]] {
        let found = live.step(&pose(far, [0.0; 3]));
        assert!(matches!(found, Err(Error::ApplicatorStuck { .. })), "{far:?} {found:?}");
        assert_eq!(live.pose(), &to);
        assert_eq!((values(&live), live.contact_forces()), before);
    }
    live.step(&in_cavity(Order::Linear, 4)).unwrap();
}

#[test]
fn an_applicator_far_from_the_tissue_touches_nothing() {
    let mut live = outside(Order::Linear);
    let before = values(&live);
    for far in [[0.0, 0.0, 400.0], [1e6, 0.0, 0.0], [0.0, 0.0, 5.0]] {
        live.step(&pose(far, [0.0; 3])).unwrap();
        assert_eq!(live.coupled_nodes(), 0);
        assert!(apart(&values(&live), &before) < 1e-6);
    }
    assert_eq!(live.reaction().force_n, Vector::zeros());
    assert!(!live.wants_renewal());
}

#[test]
fn what_is_cut_bears_and_weighs_nothing() {
    let mut live = pressed(Order::Quadratic, &on_shaft(15.0));
    let (mesh, cut) = (mesh(Order::Quadratic), cavity());
    let places = |t: usize| {
        let corners = mesh.corners(t);
        let middles =
            supine_mesh::TET_EDGES.map(|[a, b]| nalgebra::center(&corners[a], &corners[b]));
        corners.into_iter().chain(middles)
    };
    let middle =
        |t: usize| Point::from(mesh.corners(t).map(|p| p.coords).iter().sum::<Vector>() / 4.0);
    let want = live.bearing().to_vec();
    let (mut within, mut opened) = (0, 0);
    for (t, kept) in want.iter().enumerate() {
        if cut.distance(&middle(t)) <= 0.0 {
            assert!(!kept, "{t} lies in the cavity");
            within += 1;
        } else if !kept {
            assert!(places(t).any(|p| cut.distance(&p) < -1.0), "{t} was cut");
            opened += 1;
        } else {
            assert!(places(t).all(|p| cut.distance(&p) > -1.01), "{t} reaches into the cavity");
        }
    }
    assert!(within > 50 && opened > 0, "{within} {opened}");
    let Either::Quadratic(coupling) = &live.coupling else { panic!("quadratic") };
    let kept = |t: &usize| want[*t];
    let volume: f64 = (0..want.len()).filter(kept).map(|t| mesh.volume(t)).sum();
    let bearing: f64 = coupling.site.model.elements.weights.iter().flatten().sum();
    assert!((bearing / volume - 1.0).abs() < 1e-12);
    let weight: Vector = coupling.site.load.iter().sum();
    let force = (target(Order::Quadratic) - supine()) * crate::Tissue::default().weight();
    assert!((weight - force * volume).norm() < 1e-9 * weight.norm());
    // Nodes of the cavity alone stay; those on its wall are candidates.
    let first = values(&live);
    live.step(&in_cavity(Order::Quadratic, 2)).unwrap();
    let middle = (0..mesh.points().len()).find(|&p| {
        mesh.tets().iter().zip(&want).all(|(t, kept)| !kept || !t.contains(&(p as u32)))
    });
    let middle = middle.unwrap();
    assert_eq!(values(&live)[middle], first[middle]);
    assert!(!live.contact_candidates().contains(&(middle as u32)));
}

#[test]
fn without_a_cavity_an_applicator_within_the_tissue_makes_its_own() {
    let sphere = SphereOnShaft { shaft: None, ..on_shaft(16.0) };
    let pressed = attached(Order::Linear, &Insertion::new(&sphere, Contact::Unilateral)).unwrap();
    let held = attached(Order::Linear, &Insertion::new(&sphere, Contact::Frictionless)).unwrap();
    assert_eq!(pressed.bearing(), held.bearing());
    assert!(held.bearing().contains(&false) && pressed.contact_candidates().len() > 300);
    assert!(outside(Order::Linear).bearing().iter().all(|bears| *bears));
}

#[test]
fn cavities_that_cannot_be_are_refused() {
    let (rigid, away) = (on_shaft(15.0), above());
    let with = |contact, cavity: &dyn RigidBody| {
        attached(Order::Linear, &Insertion { rigid: &rigid, contact, cavity: Some(cavity) })
    };
    let found = with(Contact::Unilateral, &away);
    assert!(matches!(found, Err(Error::CavityEmpty { .. })), "{found:?}");
    for contact in [Contact::Tied, Contact::Frictionless] {
        assert!(matches!(with(contact, &cavity()), Err(Error::CavityContact)));
    }
    let all = SphereOnShaft { radius_mm: 500.0, ..away };
    let found = with(Contact::Unilateral, &all);
    assert!(matches!(found, Err(Error::NothingFree)), "{found:?}");
    // Some nodes, but no whole tetrahedron.
    let small = SphereOnShaft { radius_mm: 4.5, shaft: None, ..rigid };
    let found = attached(Order::Linear, &Insertion::new(&small, Contact::Unilateral));
    assert!(matches!(found, Err(Error::ApplicatorBuried { .. })), "{found:?}");
}

#[test]
fn points_are_moved_onto_the_cavity_in_the_ct() {
    let ragged = block([8; 3], 7.5, 0.05);
    let (snapped, moved) = crate::snapped_to_cavity(&ragged, &cavity()).unwrap();
    let near =
        |mesh: &TetMesh| mesh.points().iter().filter(|p| cavity().distance(p).abs() < 1e-9).count();
    assert_eq!(snapped.tets(), ragged.tets());
    assert!(moved > 50 && near(&ragged) == 0 && near(&snapped) == moved, "{moved}");
}

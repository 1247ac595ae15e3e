use super::*;
use crate::test_mesh::{bent, block, tagged};
use crate::{Cut, Membrane, RestState, SlidingArea, Tissue, solve};
use supine_mesh::{BoundaryTag, Displacement};
use supine_space::{Point, TablePose, supine};

/// What is promised of a node, mm.
const CLOSE_MM: f64 = 0.01;
const BOTH: [Order; 2] = [Order::Linear, Order::Quadratic];
/// The table as it is tilted: small turns, and long ones at once. Degrees.
const PATH: [(f64, f64); 10] = [
    (1.0, 0.0),
    (3.0, 0.5),
    (20.0, 15.0),
    (19.0, 14.5),
    (-20.0, -15.0),
    (-20.0, -15.0),
    (0.0, 0.0),
    (25.0, 0.0),
    (0.0, 20.0),
    (-0.5, 19.5),
];

fn gravity((ap_deg, lat_deg): (f64, f64)) -> Vector {
    TablePose { ap_deg, lat_deg }.gravity()
}

/// A block of 162 tetrahedra on its wall, cut at two sides.
fn body(young_kpa: f64) -> Body {
    let sides = |face: &[Point; 3]| {
        if face.iter().all(|p| p.z == 0.0) {
            BoundaryTag::ChestWall
        } else if face.iter().all(|p| p.x < 5.0) || face.iter().all(|p| p.x > 40.0) {
            BoundaryTag::Cut
        } else {
            BoundaryTag::Skin
        }
    };
    let mesh = tagged(&block([3, 3, 3], 15.0, 0.1), sides);
    Body::new(mesh, Tissue { young_kpa, ..Tissue::default() })
}

fn new(body: &Body, params: &Params) -> Tilt {
    let load = Load { ct: supine(), target: supine() };
    Tilt::new(body, &load, params, Progress::none()).unwrap().0
}

fn apart(a: &Deformation, b: &Deformation) -> f64 {
    let both = a.displacement().values().iter().zip(b.displacement().values());
    both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// How far the tissue is off a cold solution, mm.
fn off(tilt: &Tilt, body: &Body, params: &Params) -> f64 {
    let load = Load { ct: supine(), target: tilt.gravity() };
    let (cold, _) = solve(body, &load, params, Progress::none()).unwrap();
    apart(&tilt.deformation().unwrap(), &cold)
}

/// Soft tissue of that rest state whose cold solutions exist all the way, kPa.
fn soft_kpa(rest: RestState) -> f64 {
    match rest {
        RestState::Net => 0.6,
        RestState::Unloaded => 1.5,
    }
}

fn equal_to_cold(rest: RestState) {
    let body = body(soft_kpa(rest));
    for order in BOTH {
        for cut in Cut::ALL {
            let params = Params { order, rest, cut, ..Params::default() };
            let mut tilt = new(&body, &params);
            for at in PATH {
                let step = tilt.turn(&gravity(at)).unwrap();
                assert!(step.error_mm <= ERROR_MM, "{step:?}");
                assert_eq!(tilt.gravity(), gravity(at));
                let off = off(&tilt, &body, &params);
                assert!(off < CLOSE_MM, "{order:?} {cut:?} {at:?}: {off} mm, {step:?}");
            }
        }
    }
}

/// The wall is bent, so that a straight way off it has to be mended.
#[test]
fn tissue_that_slides_and_has_a_skin_turns_too() {
    let body = body(soft_kpa(RestState::Unloaded));
    let body = Body { mesh: bent(&body.mesh, 0.005), ..body };
    let area = SlidingArea {
        centre_mm: Some([22.5, 22.5, 0.0]),
        radius_mm: 30.0,
        rim_mm: 10.0,
        stiffness_kpa_mm: 0.02,
    };
    let skin = Membrane { thickness_mm: 1.5, young_kpa: 5.0, stretch: 1.05 };
    for rest in [RestState::Net, RestState::Unloaded] {
        let params = Params { rest, sliding: Some(area), skin: Some(skin), ..Params::default() };
        let mut tilt = new(&body, &params);
        for pose in PATH {
            let step = tilt.turn(&gravity(pose)).unwrap();
            let off = off(&tilt, &body, &params);
            assert!(off < CLOSE_MM, "{rest:?} {pose:?}: {off} mm after {step:?}");
        }
    }
}

#[test]
fn a_turn_ends_where_a_cold_solution_does() {
    equal_to_cold(RestState::Net);
}

#[test]
fn a_turn_from_the_unloaded_shape_ends_where_a_cold_solution_does() {
    equal_to_cold(RestState::Unloaded);
}

#[test]
fn curved_elements_turn_too() {
    let mut body = body(1.0);
    let edges = Edges::new(&body.mesh);
    let points = body.mesh.points().len();
    let wave = |n: usize| if n < points { 0.0 } else { 0.4 * (7.1 * n as f64).sin() };
    let off_straight: Vec<Vector> =
        (0..points + edges.ends().len()).map(|n| Vector::new(wave(n), 0.0, wave(n + 3))).collect();
    body.curved = Some(Displacement::new(&body.mesh, &edges, off_straight).unwrap());
    let params = Params::default();
    let mut tilt = new(&body, &params);
    for at in [(1.0, 0.0), (10.0, 5.0)] {
        tilt.turn(&gravity(at)).unwrap();
        assert!(off(&tilt, &body, &params) < CLOSE_MM);
    }
}

/// It begins under the target's gravity with what [`solve`] gives, to the last bit.
#[test]
fn it_begins_as_a_solution() {
    let body = body(1.5);
    let load = Load { ct: supine(), target: gravity((7.0, 5.0)) };
    for rest in RestState::ALL {
        let params = Params { rest, ..Params::default() };
        let (tilt, info) = Tilt::new(&body, &load, &params, Progress::none()).unwrap();
        let (cold, told) = solve(&body, &load, &params, Progress::none()).unwrap();
        assert_eq!((tilt.gravity(), info), (load.target, told));
        assert_eq!(tilt.deformation().unwrap(), cold);
    }
}

#[test]
fn the_way_to_a_gravity_does_not_matter() {
    for rest in RestState::ALL {
        let (body, params) = (body(soft_kpa(rest)), Params { rest, ..Params::default() });
        let mut slow = new(&body, &params);
        for k in 1..=24 {
            let k = f64::from(k);
            slow.turn(&gravity((0.5 * k, 0.4 * k - 0.01 * k * k))).unwrap();
        }
        let mut jumps = new(&body, &params);
        for at in [(-20.0, -15.0), (25.0, 10.0)] {
            jumps.turn(&gravity(at)).unwrap();
            jumps.renew().unwrap();
        }
        jumps.turn(&slow.gravity()).unwrap();
        let apart = apart(&slow.deformation().unwrap(), &jumps.deformation().unwrap());
        assert!(apart < CLOSE_MM, "{rest:?}: {apart} mm");
    }
}

/// Small turns make few corrections, and keep the factor for long.
#[test]
fn small_turns_are_little_work() {
    for rest in RestState::ALL {
        let (body, params) = (body(1.5), Params { rest, ..Params::default() });
        let mut tilt = new(&body, &params);
        let mut corrections = 0;
        for k in 1..=10 {
            let step = tilt.turn(&gravity((f64::from(k), 0.0))).unwrap();
            assert!(!step.by_newton && step.corrections <= 4, "{rest:?} {k}: {step:?}");
            corrections += step.corrections;
        }
        assert!(corrections <= 30, "{rest:?}: {corrections}");
        either!(&tilt.tissue, t => assert!(t.spare.is_none(), "{rest:?}"));
    }
}

#[test]
fn errors_of_turns_do_not_add_up() {
    let (body, params) = (body(0.6), Params::default());
    let mut tilt = new(&body, &params);
    for k in 1..=150 {
        let step = tilt.turn(&gravity((0.05 * f64::from(k), 0.0))).unwrap();
        assert!(step.corrections <= 2, "{k}: {step:?}");
    }
    assert!(off(&tilt, &body, &params) < CLOSE_MM);
}

/// A long way costs corrections, or Newton's method; then the factor is renewed once, and turns are
/// small work again.
#[test]
fn an_old_factor_is_renewed() {
    let (body, params) = (body(0.6), Params { cut: Cut::Free, ..Params::default() });
    let mut tilt = new(&body, &params);
    let step = tilt.turn(&gravity((20.0, 15.0))).unwrap();
    assert!(step.by_newton, "{step:?}");
    let debt = |tilt: &Tilt| either!(&tilt.tissue, t => (t.debt, t.spare.is_some()));
    assert_eq!(debt(&tilt), (DEBT, false));
    let step = tilt.turn(&gravity((20.0, 14.9))).unwrap();
    assert!(!step.by_newton && step.corrections <= FEW, "{step:?}");
    assert_eq!(debt(&tilt), (0, true));
    // What another thread is to renew is not renewed twice.
    tilt.turn(&gravity((-20.0, -15.0))).unwrap();
    tilt.renew_beside();
    assert_eq!(debt(&tilt), (0, false));
}

#[test]
fn factors_renewed_beside_the_turns_leave_them_right() {
    for rest in RestState::ALL {
        let (body, params) = (body(soft_kpa(rest)), Params { rest, ..Params::default() });
        let mut tilt = new(&body, &params);
        for k in 1..=12 {
            let k = f64::from(k);
            tilt.turn(&gravity((1.5 * k, k))).unwrap();
            tilt.renew_beside();
        }
        assert!(off(&tilt, &body, &params) < CLOSE_MM, "{rest:?}");
    }
}

#[test]
fn the_same_turns_give_the_same_bytes() {
    let (body, params) = (body(0.6), Params { cut: Cut::Free, ..Params::default() });
    let [a, b] = [(); 2].map(|()| {
        let mut tilt = new(&body, &params);
        let steps = PATH.map(|at| tilt.turn(&gravity(at)).unwrap());
        (steps, tilt.deformation().unwrap())
    });
    assert_eq!(a, b);
}

#[test]
fn what_is_no_direction_is_refused_and_changes_nothing() {
    let (body, params) = (body(1.0), Params::default());
    let mut tilt = new(&body, &params);
    tilt.turn(&gravity((5.0, 3.0))).unwrap();
    let before = (tilt.gravity(), tilt.deformation().unwrap());
    for bad in [f64::NAN, f64::INFINITY, 0.0, 1.1, -0.9] {
        let refused = tilt.turn(&(bad * supine()));
        assert!(matches!(refused, Err(Error::Direction { which: "target", .. })), "{refused:?}");
    }
    assert_eq!((tilt.gravity(), tilt.deformation().unwrap()), before);
}

#[test]
fn a_gravity_without_equilibrium_leaves_the_tissue_where_it_was() {
    // One iteration is too few for Newton's method, upside down is too far for corrections.
    let params = Params { max_iterations: 1, cut: Cut::Free, ..Params::default() };
    let (body, settled) = (body(0.6), Params { max_iterations: 60, ..params });
    let mut tilt = new(&body, &params);
    tilt.turn(&gravity((3.0, -2.0))).unwrap();
    let before = (tilt.gravity(), tilt.deformation().unwrap());
    let refused = tilt.turn(&-supine());
    assert!(matches!(refused, Err(Error::NonConvergence { .. })), "{refused:?}");
    assert_eq!((tilt.gravity(), tilt.deformation().unwrap()), before);
    for at in [(4.0, -2.0), (5.0, -2.5)] {
        let step = tilt.turn(&gravity(at)).unwrap();
        assert!(!step.by_newton, "{step:?}");
        assert!(off(&tilt, &body, &settled) < CLOSE_MM);
    }
}

#[test]
fn it_may_go_to_another_thread() {
    fn goes<T: Send>(_: &T) {}
    goes(&new(&body(1.0), &Params::default()));
}

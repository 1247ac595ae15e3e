//! Agreement with the stored solutions of independent solvers (fixtures/fem).
#![expect(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "the fixtures are files, and a broken one fails the test"
)]

use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;
use std::fs::File;
use std::sync::Arc;
use supine_fem::{
    Applicator, Body, Contact, Cut, Error, Info, Insertion, Law, Load, Membrane, Params, RestState,
    SlidingArea, SphereOnShaft, Tissue, sensitivity, solve, unload,
};
use supine_mesh::{BoundaryFace, BoundaryTag, Order, TetMesh};
use supine_space::{Point, Pose, Progress, TablePose, Vector, sitting, supine};

/// Largest nodal difference where the problem is well conditioned, mm.
const CLOSE_MM: f64 = 1e-8;
/// Where softness or the way through the unloaded shape amplifies rounding, mm.
const SOFT_MM: f64 = 1e-6;

fn open(name: &str) -> NpzReader<File> {
    let path = format!("{}/../../fixtures/fem/{name}.npz", env!("CARGO_MANIFEST_DIR"));
    NpzReader::new(File::open(path).unwrap()).unwrap()
}

fn mesh(name: &str) -> Arc<TetMesh> {
    let mut file = open(&format!("mesh_{name}"));
    let nodes: Array2<f64> = file.by_name("nodes").unwrap();
    let tets: Array2<i32> = file.by_name("tets").unwrap();
    let tris: Array2<i32> = file.by_name("tris").unwrap();
    let tags: Array1<i8> = file.by_name("tags").unwrap();
    let points = nodes.rows().into_iter().map(|r| Point::new(r[0], r[1], r[2])).collect();
    let tets = tets.rows().into_iter().map(|r| [0, 1, 2, 3].map(|k| r[k] as u32)).collect();
    // The arrays number the tags 1 chest wall, 2 skin, 3 cut.
    let tag = |n: i8| match n {
        1 => BoundaryTag::ChestWall,
        2 => BoundaryTag::Skin,
        3 => BoundaryTag::Cut,
        other => panic!("tag {other}"),
    };
    let faces = tris.rows().into_iter().zip(&tags);
    let faces = faces
        .map(|(r, t)| BoundaryFace { points: [0, 1, 2].map(|k| r[k] as u32), tag: tag(*t) })
        .collect();
    TetMesh::new(points, tets, faces).unwrap().into()
}

struct Case {
    name: &'static str,
    order: Order,
}

impl Case {
    fn stored(&self, field: &str) -> Vec<Vector> {
        let mut file = open(&format!("fields_{}_P{}", self.name, self.order.number()));
        let field: Array2<f64> = file.by_name(field).unwrap();
        field.rows().into_iter().map(|r| Vector::new(r[0], r[1], r[2])).collect()
    }

    fn solve(&self, target: Vector, young_kpa: f64, params: Params) -> (Vec<Vector>, Info) {
        let tissue = Tissue { young_kpa, ..Tissue::default() };
        let load = Load { ct: supine(), target };
        let params = Params { order: self.order, ..params };
        let (u, info) =
            solve(&Body::new(mesh(self.name), tissue), &load, &params, Progress::none()).unwrap();
        assert_eq!(u.displacement().order(), self.order);
        (u.displacement().values().to_vec(), info)
    }

    /// Largest nodal difference to a stored field, mm.
    fn difference(&self, field: &str, target: Vector, young_kpa: f64, params: Params) -> f64 {
        largest_difference(&self.solve(target, young_kpa, params).0, &self.stored(field))
    }
}

fn largest_difference(a: &[Vector], b: &[Vector]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn tilt() -> Vector {
    TablePose { ap_deg: 7.0, lat_deg: 5.0 }.gravity()
}

const BOTH: [Case; 2] =
    [Case { name: "1.6k", order: Order::Linear }, Case { name: "1.6k", order: Order::Quadratic }];

const E: f64 = 0.609;

/// How the stored fields were solved.
const FREE: Params = Params {
    order: Order::Quadratic,
    rest: RestState::Net,
    cut: Cut::Free,
    spring_kpa_mm: None,
    sliding: None,
    skin: None,
    tolerance: 1e-10,
    max_iterations: 60,
};

#[test]
fn net_agrees() {
    for case in BOTH {
        let net = FREE;
        assert!(case.difference("net_tilt", tilt(), E, net) < CLOSE_MM);
        assert!(case.difference("net_sit", sitting(), E, net) < CLOSE_MM);
    }
}

/// Against felupe, which was given the energies alone: fixtures/fem/make_laws.py.
#[test]
fn other_laws_agree() {
    let case = &BOTH[1];
    let stored = law_field;
    for (law, stiffening) in [(Law::Exponential, 1.5), (Law::Gent, 0.5)] {
        let body = Body::new(mesh(case.name), Tissue { law, stiffening, ..Tissue::default() });
        for (rest, short) in [(RestState::Net, "net"), (RestState::Unloaded, "unl")] {
            for (target, pose) in [(tilt(), "tilt"), (sitting(), "sit")] {
                let params = Params { rest, ..FREE };
                let load = Load { ct: supine(), target };
                let (u, _) = solve(&body, &load, &params, Progress::none()).unwrap();
                let theirs = stored(&format!("{law}_{short}_{pose}"));
                let off = largest_difference(u.displacement().values(), &theirs);
                assert!(off < SOFT_MM, "{law} {short} {pose}: {off:e} mm");
            }
        }
    }
}

fn law_field(name: &str) -> Vec<Vector> {
    let field: Array2<f64> = open("laws_1.6k_P2").by_name(name).unwrap();
    field.rows().into_iter().map(|r| Vector::new(r[0], r[1], r[2])).collect()
}

/// The same with fibres, whose directions felupe was given by a script of its own.
#[test]
fn fibres_agree() {
    let case = &BOTH[1];
    let body = Body::new(mesh(case.name), Tissue { fibres: 2.0, ..Tissue::default() });
    for (target, pose) in [(tilt(), "tilt"), (sitting(), "sit")] {
        let load = Load { ct: supine(), target };
        let (u, _) = solve(&body, &load, &FREE, Progress::none()).unwrap();
        let plain = case.difference(&format!("net_{pose}"), target, E, FREE);
        let theirs = law_field(&format!("fibres_net_{pose}"));
        let off = largest_difference(u.displacement().values(), &theirs);
        assert!(off < SOFT_MM, "{pose}: {off:e} mm");
        // They do something.
        let field = case.stored(&format!("net_{pose}"));
        assert!(largest_difference(&field, &theirs) > 0.1 && plain < CLOSE_MM);
    }
}

/// A sliding wall and a skin, whose energies alone jax was given: fixtures/fem/make_surfaces.py.
#[test]
fn a_sliding_wall_and_a_skin_agree() {
    let field = |name: &str| -> Vec<Vector> {
        let field: Array2<f64> = open("surfaces_1.6k_P2").by_name(name).unwrap();
        field.rows().into_iter().map(|r| Vector::new(r[0], r[1], r[2])).collect()
    };
    let centre: Array1<f64> = open("surfaces_1.6k_P2").by_name("wall_centre").unwrap();
    let area = SlidingArea {
        centre_mm: Some([centre[0], centre[1], centre[2]]),
        radius_mm: 60.0,
        rim_mm: 20.0,
        stiffness_kpa_mm: 0.02,
    };
    let skin = |young_kpa, stretch| Membrane { thickness_mm: 1.8, young_kpa, stretch };
    let (stiff, soft) = (skin(40.0, 1.02), skin(5.0, 1.1));
    let stored = open("surfaces_1.6k_P2").names().unwrap();
    let mut compared = 0;
    for (name, sliding, skin) in [
        ("wall", Some(area), None),
        ("skin", None, Some(stiff)),
        ("both", Some(area), Some(stiff)),
        ("soft", None, Some(soft)),
        ("both_soft", Some(area), Some(soft)),
    ] {
        let body = Body::new(mesh("1.6k"), Tissue::default());
        for (rest, short) in [(RestState::Net, "net"), (RestState::Unloaded, "unl")] {
            for (target, pose) in [(tilt(), "tilt"), (sitting(), "sit")] {
                let name = format!("{name}_{short}_{pose}");
                if !stored.iter().any(|key| key.trim_end_matches(".npy") == name) {
                    continue;
                }
                let load = Load { ct: supine(), target };
                let params = Params { rest, sliding, skin, ..FREE };
                let (u, info) = solve(&body, &load, &params, Progress::none()).unwrap();
                let off = largest_difference(u.displacement().values(), &field(&name));
                println!("{name}: {off:e} mm, {:?}", info.solve);
                assert!(off < CLOSE_MM, "{name}: {off:e} mm");
                compared += 1;
            }
        }
    }
    assert!(compared == 20, "{compared}");
}

#[test]
fn net_agrees_on_12k_linear() {
    let case = Case { name: "12k", order: Order::Linear };
    assert!(case.difference("net_tilt", tilt(), E, FREE) < CLOSE_MM);
    assert!(case.difference("net_sit", sitting(), E, FREE) < CLOSE_MM);
}

#[test]
fn net_agrees_at_other_moduli() {
    for case in BOTH {
        assert!(case.difference("net_sit_E0.3", sitting(), 0.3, FREE) < SOFT_MM);
        assert!(case.difference("net_sit_E2.0", sitting(), 2.0, FREE) < SOFT_MM);
    }
}

#[test]
fn net_with_fixed_cut_agrees() {
    for case in BOTH {
        let fixed = Params { cut: Cut::Fixed, ..FREE };
        assert!(case.difference("net_tilt_cutfixed", tilt(), E, fixed) < CLOSE_MM);
        assert!(case.difference("net_sit_cutfixed", sitting(), E, fixed) < CLOSE_MM);
    }
}

/// The stored derivative agrees with central differences of the reference solver to 3e-8.
#[test]
fn the_derivative_by_the_modulus_agrees() {
    for case in BOTH {
        let (shape, tissue) = (mesh(case.name), Tissue::default());
        let params = Params { order: case.order, ..FREE };
        let load = Load { ct: supine(), target: sitting() };
        let body = Body::new(shape.clone(), tissue);
        let (_, slope, _) = sensitivity(&body, &load, &params, Progress::none()).unwrap();
        let stored = case.stored("net_sit_dxdE");
        let off = largest_difference(slope.values(), &stored) / slope.max_norm();
        assert!(off < 1e-6, "{:?}: {off:e}", case.order);
    }
}

/// Central differences through both rest states, on a breast.
#[test]
fn the_derivative_is_that_of_the_displacement() {
    for case in BOTH {
        let given = Params { cut: Cut::Spring, spring_kpa_mm: Some(0.02), ..UNLOADED };
        for params in [Params::default(), UNLOADED, given] {
            let params = Params { order: case.order, tolerance: 1e-12, ..params };
            let (shape, load) = (mesh(case.name), Load { ct: supine(), target: tilt() });
            let tissue = |young_kpa| Tissue { young_kpa, ..Tissue::default() };
            let own = tissue(E);
            let body = Body::new(shape.clone(), own);
            let (_, slope, _) = sensitivity(&body, &load, &params, Progress::none()).unwrap();
            let step = 1e-4;
            let [up, down] = [E + step, E - step].map(|e| case.solve(tilt(), e, params).0);
            let differences: Vec<Vector> =
                up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect();
            let off = largest_difference(slope.values(), &differences) / slope.max_norm();
            assert!(off < 1e-5, "{:?} {:?}: {off:e}", case.order, params.rest);
        }
    }
}

const UNLOADED: Params = Params { rest: RestState::Unloaded, ..FREE };

#[test]
fn unloaded_agrees() {
    for case in BOTH {
        let (u, info) = case.solve(tilt(), E, UNLOADED);
        assert!(largest_difference(&u, &case.stored("unl_tilt")) < SOFT_MM);
        let unloading = info.unloading.unwrap();
        let shape = mesh(case.name);
        let farthest = case
            .stored("unl_X")
            .iter()
            .zip(shape.points())
            .map(|(x, ct)| (x - ct.coords).norm())
            .fold(0.0, f64::max);
        assert!(unloading.max_distance_mm >= farthest - SOFT_MM);
        assert!(unloading.reload_error_mm.unwrap() < 1e-6, "{unloading:?}");
        let (tissue, params) = (Tissue::default(), Params { order: case.order, ..UNLOADED });
        let body = Body::new(shape.clone(), tissue);
        let (y, same) = unload(&body, supine(), &params, Progress::none()).unwrap();
        assert_eq!(same, unloading);
        // Mid-sides of the CT shape are midpoints; the stress-free positions are stored for all
        // nodes.
        let corners =
            shape.points().iter().zip(y.displacement().values()).map(|(x, y)| x.coords + y);
        let stored = &case.stored("unl_X")[..shape.points().len()];
        assert!(largest_difference(&corners.collect::<Vec<_>>(), stored) < SOFT_MM);
    }
    assert!(BOTH[0].difference("unl_sit", sitting(), E, UNLOADED) < SOFT_MM);
}

#[test]
fn unloaded_agrees_when_sitting_on_quadratic_elements() {
    assert!(BOTH[1].difference("unl_sit", sitting(), E, UNLOADED) < SOFT_MM);
}

/// Trap: the inverse solve converges at 0.2 kPa, but the shape it finds is of no use.
#[test]
fn tissue_too_soft_for_an_unloaded_shape_is_refused_with_a_modulus_that_is_not() {
    let params = Params { order: Order::Linear, ..UNLOADED };
    let load = Load { ct: supine(), target: tilt() };
    let at = |young_kpa: f64| {
        let tissue = Tissue { young_kpa, ..Tissue::default() };
        solve(&Body::new(mesh("1.6k"), tissue), &load, &params, Progress::none())
    };
    let refused = at(0.2).unwrap_err();
    let Error::NoUnloadedShape { young_kpa, exists_from_kpa, .. } = refused else {
        panic!("{refused}");
    };
    assert_eq!(young_kpa, 0.2);
    let advised = exists_from_kpa.unwrap();
    assert!((0.24..0.35).contains(&advised), "{advised}");
    let (_, info) = at(advised).unwrap();
    assert!(info.unloading.unwrap().reload_error_mm.unwrap() < 1e-6);
    assert!(
        info.warnings.iter().any(|w| w.to_string().contains("soft for its thickness")),
        "{info:?}"
    );
}

/// Each tetrahedron with its own modulus.
#[test]
fn tissue_of_two_moduli_agrees() {
    for case in BOTH {
        let file = format!("fields_{}_P{}", case.name, case.order.number());
        let moduli: Array1<f64> = open(&file).by_name("hetero_E").unwrap();
        let mesh = mesh(case.name);
        let tissue = Tissue::default();
        let body =
            Body { young_kpa: Some(moduli.to_vec().into()), ..Body::new(mesh.clone(), tissue) };
        let load = Load { ct: supine(), target: sitting() };
        let params = Params { order: case.order, cut: Cut::Free, ..Params::default() };
        let (u, _) = solve(&body, &load, &params, Progress::none()).unwrap();
        let apart = largest_difference(u.displacement().values(), &case.stored("hetero_net_sit"));
        assert!(apart < CLOSE_MM, "{apart}");
    }
}

const SPHERE: SphereOnShaft = SphereOnShaft {
    centre: Point::new(96.689_502_2, -111.251_350_18, 0.0),
    radius_mm: 20.0,
    shaft: None,
};

/// Shift (mm) of the centre, and turn about +y through it.
fn pose(shift: Vector, turn_deg: f64) -> Pose {
    let turn = Vector::y() * turn_deg.to_radians();
    let turn = nalgebra::UnitQuaternion::from_scaled_axis(turn);
    let turn = Pose::rotation_wrt_point(turn, SPHERE.centre);
    Pose::translation(shift.x, shift.y, shift.z) * turn
}

/// Both paths: a shift, and a turn on the way.
fn on_path(path: usize, step: usize) -> Pose {
    let k = step as f64;
    match path {
        1 => pose(Vector::repeat(0.5 * k), 0.0),
        _ => pose(Vector::new(k.min(5.0), 0.0, -(k - 5.0).max(0.0)), 2.0 * k),
    }
}

fn attached(case: &Case, tolerance: f64) -> Applicator {
    let mesh = mesh(case.name);
    let tissue = Tissue::default();
    let load = Load { ct: supine(), target: tilt() };
    let params = Params { order: case.order, tolerance, cut: Cut::Free, ..Params::default() };
    let body = Body::new(mesh.clone(), tissue);
    Applicator::attach(
        &body,
        &load,
        &params,
        &Insertion::new(&SPHERE, Contact::Tied),
        Progress::none(),
    )
    .unwrap()
    .0
}

fn applied() -> [Case; 3] {
    let [linear, quadratic] = BOTH;
    [linear, quadratic, Case { name: "12k", order: Order::Linear }]
}

#[test]
fn tissue_around_an_applicator_agrees() {
    for case in applied() {
        let file = format!("fields_{}_P{}", case.name, case.order.number());
        let nodes: Array1<i32> = open(&file).by_name("app_nodes").unwrap();
        for path in [1, 2] {
            let mut applicator = attached(&case, 1e-12);
            assert_eq!(applicator.coupled_nodes(), nodes.len());
            let step = applicator.settle(&on_path(path, 10), 1e-11, Progress::none()).unwrap();
            assert!(step.by_newton);
            let field = case.stored(&format!("app{path}_b10"));
            let apart = largest_difference(
                applicator.deformation().unwrap().displacement().values(),
                &field,
            );
            assert!(apart < CLOSE_MM, "{} path {path}: {apart}", case.name);
        }
    }
}

#[test]
fn live_steps_stay_near_the_settled_solution() {
    for case in applied() {
        // The paths of the larger mesh are measured by the benchmark.
        let ways: &[(usize, bool)] =
            if case.name == "12k" { &[(2, true)] } else { &[(1, false), (2, true)] };
        for &(path, renewed) in ways {
            let (mut live, mut exact) = (attached(&case, 1e-10), attached(&case, 1e-10));
            let mut corrections = 0;
            for step in 1..=10 {
                let pose = on_path(path, step);
                let made = live.step(&pose).unwrap();
                assert!(!made.by_newton, "{} path {path} step {step}", case.name);
                corrections += made.corrections;
                exact.settle(&pose, 1e-10, Progress::none()).unwrap();
                let [a, b] = [&live, &exact].map(|a| a.deformation().unwrap());
                let apart =
                    largest_difference(a.displacement().values(), b.displacement().values());
                assert!(apart < 0.01, "{} path {path} step {step}: {apart}", case.name);
                if renewed {
                    live.renew().unwrap();
                }
            }
            assert!(corrections <= if renewed { 14 } else { 45 }, "{corrections}");
        }
    }
}

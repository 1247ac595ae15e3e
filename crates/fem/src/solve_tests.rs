//! The whole solver on blocks of tetrahedra: known solutions, refusals, and hard cases.

use crate::test_mesh::{block, tagged};
use crate::{Body, Cut, Error, Law, Load, Params, RestState, SQUEEZED_DET_F, Tissue, solve};
use proptest::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_mesh::{BoundaryTag, Edges, Order, TetMesh};
use supine_space::{Point, Progress, TablePose, Vector, sitting, supine};

const BOTH: [Order; 2] = [Order::Linear, Order::Quadratic];

fn to(target: Vector) -> Load {
    Load { ct: supine(), target }
}

fn params(order: Order, rest: RestState) -> Params {
    Params { order, rest, ..Params::default() }
}

/// A column that hangs by its own weight, with ν = 0: nothing moves sideways, and the stretch s at
/// distance z from the held end carries the weight beyond, μ (s − 1/s) = ρ g (h − z): the
/// neo-Hookean solid in uniaxial strain (stress of Bonet and Wood 2008, section 6.4.3). The
/// displacement is its integral.
/// Fibres across the pull bear it not, fibres along it do.
#[test]
fn fibres_bear_where_they_run() {
    let body = |fibre_direction, fibres| {
        let tissue = Tissue { young_kpa: 1.5, fibres, fibre_direction, ..Tissue::default() };
        Body::new(block([2, 2, 3], 10.0, 0.1), tissue)
    };
    // Away from the wall, which lies at z = 0.
    let load = Load { ct: -Vector::z(), target: Vector::z() };
    let moved = |body: &Body| {
        solve(body, &load, &Params::default(), Progress::none())
            .unwrap()
            .0
            .displacement()
            .max_norm()
    };
    let none = moved(&body(None, 0.0));
    let [along, across, laplace] = [Some([0.0, 0.0, -3.0]), Some([1.0, 0.0, 0.0]), None]
        .map(|direction| moved(&body(direction, 4.0)));
    assert!(along < 0.5 * none && across > 0.9 * none, "{along} {across} {none}");
    assert!(along < laplace && laplace < 0.8 * none, "{laplace} {none}");
    let none = body(Some([0.0; 3]), 1.0);
    assert!(matches!(
        solve(&none, &load, &Params::default(), Progress::none()),
        Err(Error::OutOfRange { .. })
    ));
}

#[test]
fn a_column_stretches_as_the_closed_solution_says() {
    let (height, cells) = (40.0, 8);
    let mesh = block([2, 2, cells], height / cells as f64, 0.0);
    let tissue = Tissue { young_kpa: 4.0, poisson: 0.0, ..Tissue::default() };
    let load = Load { ct: sitting(), target: -sitting() };
    // Net of the two gravities: twice the weight, away from the held end.
    let weight = 2.0 * tissue.weight();
    let stretch = |z: f64| {
        let a = weight * (height - z) / (tissue.young_kpa / 2.0);
        (a.hypot(2.0) + a) / 2.0
    };
    let steps = 4000;
    let strip = |k: usize| stretch((k as f64 + 0.5) * height / f64::from(steps)) - 1.0;
    let top: f64 = (0..steps as usize).map(|k| strip(k) * height / f64::from(steps)).sum();
    // A layer's points do not share its load evenly: a linear element responds with some shear.
    for (order, share, sideways) in [(Order::Linear, 1e-2, 6e-2), (Order::Quadratic, 1e-3, 5e-3)] {
        let params = params(order, RestState::Net);
        let (u, _) =
            solve(&Body::new(mesh.clone(), tissue), &load, &params, Progress::none()).unwrap();
        let largest = u.displacement().values().iter().map(|u| u.xy().norm()).fold(0.0, f64::max);
        assert!(largest < sideways * top, "{order:?}: sideways {largest} of {top}");
        let both = mesh.points().iter().zip(u.displacement().values());
        let end: Vec<f64> = both.filter(|(p, _)| p.z > height - 1e-9).map(|(_, u)| u.z).collect();
        let mean = end.iter().sum::<f64>() / end.len() as f64;
        assert!((mean - top).abs() < share * top, "{order:?}: {mean} instead of {top}");
    }
}

#[test]
fn no_change_of_gravity_moves_nothing() {
    let mesh = block([2, 2, 2], 10.0, 0.1);
    for order in BOTH {
        let p = params(order, RestState::Net);
        let (u, info) =
            solve(&Body::new(mesh.clone(), Tissue::default()), &to(supine()), &p, Progress::none())
                .unwrap();
        assert_eq!((u.displacement().max_norm(), info.solve.iterations), (0.0, 0));
        let p = params(order, RestState::Unloaded);
        let (u, info) =
            solve(&Body::new(mesh.clone(), Tissue::default()), &to(supine()), &p, Progress::none())
                .unwrap();
        assert!(u.displacement().max_norm() < 1e-9, "{}", u.displacement().max_norm());
        assert!(info.unloading.unwrap().max_distance_mm > 0.1);
    }
}

/// The displacement field of quadratic order has one vector per point and edge.
#[test]
fn the_order_is_as_asked() {
    let mesh = block([2, 2, 2], 10.0, 0.1);
    for order in BOTH {
        let p = params(order, RestState::Net);
        let (u, _) = solve(
            &Body::new(mesh.clone(), Tissue::default()),
            &to(sitting()),
            &p,
            Progress::none(),
        )
        .unwrap();
        let edges = if order == Order::Linear { 0 } else { Edges::new(&mesh).ends().len() };
        assert_eq!(u.displacement().values().len(), mesh.points().len() + edges);
    }
}

/// Trap: an edge between two wall points that is not an edge of a wall face is free.
#[test]
fn a_mid_side_between_wall_points_may_move() {
    // One cube whose bottom and one side are held, except the two triangles at one corner edge.
    let mesh = block([1, 1, 1], 10.0, 0.0);
    let faces: Vec<usize> = (0..mesh.boundary().len())
        .filter(|&f| mesh.boundary()[f].points.iter().all(|&p| mesh.points()[p as usize].z == 0.0))
        .collect();
    assert_eq!(faces.len(), 2);
    // Hold one triangle of the bottom and one of the top: the diagonal of the cube joins held
    // points.
    let top = |c: &[Point; 3]| c.iter().all(|p| p.z == 10.0);
    let bottom = |c: &[Point; 3]| c.iter().all(|p| p.z == 0.0);
    let held =
        tagged(
            &mesh,
            |c| {
                if top(c) || bottom(c) { BoundaryTag::ChestWall } else { BoundaryTag::Skin }
            },
        );
    let p = params(Order::Quadratic, RestState::Net);
    let (u, _) =
        solve(&Body::new(held.clone(), Tissue::default()), &to(sitting()), &p, Progress::none())
            .unwrap();
    let edges = Edges::new(&held);
    let points = held.points().len();
    let (mut free, mut fixed) = (0, 0);
    for (edge, [a, b]) in edges.ends().iter().enumerate() {
        let [a, b] = [a, b].map(|p| held.points()[*p as usize]);
        let moved = u.displacement().values()[points + edge].norm() > 0.0;
        if (a.z - b.z).abs() > 0.0 {
            free += 1;
            assert!(moved, "{a} {b}");
        } else {
            fixed += 1;
            assert!(!moved, "{a} {b}");
        }
    }
    assert!(
        free > 0
            && fixed > 0
            && u.displacement().values()[..points].iter().all(|u| u.norm() == 0.0)
    );
}

/// Tissue that turns far swells on the straight way there; the pressure of that swelling makes the
/// stiffness indefinite unless it is left out.
#[test]
fn nearly_incompressible_tissue_turns_in_few_iterations() {
    let mesh = block([8, 8, 4], 12.0, 0.1);
    let tissue = Tissue { young_kpa: 2.0, poisson: 0.49, ..Tissue::default() };
    let params = Params { tolerance: 1e-9, ..params(Order::Linear, RestState::Net) };
    let (u, info) =
        solve(&Body::new(mesh.clone(), tissue), &to(sitting()), &params, Progress::none()).unwrap();
    assert!(u.displacement().max_norm() > 25.0, "{}", u.displacement().max_norm());
    // Nine with the pressure of the straight way.
    assert!(info.solve.iterations <= 6 && info.solve.indefinite == 0, "{info:?}");
}

#[test]
fn a_fixed_cut_is_held() {
    let mesh = tagged(&block([3, 3, 3], 8.0, 0.1), |c| {
        let side = c.iter().all(|p| p.x < 2.0);
        match (c.iter().all(|p| p.z == 0.0), side) {
            (true, _) => BoundaryTag::ChestWall,
            (false, true) => BoundaryTag::Cut,
            _ => BoundaryTag::Skin,
        }
    });
    let cut_moves = |cut: Cut| {
        let p = Params { cut, ..Params::default() };
        let (u, _) = solve(
            &Body::new(mesh.clone(), Tissue::default()),
            &to(sitting()),
            &p,
            Progress::none(),
        )
        .unwrap();
        let faces = mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Cut);
        faces
            .flat_map(|f| f.points)
            .map(|p| u.displacement().values()[p as usize].norm())
            .fold(0.0, f64::max)
    };
    assert_eq!(cut_moves(Cut::Fixed), 0.0);
    assert!(cut_moves(Cut::Free) > 0.1);
}

#[test]
fn numbers_out_of_range_are_named() {
    let mesh = block([1, 1, 1], 10.0, 0.0);
    let refused = |tissue: Tissue, load: Load, params: Params| {
        solve(&Body::new(mesh.clone(), tissue), &load, &params, Progress::none())
            .unwrap_err()
            .to_string()
    };
    let (t, l, p) = (Tissue::default(), to(sitting()), Params::default());
    let says = |message: String, words: &[&str]| {
        assert!(words.iter().all(|w| message.contains(w)), "{message}");
    };
    says(refused(Tissue { poisson: 0.5, ..t }, l, p), &["Poisson", "0.5", "below 0.4999"]);
    says(refused(Tissue { young_kpa: 0.0, ..t }, l, p), &["Young", "is 0", "0.001"]);
    says(refused(Tissue { young_kpa: f64::NAN, ..t }, l, p), &["Young", "NaN"]);
    says(refused(Tissue { density_kg_m3: -1.0, ..t }, l, p), &["density", "-1"]);
    says(refused(t, to(Vector::new(0.0, 0.0, -9.81)), p), &["target", "9.81", "length"]);
    says(refused(t, to(Vector::repeat(f64::NAN)), p), &["target", "NaN"]);
    says(refused(t, l, Params { tolerance: 0.0, ..p }), &["tolerance", "1e-12"]);
}

#[test]
fn a_body_without_support_is_refused() {
    let loose = tagged(&block([2, 2, 2], 10.0, 0.0), |_| BoundaryTag::Skin);
    for rest in [RestState::Net, RestState::Unloaded] {
        let p = params(Order::Quadratic, rest);
        let error = solve(
            &Body::new(loose.clone(), Tissue::default()),
            &to(sitting()),
            &p,
            Progress::none(),
        )
        .unwrap_err();
        assert!(matches!(error, Error::NoSupport { tets: 48, of: 48, tet: 0 }), "{error}");
    }
    let all = tagged(&block([1, 1, 1], 10.0, 0.0), |_| BoundaryTag::ChestWall);
    let p = params(Order::Linear, RestState::Net);
    let error =
        solve(&Body::new(all.clone(), Tissue::default()), &to(sitting()), &p, Progress::none())
            .unwrap_err();
    assert!(matches!(error, Error::NothingFree), "{error}");
}

#[test]
fn a_separate_piece_is_refused() {
    let one = block([1, 1, 1], 10.0, 0.0);
    let count = one.points().len() as u32;
    let mut points = one.points().to_vec();
    points.extend(one.points().iter().map(|p| p + Vector::new(50.0, 0.0, 5.0)));
    let mut tets = one.tets().to_vec();
    tets.extend(one.tets().iter().map(|t| t.map(|p| p + count)));
    let mut boundary = one.boundary().to_vec();
    boundary.extend(one.boundary().iter().map(|f| supine_mesh::BoundaryFace {
        points: f.points.map(|p| p + count),
        tag: BoundaryTag::Skin,
    }));
    let mesh = TetMesh::new(points, tets, boundary).unwrap();
    let p = Params::default();
    let error =
        solve(&Body::new(mesh.into(), Tissue::default()), &to(sitting()), &p, Progress::none())
            .unwrap_err();
    assert!(matches!(error, Error::NoSupport { tets: 6, of: 12, tet: 6 }), "{error}");
}

#[test]
fn a_load_that_is_not_solved_is_an_error_with_figures() {
    let mesh = block([2, 2, 4], 10.0, 0.1);
    let p = Params { max_iterations: 1, ..Params::default() };
    let error =
        solve(&Body::new(mesh.clone(), Tissue::default()), &to(sitting()), &p, Progress::none())
            .unwrap_err();
    let message = error.to_string();
    let Error::NonConvergence { iterations, residual, tet, load_share, .. } = error else {
        panic!("{message}");
    };
    assert!(iterations > 1 && residual > 1e-10 && tet < mesh.tets().len() && load_share < 1.0);
    assert!(message.contains("too many iterations") && message.contains("modulus"), "{message}");
}

/// Pressed down by twice its weight.
#[test]
fn squeezed_tissue_is_told_with_its_place() {
    let mesh = block([2, 2, 4], 10.0, 0.05);
    let tissue = Tissue { young_kpa: 0.2, poisson: 0.1, ..Tissue::default() };
    let load = Load { ct: -sitting(), target: sitting() };
    let params = params(Order::Linear, RestState::Net);
    let (_, info) = solve(&Body::new(mesh, tissue), &load, &params, Progress::none()).unwrap();
    assert!(info.solve.min_det_f < SQUEEZED_DET_F, "{info:?}");
    let told = info.warnings.iter().find(|w| w.code() == "squeezed-tissue").unwrap().to_string();
    let [x, y, z] = info.solve.min_det_f_mm;
    assert!(z < 10.0, "the lowest layer bears all: {z} mm");
    assert!(told.contains(&format!("[{x:.1}, {y:.1}, {z:.1}] mm")), "{told}");
}

#[test]
fn failures_have_their_kinds() {
    use supine_space::Failure;
    assert_eq!(Error::Memory { unknowns: 3 }.kind(), Failure::Retry);
    assert_eq!(Error::NothingFree.kind(), Failure::Method);
    assert_eq!(Error::ApplicatorPose.kind(), Failure::Input);
    assert_eq!(Error::from(supine_space::Stopped).kind(), Failure::Stopped);
}

/// One iteration too few for the whole load at once: its steps reach the same solution.
#[test]
fn load_steps_are_the_last_resort_and_are_told() {
    let mesh = block([2, 2, 3], 10.0, 0.1);
    let run = |max_iterations| {
        let p = Params { max_iterations, ..params(Order::Linear, RestState::Net) };
        solve(&Body::new(mesh.clone(), Tissue::default()), &to(sitting()), &p, Progress::none())
            .unwrap()
    };
    let (direct, info) = run(60);
    assert_eq!(info.solve.load_steps, 1);
    assert!(info.warnings.is_empty());
    let (stepped, told) = run(info.solve.iterations - 1);
    assert!(told.solve.load_steps > 1);
    assert!(told.warnings.iter().any(|w| w.to_string().contains("steps")), "{told:?}");
    let both = direct.displacement().values().iter().zip(stepped.displacement().values());
    assert!(both.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) < 1e-7);
}

#[test]
fn a_stop_is_obeyed_at_every_call() {
    let mesh = block([2, 2, 2], 10.0, 0.1);
    for rest in [RestState::Net, RestState::Unloaded] {
        let p = params(Order::Linear, rest);
        let calls = AtomicUsize::new(0);
        let count = |_: f64| {
            calls.fetch_add(1, Ordering::Relaxed);
            true
        };
        let run = |sink: &dyn supine_space::Watch| {
            solve(
                &Body::new(mesh.clone(), Tissue::default()),
                &to(sitting()),
                &p,
                Progress::new(sink),
            )
        };
        run(&count).unwrap();
        let all = calls.load(Ordering::Relaxed);
        assert!(all >= 3);
        for stop_at in 1..=all {
            let calls = AtomicUsize::new(0);
            let stop = |_: f64| calls.fetch_add(1, Ordering::Relaxed) + 1 < stop_at;
            assert!(matches!(run(&stop).unwrap_err(), Error::Stopped(_)), "call {stop_at}");
            assert_eq!(calls.load(Ordering::Relaxed), stop_at);
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let mesh = block([2, 2, 2], 12.0, 0.15);
    for rest in [RestState::Net, RestState::Unloaded] {
        let p = params(Order::Quadratic, rest);
        let tissue = Tissue { young_kpa: 2.0, ..Tissue::default() };
        let run = || {
            solve(&Body::new(mesh.clone(), tissue), &to(sitting()), &p, Progress::none()).unwrap()
        };
        assert_eq!(run(), run());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever the tissue, the tilt and the mesh: an equilibrium without folds at the quadrature
    /// points, or a typed error.
    #[test]
    fn it_converges_or_says_why(
        shake in 0.0..0.3f64,
        young_kpa in 0.2..2.0f64,
        poisson in 0.3..0.49f64,
        ap_deg in -90.0..90.0f64,
        lat_deg in -90.0..90.0f64,
        quadratic: bool,
        unloaded: bool,
        law in prop::sample::select(Law::ALL.to_vec()),
        stiffening in 0.01..2.0f64,
        fibres in prop::sample::select(vec![0.0, 0.5, 3.0]),
    ) {
        let mesh = block([3, 2, 2], 15.0, shake);
        let order = BOTH[usize::from(quadratic)];
        let rest = if unloaded { RestState::Unloaded } else { RestState::Net };
        let tissue = Tissue { young_kpa, poisson, law, stiffening, fibres, ..Tissue::default() };
        let load = to(TablePose { ap_deg, lat_deg }.gravity());
        match solve(&Body::new(mesh.clone(), tissue), &load, &params(order, rest), Progress::none()) {
            Ok((u, info)) => {
                prop_assert!(info.solve.residual <= 1e-10 && info.solve.min_det_f > 0.0);
                let wall = mesh.points().iter().zip(u.displacement().values()).filter(|(p, _)| p.z == 0.0);
                prop_assert!(wall.map(|(_, u)| u.norm()).fold(0.0, f64::max) == 0.0);
            }
            Err(Error::NonConvergence { .. } | Error::NoUnloadedShape { .. }) => {}
            Err(other) => prop_assert!(false, "{other}"),
        }
    }
}

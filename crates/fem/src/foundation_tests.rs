//! Springs on the cut: their limits, and the stiffness they have when none is given.

use crate::element::kept;
use crate::foundation::Foundation;
use crate::test_mesh::{block, tagged};
use crate::{Body, Cut, Error, Info, Load, Params, RestState, Tissue, solve};
use std::f64::consts::PI;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Order, TetMesh};
use supine_space::{Progress, Vector, sitting, supine};

const THICK_MM: f64 = 18.0;

/// A slab on the chest wall, cut all around.
fn slab() -> Arc<TetMesh> {
    tagged(&block([5, 4, 3], THICK_MM / 3.0, 0.0), |c| {
        let all_at = |z: f64| c.iter().all(|p| p.z == z);
        match (all_at(0.0), all_at(THICK_MM)) {
            (true, _) => BoundaryTag::ChestWall,
            (_, true) => BoundaryTag::Skin,
            _ => BoundaryTag::Cut,
        }
    })
}

fn moved(params: Params) -> (Vec<Vector>, Info) {
    let load = Load { ct: supine(), target: sitting() };
    let tissue = Tissue { young_kpa: 1.5, ..Tissue::default() };
    let (u, info) = solve(&Body::new(slab(), tissue), &load, &params, Progress::none()).unwrap();
    (u.displacement().values().to_vec(), info)
}

fn difference(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

#[test]
fn soft_springs_leave_the_cut_free_and_stiff_ones_hold_it() {
    for order in [Order::Linear, Order::Quadratic] {
        for rest in [RestState::Net, RestState::Unloaded] {
            let with = |cut: Cut, spring_kpa_mm: Option<f64>| {
                moved(Params { order, rest, cut, spring_kpa_mm, ..Params::default() }).0
            };
            let (free, fixed) = (with(Cut::Free, None), with(Cut::Fixed, None));
            let apart = difference(&free, &fixed);
            assert!(apart > 0.5, "{apart}");
            assert!(difference(&with(Cut::Spring, Some(0.0)), &free) < 1e-9);
            assert!(difference(&with(Cut::Spring, Some(1e-8)), &free) < 1e-5 * apart);
            assert!(difference(&with(Cut::Spring, Some(1e6)), &fixed) < 1e-4 * apart);
            let between = with(Cut::Spring, None);
            for limit in [&free, &fixed] {
                let away = difference(&between, limit);
                assert!(
                    0.1 * apart < away && away < apart,
                    "{order:?} {rest:?}: {away} of {apart}"
                );
            }
        }
    }
}

#[test]
fn springs_have_the_stiffness_of_a_layer_as_thick_as_the_cut() {
    let (_, info) = moved(Params { cut: Cut::Spring, ..Params::default() });
    let mu = 1.5 / 2.9;
    let want = PI * mu / (2.0 * THICK_MM);
    assert!((info.solve.spring_kpa_mm.unwrap() - want).abs() < 1e-9, "{info:?}");
    let given = Params { cut: Cut::Spring, spring_kpa_mm: Some(0.3), ..Params::default() };
    assert!((moved(given).1.solve.spring_kpa_mm.unwrap() - 0.3).abs() < 1e-12);
    let free = Params { cut: Cut::Free, ..Params::default() };
    assert_eq!(moved(free).1.solve.spring_kpa_mm, None);
}

#[test]
fn a_stiffness_that_is_none_is_refused() {
    let params = Params { cut: Cut::Spring, spring_kpa_mm: Some(-1.0), ..Params::default() };
    let load = Load { ct: supine(), target: sitting() };
    let body = slab();
    let tissue = Tissue::default();
    let refused = solve(&Body::new(body.clone(), tissue), &load, &params, Progress::none());
    assert!(
        matches!(refused, Err(Error::OutOfRange { value, .. }) if value == -1.0),
        "{refused:?}"
    );
}

/// Springs of a part of the elements and of the others bear together what all bear.
#[test]
fn springs_can_be_taken_apart() {
    let (mesh, tissue) = (slab(), Tissue::default());
    let springs =
        Foundation::<4>::new(&mesh, &Body::new(mesh.clone(), tissue).materials(1.0), None);
    let first: Vec<bool> = (0..mesh.tets().len()).map(|t| t % 3 == 0).collect();
    let second: Vec<bool> = first.iter().map(|first| !first).collect();
    let u: Vec<Vector> = mesh.points().iter().map(|p| p.coords * 0.1).collect();
    let energy = |keep: &[bool]| springs.only(keep).energy(&kept(mesh.tets(), keep), &u);
    let (one, other, all) = (energy(&first), energy(&second), springs.energy(mesh.tets(), &u));
    assert!(one > 0.1 * all && other > 0.1 * all && (one + other - all).abs() < 1e-12 * all);
}

use super::*;
use crate::element::element_nodes;
use crate::test_mesh::{block, tagged};
use crate::{Body, Load, Params, RestState, Tissue, solve};
use supine_mesh::{Edges, Order};
use supine_space::{Progress, TablePose, supine};

const MEMBRANE: Membrane = Membrane { thickness_mm: 1.5, young_kpa: 30.0, stretch: 1.0 };

/// A block with skin on its top alone, and that skin.
fn top<const N: usize>(membrane: &Membrane) -> (Vec<Vector>, Vec<[u32; N]>, Skin<N>) {
    let mesh = tagged(&block([3, 3, 1], 4.0, 0.0), |c| {
        if c.iter().all(|p| p.z > 3.9) { BoundaryTag::Skin } else { BoundaryTag::ChestWall }
    });
    let edges = Edges::new(&mesh);
    let mut positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    if N == 10 {
        for [a, b] in edges.ends() {
            positions.push((positions[*a as usize] + positions[*b as usize]) / 2.0);
        }
    }
    let nodes = element_nodes::<N>(&mesh, &edges);
    let skin = Skin::new(&mesh, &nodes, &positions, membrane);
    (positions, nodes, skin)
}

/// Stretched by λ in its plane it pulls with h μ (λ − λ⁻⁵) per length that it had: Green and Adkins
/// 1960.
fn check_pull<const N: usize>() {
    for (before, stretch) in [(1.0, 1.2), (1.1, 1.0), (1.04, 0.97)] {
        let (positions, nodes, skin) = top::<N>(&Membrane { stretch: before, ..MEMBRANE });
        let u: Vec<Vector> = positions
            .iter()
            .map(|p| Vector::new(p.x, p.y, 0.0) * (stretch - 1.0) + Vector::z() * 2.0)
            .collect();
        let mut forces = vec![Vector::zeros(); u.len()];
        let energy = skin.evaluate(&nodes, &u, &mut forces);
        let right = positions.iter().zip(&forces).filter(|(p, _)| p.x > 11.9);
        let pull = right.map(|(_, force)| *force).sum::<Vector>();
        let whole: f64 = before * stretch;
        // Per length in the shape whose skin is stretched by λ in advance.
        let wanted = 15.0 * (whole - whole.powi(-5)) * 12.0 * before;
        assert!((pull.x - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{pull} {wanted}");
        assert!(pull.y.abs().max(pull.z.abs()) < 1e-9);
        let wanted = 7.5 * (2.0 * whole.powi(2) + whole.powi(-4) - 3.0) * 144.0;
        assert!((energy - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{energy} {wanted}");
    }
}

#[test]
fn it_pulls_as_the_closed_form_says() {
    check_pull::<4>();
    check_pull::<10>();
}

fn moved(rest: RestState, order: Order, skin: Option<Membrane>, target: Vector) -> f64 {
    let tissue = Tissue { young_kpa: 1.0, ..Tissue::default() };
    let body = Body::new(block([3, 3, 2], 12.0, 0.1), tissue);
    let params = Params { rest, order, skin, ..Params::default() };
    let load = Load { ct: supine(), target };
    let (deformation, info) = solve(&body, &load, &params, Progress::none()).unwrap();
    if rest == RestState::Unloaded {
        assert!(info.solve.reload_error_mm.unwrap() < 1e-6, "{:?}", info.solve);
    }
    deformation.displacement().max_norm()
}

#[test]
fn it_holds_the_tissue_back_and_moves_nothing_by_itself() {
    let tilt = TablePose { ap_deg: 15.0, lat_deg: 5.0 }.gravity();
    for order in [Order::Linear, Order::Quadratic] {
        for rest in [RestState::Net, RestState::Unloaded] {
            let with = |stretch: f64, target: Vector| {
                moved(rest, order, Some(Membrane { stretch, ..MEMBRANE }), target)
            };
            let without = moved(rest, order, None, tilt);
            let (slack, tight) = (with(1.0, tilt), with(1.03, tilt));
            assert!(tight < slack && slack < 0.9 * without, "{tight} {slack} {without}");
            assert!(with(1.03, supine()) < 1e-6);
        }
    }
}

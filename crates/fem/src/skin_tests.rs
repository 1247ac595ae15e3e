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

/// A corner is pulled in both ways, two in one way, and one is squeezed.
fn squeezed(positions: &[Vector]) -> Vec<Vector> {
    let at = |p: &Vector| {
        let [x, y] = [p.x - 6.0, p.y - 6.0];
        Vector::new(x * x, y * y, 0.5 * x * y) * 0.03
    };
    positions.iter().map(at).collect()
}

fn anyhow(positions: &[Vector]) -> Vec<Vector> {
    let wave = |k: f64, p: &Vector| (k * p.x + 1.3 * p.y).sin();
    positions.iter().map(|p| Vector::new(wave(0.7, p), wave(0.4, p), wave(0.9, p))).collect()
}

/// The derivatives by the present and by the stress-free shape against differences of the forces.
fn check_slopes<const N: usize>() {
    let (positions, nodes, skin) = top::<N>(&Membrane { stretch: 1.05, ..MEMBRANE });
    let (u, v) = (squeezed(&positions), anyhow(&positions));
    let plus = |a: &[Vector], b: &[Vector], share: f64| -> Vec<Vector> {
        a.iter().zip(b).map(|(a, b)| a + b * share).collect()
    };
    let forces = |skin: &Skin<N>, u: &[Vector]| {
        let mut forces = vec![Vector::zeros(); u.len()];
        skin.evaluate(&nodes, u, &mut forces);
        forces
    };
    let at_rest = |share: f64| {
        let rest = skin.at_rest(&nodes, &plus(&positions, &v, share));
        forces(&rest, &plus(&u, &v, -share))
    };
    let h = 1e-6;
    let by_x = plus(&forces(&skin, &plus(&u, &v, h)), &forces(&skin, &plus(&u, &v, -h)), -1.0);
    let by_rest = plus(&at_rest(h), &at_rest(-h), -1.0);

    let (mut own, mut own_rest) = (vec![Vector::zeros(); u.len()], vec![Vector::zeros(); u.len()]);
    skin.add_slope(&nodes, &u, &v, &mut own);
    let mut kinds = [0; 3];
    skin.each(&nodes, &u, |face, at, places| {
        for place in places {
            let taut = place.law.pulls.iter().filter(|pull| **pull > 0.0).count();
            kinds[taut] += 1;
        }
        let own: Vec<usize> = at.iter().map(|&a| nodes[face.element][a] as usize).collect();
        for (a, b) in (0..own.len()).flat_map(|a| (0..own.len()).map(move |b| (a, b))) {
            own_rest[own[a]] += summed(places, (a, b), Place::rest_change) * v[own[b]];
        }
    });
    assert!(kinds.iter().all(|count| *count > 0), "{kinds:?}");
    for (own, found) in own.iter().zip(&by_x).chain(own_rest.iter().zip(&by_rest)) {
        assert!((own - found / (2.0 * h)).norm() < 1e-5, "{own} {}", found / (2.0 * h));
    }
}

#[test]
fn its_derivatives_are_those_of_the_forces() {
    check_slopes::<4>();
    check_slopes::<10>();
}

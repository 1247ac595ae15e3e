use super::*;
use crate::element::element_nodes;
use crate::foundation::Foundation;
use crate::inverse::Inverse;
use crate::newton::{Limits, Newton, norm};
use crate::pattern::Storage;
use crate::skin::Skin;
use crate::sliding_wall::SlidingWall;
use crate::tangent::Tangent;
use crate::test_mesh::{bent, block, tagged};
use crate::{Membrane, SlidingArea};
use nalgebra::Rotation3;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Edges, TetMesh};
use supine_record::Law;
use supine_space::Progress;

/// What is tried: a law, and whether there are fibres.
type Solid = (Law, bool);
const SOLIDS: [Solid; 5] = [
    (Law::NeoHookean, false),
    (Law::Exponential, false),
    (Law::Gent, false),
    (Law::Yeoh, false),
    (Law::NeoHookean, true),
];
const PLAIN: Solid = SOLIDS[0];

/// Each element order with each solid.
macro_rules! each_solid {
    ($check:ident($($argument:expr),*)) => {
        for solid in SOLIDS {
            $check::<4, 1>($($argument,)* solid);
            $check::<10, 4>($($argument,)* solid);
        }
    };
}

/// Fibres of so many elements, along `along` at each.
fn fibres<const Q: usize>(along: &[Vector]) -> Fibres<Q> {
    let c = (0..along.len()).map(|e| 0.1 * (1.0 + (e % 5) as f64)).collect();
    Fibres { c, k: 0.8, along: along.iter().map(|a| [*a; Q]).collect() }
}

/// Numbers in -1..1 from a fixed seed (linear congruence of Knuth).
fn noise(count: usize) -> Vec<Vector> {
    let mut seed = 7u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| Vector::new(next(), next(), next())).collect()
}

struct Body<const N: usize, const Q: usize> {
    positions: Vec<Vector>,
    model: Model<N, Q>,
    /// On the surface of the block.
    outer: Vec<bool>,
}

/// A shaken block; with `springs` on its whole surface but the wall.
fn body<const N: usize, const Q: usize>(springs: bool, solid: Solid) -> Body<N, Q> {
    let mesh = block([4, 3, 3], 5.0, 0.15);
    let mesh = if springs { bent(&mesh, 0.01) } else { mesh };
    let edges = Edges::new(&mesh);
    let mut positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    let middle = |[a, b]: &[u32; 2]| (positions[*a as usize] + positions[*b as usize]) / 2.0;
    let middles: Vec<Vector> = edges.ends().iter().map(middle).collect();
    if N == 10 {
        positions.extend(middles);
    }
    let mut outer = vec![false; positions.len()];
    for face in mesh.boundary() {
        assert_ne!(face.tag, BoundaryTag::Cut);
        let [a, b, c] = face.points;
        face.points.into_iter().for_each(|p| outer[p as usize] = true);
        if N == 10 {
            for (a, b) in [(a, b), (b, c), (a, c)] {
                outer[mesh.points().len() + edges.between(a, b).unwrap() as usize] = true;
            }
        }
    }
    let elements = Elements::new(&positions, element_nodes(&mesh, &edges)).unwrap();
    let stiffer = |t: usize| Material::of_law(solid.0, 0.21 * (1.0 + 0.1 * (t % 7) as f64), 1.89);
    let materials: Vec<Material> = (0..mesh.tets().len()).map(stiffer).collect();
    let surfaces = springs.then(|| surfaces(&mesh, &elements.nodes, &positions, &materials));
    let fibres = solid.1.then(|| fibres(&noise(materials.len())).unit());
    Body {
        positions,
        model: Model::new(elements, materials, fibres).bounded(surfaces.unwrap_or_default()),
        outer,
    }
}

/// Springs, a bent wall on which all slides, and skin.
fn surfaces<const N: usize>(
    mesh: &TetMesh,
    nodes: &[[u32; N]],
    positions: &[Vector],
    materials: &[Material],
) -> Surfaces<N> {
    let cut = tagged(mesh, |c| match c.iter().all(|p| p.z < 3.0) {
        true => BoundaryTag::ChestWall,
        false if c.iter().all(|p| p.x > 12.0) => BoundaryTag::Cut,
        false => BoundaryTag::Skin,
    });
    let area = SlidingArea {
        centre_mm: Some([8.0, 8.0, 0.0]),
        radius_mm: 30.0,
        rim_mm: 25.0,
        stiffness_kpa_mm: 0.03,
    };
    let membrane = Membrane { thickness_mm: 1.5, young_kpa: 20.0, stretch: 1.05 };
    let free = vec![false; positions.len()];
    Surfaces {
        cut: Some(Arc::new(Foundation::new(&cut, materials, Some(0.05)))),
        wall: Some(SlidingWall::new(&cut, nodes, positions, &free, &area)),
        skin: Some(Skin::new(&cut, nodes, positions, &membrane).borne(nodes, positions.len())),
    }
}

/// Largest component of a vector of unknowns.
fn largest(v: &[f64]) -> f64 {
    v.iter().map(|v| v.abs()).fold(0.0, f64::max)
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>())
}

fn check_derivatives<const N: usize, const Q: usize>(springs: bool, solid: Solid) {
    let Body { model, .. } = body::<N, Q>(springs, solid);
    let count = model.elements.nodes.iter().flatten().max().map_or(0, |m| *m as usize + 1);
    let u: Vec<Vector> = noise(count).iter().map(|v| v * 0.15).collect();
    let v: Vec<Vector> = noise(2 * count)[count..].to_vec();
    let at = |t: f64| -> Vec<Vector> { u.iter().zip(&v).map(|(u, v)| u + v * t).collect() };
    let h = 1e-5;

    let slope = (energy(&model, &at(h)) - energy(&model, &at(-h))) / (2.0 * h);
    let work: f64 = forces(&model, &u).iter().zip(&v).map(|(f, v)| f.dot(v)).sum();
    assert!((slope - work).abs() < 1e-7 * work.abs(), "energy: {slope} {work}");

    // Only the lower half is stored: that the product is the slope says that the tangent is
    // symmetric.
    let pattern = Pattern::new(&model.elements.nodes, &vec![false; count], Storage::Lower);
    let mut blocks = pattern.zeros().unwrap();
    model.stiffness(&u, None, &pattern, &mut blocks).unwrap();
    let (up, down) = (forces(&model, &at(h)), forces(&model, &at(-h)));
    let slope: Vec<Vector> = up.iter().zip(&down).map(|(a, b)| (a - b) / (2.0 * h)).collect();
    let product = product(&pattern, &blocks, &pattern.gather(&v));
    let worst = difference(&pattern.gather(&slope), &product);
    assert!(worst < 1e-7 * largest(&product), "stiffness: {worst}");

    let all: Vec<u32> = (0..model.elements.nodes.len() as u32).collect();
    let along = pattern.gather(&model.slope(&all, &u, &v).unwrap());
    assert!(difference(&along, &product) < 1e-12 * largest(&product));

    // Several elements at once give what one after the other gives.
    let (energy, plain) = model.plain(&u).unwrap();
    let (fast_energy, fast) = model.evaluate(&u).unwrap();
    assert!((energy - fast_energy).abs() < 1e-13 * energy);
    let worst = difference(&pattern.gather(&plain), &pattern.gather(&fast));
    assert!(worst < 1e-13 * largest(&pattern.gather(&plain)), "forces: {worst}");
    let mut plain = pattern.zeros().unwrap();
    model.shifted_stiffness(&u, f64::NEG_INFINITY, &pattern, &mut plain).unwrap();
    let (plain, fast) = (plain.as_flattened(), blocks.as_flattened());
    assert!(difference(plain, fast) < 1e-13 * largest(plain));
}

/// The predicted volume strain is that of the step to first order, and the stiffness takes it.
fn check_predicted<const N: usize, const Q: usize>(solid: Solid) {
    let Body { model, .. } = body::<N, Q>(false, solid);
    let count = model.elements.nodes.iter().flatten().max().map_or(0, |m| *m as usize + 1);
    let u: Vec<Vector> = noise(count).iter().map(|v| v * 0.15).collect();
    let v: Vec<Vector> = noise(2 * count)[count..].to_vec();
    let pattern = Pattern::new(&model.elements.nodes, &vec![false; count], Storage::Lower);
    let off = |h: f64| {
        let step: Vec<Vector> = v.iter().map(|v| v * h).collect();
        let end: Vec<Vector> = u.iter().zip(&step).map(|(u, s)| u + s).collect();
        let (mut with, mut without) = (pattern.zeros().unwrap(), pattern.zeros().unwrap());
        let predicted = model.predicted(&u, &step).unwrap();
        model.stiffness(&end, Some(&predicted), &pattern, &mut with).unwrap();
        model.stiffness(&end, None, &pattern, &mut without).unwrap();
        let largest = largest(without.as_flattened());
        difference(with.as_flattened(), without.as_flattened()) / largest
    };
    assert!(off(0.0) < 1e-15);
    let (coarse, fine) = (off(1e-2), off(1e-3));
    assert!(coarse > 1e-6 && (coarse / fine - 100.0).abs() < 5.0, "{coarse} {fine}");
}

#[test]
fn the_predicted_volume_strain_is_of_first_order() {
    each_solid!(check_predicted());
}

fn energy<const N: usize, const Q: usize>(model: &Model<N, Q>, u: &[Vector]) -> f64 {
    model.evaluate(u).unwrap().0
}

fn forces<const N: usize, const Q: usize>(model: &Model<N, Q>, u: &[Vector]) -> Vec<Vector> {
    model.evaluate(u).unwrap().1
}

fn product(pattern: &Pattern, blocks: &[Block], x: &[f64]) -> Vec<f64> {
    let mut product = vec![0.0; x.len()];
    pattern.multiply(blocks, x, &mut product);
    product
}

#[test]
fn forces_and_stiffness_are_slopes_and_the_stiffness_is_symmetric() {
    for springs in [false, true] {
        each_solid!(check_derivatives(springs));
    }
}

fn check_inverse_derivative<const N: usize, const Q: usize>(springs: bool, solid: Solid) {
    let Body { positions, model, .. } = body::<N, Q>(springs, solid);
    let free = vec![false; positions.len()];
    let full = Pattern::new(&model.elements.nodes, &free, Storage::Full);
    let force = Vector::new(0.001, 0.004, -0.002);
    // On a shape that is not the one where they have length 1.
    let fibres = solid.1.then(|| fibres(&noise(model.materials.len())));
    let inverse = Inverse {
        fibres: fibres.as_ref(),
        loaded: &model.elements,
        materials: &model.materials,
        surfaces: &model.surfaces,
        force,
        positions: &positions,
        weight: 1.0,
        full: &full,
    };
    let y: Vec<Vector> = noise(positions.len()).iter().map(|v| v * 0.15).collect();
    let v = noise(2 * positions.len())[positions.len()..].to_vec();
    let at = |t: f64| -> Vec<Vector> { y.iter().zip(&v).map(|(y, v)| y + v * t).collect() };
    let h = 1e-5;
    let slope: Vec<Vector> = inverse
        .residual(&at(h))
        .unwrap()
        .iter()
        .zip(inverse.residual(&at(-h)).unwrap())
        .map(|(a, b)| (a - b) / (2.0 * h))
        .collect();
    let mut values = full.zeros().unwrap();
    inverse.derivative(&y, &mut values).unwrap();
    let product = product(&full, &values, &full.gather(&v));
    let worst = difference(&full.gather(&slope), &product);
    assert!(worst < 1e-7 * largest(&product), "{worst}");

    // The residual over the loaded shape is the forward one over the stress-free shape.
    let rest = inverse.body(&y).unwrap();
    let back: Vec<Vector> = y.iter().map(|y| -y).collect();
    let load = rest.elements.load(positions.len(), force);
    let forward: Vec<Vector> = forces(&rest, &back).iter().zip(&load).map(|(f, l)| f - l).collect();
    let residual = full.gather(&inverse.residual(&y).unwrap());
    let worst = difference(&full.gather(&forward), &residual);
    assert!(worst < 1e-12 * largest(&residual), "{worst}");
}

#[test]
fn the_inverse_derivative_is_a_slope_and_its_residual_the_forward_one() {
    for springs in [false, true] {
        each_solid!(check_inverse_derivative(springs));
    }
}

/// A linear displacement of the surface gives the same linear displacement inside.
fn check_patch<const N: usize, const Q: usize>(solid: Solid) {
    let Body { positions, model, outer } = body::<N, Q>(false, solid);
    let materials = vec![Material::of_law(solid.0, 0.21, 1.89); model.materials.len()];
    let model = {
        let (all, along) = (vec![true; materials.len()], vec![Vector::x(); materials.len()]);
        let same = Fibres { c: vec![0.2; materials.len()], ..fibres(&along) };
        Model::new(model.elements.only(&all), materials, solid.1.then_some(same))
    };
    assert!(outer.iter().filter(|o| !**o).count() > 5, "nodes inside");
    let gradient = Matrix::new(0.3, 0.2, 0.1, -0.1, -0.2, 0.15, 0.05, 0.1, 0.1);
    let want: Vec<Vector> = positions.iter().map(|x| gradient * x).collect();
    // The start keeps the surface and disturbs the inside.
    let start = want.iter().zip(noise(want.len())).zip(&outer);
    let start: Vec<Vector> = start.map(|((u, n), o)| if *o { *u } else { u + n * 0.2 }).collect();
    let pattern = Arc::new(Pattern::new(&model.elements.nodes, &outer, Storage::Lower));
    let tangent = Tangent::new(&pattern).unwrap();
    let mut newton = Newton::new(&model, tangent, &outer, 1.0, 30);
    let none = vec![Vector::zeros(); positions.len()];
    let found = newton
        .minimise(&none, start.clone(), Limits { goal: 1e-12, iterations: 30 }, Progress::none())
        .unwrap();
    let error: Vec<Vector> = found.u.iter().zip(&want).map(|(a, b)| a - b).collect();
    assert!(norm(&error) < 1e-10, "{}", norm(&error));
    let disturbed: Vec<Vector> = start.iter().zip(&want).map(|(a, b)| a - b).collect();
    assert!(norm(&disturbed) > 0.1);
}

#[test]
fn patch_test() {
    each_solid!(check_patch());
}

fn check_rigid<const N: usize, const Q: usize>(solid: Solid) {
    let Body { positions, model, .. } = body::<N, Q>(false, solid);
    let turn = Rotation3::from_euler_angles(0.7, -0.4, 2.0).into_inner();
    let shift = Vector::new(30.0, -20.0, 10.0);
    let rigid: Vec<Vector> = positions.iter().map(|x| turn * x + shift - x).collect();
    assert!(norm(&forces(&model, &rigid)) < 1e-11);
    assert!(energy(&model, &rigid).abs() < 1e-10);

    let u: Vec<Vector> = noise(positions.len()).iter().map(|v| v * 0.15).collect();
    let turned: Vec<Vector> =
        positions.iter().zip(&u).map(|(x, u)| turn * (x + u) + shift - x).collect();
    let (f, ft) = (forces(&model, &u), forces(&model, &turned));
    let off: Vec<Vector> = f.iter().zip(&ft).map(|(f, ft)| turn * f - ft).collect();
    assert!(norm(&off) < 1e-12 * norm(&f).max(1.0), "{}", norm(&off));
    assert!((energy(&model, &u) - energy(&model, &turned)).abs() < 1e-10 * energy(&model, &u));
}

#[test]
fn a_rigid_motion_bears_no_force_and_forces_turn_with_the_observer() {
    each_solid!(check_rigid());
}

/// Straight quadratic elements carry −V/20 at corners and V/5 at mid-sides; the sum is the weight.
#[test]
fn the_load_is_the_weight() {
    let force = Vector::new(0.0, 0.0, -2.0);
    let Body { positions, model, .. } = body::<10, 4>(false, PLAIN);
    let volume: f64 = model.elements.weights.iter().flatten().sum();
    let load = model.elements.load(positions.len(), force);
    assert!((load.iter().sum::<Vector>() - force * volume).norm() < 1e-9 * volume);
    let one = Elements::<10, 4>::new(&positions, vec![model.elements.nodes[0]]).unwrap();
    let v: f64 = one.weights[0].iter().sum();
    let load = one.load(positions.len(), force);
    for (a, node) in model.elements.nodes[0].iter().enumerate() {
        let share = if a < 4 { -v / 20.0 } else { v / 5.0 };
        assert!((load[*node as usize] - force * share).norm() < 1e-12 * v);
    }
}

#[test]
fn a_folded_element_is_named() {
    let Body { positions, model, .. } = body::<4, 1>(false, PLAIN);
    let mut u = vec![Vector::zeros(); positions.len()];
    let element = model.elements.nodes[17];
    u[element[0] as usize] =
        (positions[element[1] as usize] - positions[element[0] as usize]) * 3.0;
    assert!(model.evaluate(&u).is_none());
    assert!(model.plain(&u).is_err());
    assert!(model.volume_ratio(&u).is_err());
}

//! A hollow sphere that is stretched from within, beside the closed form of an incompressible one.
//!
//! With the energy Ŵ(λ) of an equibiaxial stretch λ, A and B the radii free of stress, λ_a and λ_b
//! the stretches there, λ_b³ − 1 = (A/B)³ (λ_a³ − 1),
//!
//! p = ∫ Ŵ′(λ) / (λ³ − 1) dλ from λ_b to λ_a
//!
//! (Green and Zerna, Theoretical Elasticity, 1954, section 3.10). A law whose energy depends on I₁
//! alone at constant volume has Ŵ(λ) = W(2 λ² + λ⁻⁴ − 3). Elements that lock need too
//! much.

use crate::element::{Elements, element_nodes};
use crate::material::{Gradient, Material};
use crate::model::Model;
use crate::newton::{KnownEquilibrium, Newton};
use crate::pattern::{Pattern, Storage};
use crate::tangent::Tangent;
use crate::test_mesh::ball;
use crate::{Law, Tissue};
use std::f64::consts::PI;
use std::sync::Arc;
use supine_mesh::Edges;
use supine_space::{Matrix, Progress, Vector};

const RADII: [f64; 2] = [10.0, 20.0];
/// How far the inner surface is stretched.
const STRETCH: f64 = 1.25;

/// Ŵ, kPa.
fn energy(material: &Material, stretch: f64) -> f64 {
    let thin = stretch.powi(-2);
    let f = Matrix::from_diagonal(&Vector::new(stretch, stretch, thin));
    material.energy(&Gradient::new(f - Matrix::identity()).unwrap())
}

/// p of the closed form, kPa.
fn pressure(material: &Material) -> f64 {
    const STEPS: usize = 400;
    let outer = ((RADII[0] / RADII[1]).powi(3) * (STRETCH.powi(3) - 1.0) + 1.0).cbrt();
    let slope = |s: f64| (energy(material, s + 1e-6) - energy(material, s - 1e-6)) / 2e-6;
    let at = |k: f64| {
        let stretch = outer + (STRETCH - outer) * k / STEPS as f64;
        slope(stretch) / (stretch.powi(3) - 1.0)
    };
    // The middle of each step.
    let sum: f64 = (0..STEPS).map(|k| at(k as f64 + 0.5)).sum();
    sum * (STRETCH - outer) / STEPS as f64
}

/// The pressure on the inner surface that is stretched so, over that of the closed form.
fn measured<const N: usize, const Q: usize>(
    law: Law,
    poisson: f64,
    (layers, rounds): (usize, usize),
) -> f64 {
    let (mesh, off) = ball(RADII[0], RADII[1], layers, rounds);
    let edges = Edges::new(&mesh);
    let mut positions: Vec<Vector> = mesh.points().iter().map(|p| p.coords).collect();
    if N == 10 {
        for [a, b] in edges.ends() {
            positions.push((positions[*a as usize] + positions[*b as usize]) / 2.0);
        }
        positions.iter_mut().zip(off.values()).for_each(|(p, off)| *p += off);
    }
    let nodes = element_nodes::<N>(&mesh, &edges);
    // The elements about the middle are the hollow.
    let (hollow, wall): (Vec<[u32; N]>, Vec<[u32; N]>) =
        nodes.iter().partition(|element| element.contains(&0));
    let mut held = vec![false; positions.len()];
    hollow.iter().flatten().for_each(|n| held[*n as usize] = true);
    let tissue = Tissue { young_kpa: 1.0, poisson, law, stiffening: 0.5, ..Tissue::default() };
    let material = Material::new(&tissue);
    let elements = Elements::<N, Q>::new(&positions, wall).unwrap();
    let materials = vec![material; elements.nodes.len()];
    let model = Model::new(elements, materials, None);
    let pattern = Arc::new(Pattern::new(&model.elements.nodes, &held, Storage::Lower));
    let zero = vec![Vector::zeros(); positions.len()];
    let mut u = zero.clone();
    // The outer surface as incompressible tissue has it is a good start for all.
    for ((u, x), held) in u.iter_mut().zip(&positions).zip(&held) {
        let grown = (RADII[0] / x.norm()).powi(3) * (STRETCH.powi(3) - 1.0) + 1.0;
        *u = if *held { x * (STRETCH - 1.0) } else { x * (grown.cbrt() - 1.0) };
    }
    let tangent = Tangent::new(&pattern).unwrap();
    let mut newton = Newton::new(&model, tangent, &held, 1.0, 60);
    let known = KnownEquilibrium { u: &zero, load: &zero };
    let found = newton.equilibrium(&zero, &u, known, 1e-9, Progress::none()).unwrap();
    // The work of the pressure is p dV, dV/dλ = 4 π A³ λ².
    let (_, forces) = model.evaluate(&found.u).unwrap();
    let inner = positions.iter().zip(&forces).zip(&held).filter(|(_, held)| **held);
    let work: f64 = inner.map(|((x, force), _)| x.dot(force)).sum();
    work / (4.0 * PI * RADII[0].powi(3) * STRETCH.powi(2)) / pressure(&material)
}

#[test]
fn a_pressurised_sphere_is_that_of_the_closed_form_up_to_incompressibility() {
    for law in Law::ALL {
        for poisson in [0.495, 0.4998] {
            let coarse = measured::<10, 4>(law, poisson, (2, 1)) - 1.0;
            assert!(coarse.abs() < 0.06, "{law} {poisson}: {coarse}");
        }
    }
    let fine = measured::<10, 4>(Law::NeoHookean, 0.4998, (4, 2)) - 1.0;
    assert!(fine.abs() < 0.01, "{fine}");
    // Linear ones lock.
    let off = measured::<4, 1>(Law::NeoHookean, 0.4998, (2, 1)) - 1.0;
    assert!(off > 1.0, "{off}");
}

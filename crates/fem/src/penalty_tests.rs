//! A second way to the same contact: springs that push back nodes within the body, ever stiffer.

use super::unilateral_tests::{TOLERANCE, apart, on_shaft, outside, pose, pressed, values};
use super::*;
use crate::krylov::conjugate_gradients;
use crate::wall::Target;
use std::collections::BTreeMap;
use supine_space::Matrix;

/// Stiffness of the springs, mN/mm, and the factor from one round to the next.
const FIRST: f64 = 10.0;
const FACTOR: f64 = 10.0;
const ROUNDS: usize = 7;
/// About the stiffness of a node of the tissue, mN/mm.
const OWN: f64 = 20.0;

/// Linear elements, as the twin has them.
type Linear = Coupling<4, 1>;

/// Gaps that are closed: node, depth (mm) and normal.
fn entered(c: &Linear, u: &[Vector]) -> Vec<(usize, f64, Vector)> {
    let wall = &c.pressing().unwrap().wall;
    let mut found = Vec::new();
    for &node in &wall.nodes {
        for part in 0..wall.surface.parts() {
            let gap = wall.gap(part, &wall.place(node, u), Target::at(&c.place.pose));
            if let Some(gap) = gap.filter(|gap| gap.mm < 0.0) {
                found.push((node as usize, -gap.mm, gap.normal));
            }
        }
    }
    found
}

/// Energy with the springs, and what is out of balance.
fn state(c: &Linear, u: &[Vector], spring: f64) -> Option<(f64, Vec<f64>)> {
    let (energy, mut forces) = c.site.model.evaluate(u)?;
    let work: f64 = c.site.load.iter().zip(u).map(|(f, u)| f.dot(u)).sum();
    forces.iter_mut().zip(&c.site.load).for_each(|(f, load)| *f -= load);
    let mut total = energy - work;
    for (node, depth, normal) in entered(c, u) {
        total += 0.5 * spring * depth * depth;
        forces[node] -= normal * (spring * depth);
    }
    Some((total, c.site.pattern.gather(&forces)))
}

/// A step of Newton's method, its system solved by conjugate gradients.
fn direction(c: &Linear, u: &[Vector], spring: f64, residual: &[f64]) -> Vec<f64> {
    let pattern = &c.site.pattern;
    let mut blocks = pattern.zeros().unwrap();
    c.site.model.stiffness(u, None, pattern, &mut blocks).unwrap();
    let springs: Vec<(usize, Vector)> = entered(c, u)
        .into_iter()
        .map(|(node, _, normal)| (pattern.row(node as u32).unwrap(), normal))
        .collect();
    let multiply = |x: &[f64], product: &mut [f64]| {
        pattern.multiply(&blocks, x, product);
        for (row, normal) in &springs {
            let along: f64 = (0..3).map(|k| normal[k] * x[row + k]).sum();
            (0..3).for_each(|k| product[row + k] += spring * along * normal[k]);
        }
    };
    // Each node scaled by a guess of its own stiffness: with its springs, of which sphere and shaft
    // each have one.
    let mut stiff = BTreeMap::new();
    for (row, normal) in &springs {
        let own = stiff.entry(*row).or_insert(Matrix::identity() * OWN);
        *own += normal * normal.transpose() * spring;
    }
    let soft: Vec<(usize, Matrix)> =
        stiff.into_iter().map(|(row, own)| (row, own.try_inverse().unwrap() * OWN)).collect();
    let scaled = |x: &mut [f64]| {
        x.iter_mut().for_each(|x| *x /= OWN);
        for (row, soft) in &soft {
            let node = soft * Vector::from_fn(|k, _| x[row + k]);
            (0..3).for_each(|k| x[row + k] = node[k]);
        }
        true
    };
    let right: Vec<f64> = residual.iter().map(|r| -r).collect();
    conjugate_gradients(multiply, scaled, &right, 1e-6, 20_000).unwrap()
}

/// The minimum with these springs, from `u`.
fn minimum(c: &Linear, u: &mut Vec<Vector>, spring: f64) {
    for _ in 0..200 {
        let (total, residual) = state(c, u, spring).unwrap();
        let size = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
        if size < 1e-5 {
            return;
        }
        let step = direction(c, u, spring, &residual);
        let mut share = 1.0;
        loop {
            let mut next = u.clone();
            let part: Vec<f64> = step.iter().map(|s| s * share).collect();
            c.site.pattern.add_to(&mut next, &part);
            let lower = state(c, &next, spring);
            if lower.is_some_and(|(next, _)| next <= total + 1e-12 * total.abs()) {
                *u = next;
                break;
            }
            share *= 0.5;
            assert!(share > 1e-9, "no way down at {size}");
        }
    }
    panic!("no minimum");
}

/// How far the places (mm) and the forces (relative) of the springs are off those of the contact.
fn off(c: &Linear, start: Vec<Vector>) -> [f64; 2] {
    let mut u = start;
    let (mut spring, mut off) = (FIRST, 0.0);
    for round in 0..ROUNDS {
        let before = u.clone();
        spring *= if round > 0 { FACTOR } else { 1.0 };
        minimum(c, &mut u, spring);
        off = apart(&u, &before);
    }
    assert!(off < 5e-3, "springs this stiff still matter: {off}");
    let force: Vector = entered(c, &u).iter().map(|(_, depth, n)| n * (spring * depth)).sum();
    let by_presses: Vector = c.forces().iter().map(|(_, force)| force).sum();
    [apart(&u, &c.place.u), (force - by_presses).norm() / by_presses.norm()]
}

#[test]
fn stiff_springs_lead_to_the_same_contact() {
    let mut outer = outside(Order::Linear);
    let mut inner = pressed(Order::Linear, &on_shaft(15.0));
    for (live, to) in [
        (&mut outer, pose([0.6, -0.3, -12.0], [0.0; 3])),
        (&mut inner, pose([0.8, 0.25, -0.8], [0.0, 0.015, 0.01])),
    ] {
        let first = either!(&live.coupling, c => c.place.u.clone());
        let before = values(live);
        live.step(&to).unwrap();
        let stepped = values(live);
        live.settle(&to, TOLERANCE, Progress::none()).unwrap();
        // Over such a jump a step's own estimate of its error is too low.
        let short = apart(&stepped, &values(live));
        assert!(short < 0.05, "{short}");
        assert!(apart(&values(live), &before) > 0.5 && live.coupled_nodes() > 2);
        let Either::Linear(coupling) = &live.coupling else { panic!("linear") };
        let [off, force] = off(coupling, first);
        assert!(off < 1e-3 && force < 1e-4, "{off} {force}");
    }
}

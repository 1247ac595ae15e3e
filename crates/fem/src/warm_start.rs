//! What solutions of a body leave to the next ones.

use crate::Unloading;
use crate::analysis::OutOfMemory;
use crate::inverse::Solver;
use crate::model::Model;
use crate::pattern::Pattern;
use crate::tangent::Tangent;
use std::sync::Arc;
use supine_space::Vector;

/// A stress-free shape.
#[derive(Clone)]
pub(crate) struct Rest<const N: usize, const Q: usize> {
    /// The mean modulus whose shape it is, kPa.
    pub(crate) young_kpa: f64,
    /// The body on it.
    pub(crate) model: Model<N, Q>,
    /// Displacement from it to the CT shape, mm.
    pub(crate) to_ct: Vec<Vector>,
    /// How it was found.
    pub(crate) unloading: Unloading,
    /// −E times its derivative by the mean modulus E, mm, once asked for.
    pub(crate) slope: Option<Vec<Vector>>,
}

/// States of a kind that are kept; the oldest ones go.
const KEPT: usize = 16;
/// States through which the next one is extrapolated, beside that of a rigid body.
const THROUGH: usize = 2;

/// What was found before of one body, and the factors that were used.
pub(crate) struct WarmStart<const N: usize, const Q: usize> {
    /// Something is kept at all: without, every solution is begun cold.
    keeps: bool,
    /// Factor of the stiffness near the last equilibrium.
    pub(crate) loaded: FactorCache,
    /// Factor of the stiffness in the CT shape on the last stress-free shape.
    pub(crate) in_ct: FactorCache,
    /// Displacements from the CT shape to equilibria, mm.
    pub(crate) equilibria: SolutionHistory,
    /// Displacements from the CT shape to stress-free shapes, mm.
    pub(crate) shapes: SolutionHistory,
    /// The last stress-free shape.
    rest: Option<Rest<N, Q>>,
}

impl<const N: usize, const Q: usize> WarmStart<N, Q> {
    /// Nothing, and nothing will be kept: the solution is begun cold.
    pub(crate) fn nothing() -> Self {
        Self::new(false)
    }

    /// Nothing yet.
    pub(crate) fn empty() -> Self {
        Self::new(true)
    }

    fn new(keeps: bool) -> Self {
        Self {
            keeps,
            loaded: FactorCache { keeps, tangent: None },
            in_ct: FactorCache { keeps, tangent: None },
            equilibria: SolutionHistory { keeps, states: Vec::new() },
            shapes: SolutionHistory { keeps, states: Vec::new() },
            rest: None,
        }
    }

    /// Whether something is kept.
    pub(crate) fn keeps(&self) -> bool {
        self.keeps
    }

    /// The last stress-free shape, if it is that of this modulus (kPa).
    pub(crate) fn take_rest(&mut self, young_kpa: f64) -> Option<Rest<N, Q>> {
        self.rest.take_if(|rest| rest.young_kpa == young_kpa)
    }

    /// The linear systems of the inverse problem: patient where something is kept.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn solver(&mut self, pattern: &Arc<Pattern>) -> Result<Solver, OutOfMemory> {
        let tangent = self.in_ct.take(pattern)?;
        Ok(if self.keeps { Solver::patient(tangent) } else { Solver::new(tangent) })
    }

    /// Keeps a stress-free shape.
    pub(crate) fn keep_rest(&mut self, rest: Rest<N, Q>) {
        if self.keeps {
            self.rest = Some(rest);
        }
    }
}

/// Room for a factor that may hold one of a former matrix.
pub(crate) struct FactorCache {
    keeps: bool,
    tangent: Option<Tangent>,
}

impl FactorCache {
    /// What was kept, or a new one.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn take(&mut self, pattern: &Arc<Pattern>) -> Result<Tangent, OutOfMemory> {
        match self.tangent.take() {
            Some(tangent) => Ok(tangent),
            None => Tangent::new(pattern),
        }
    }

    /// Keeps one.
    pub(crate) fn keep(&mut self, tangent: Tangent) {
        if self.keeps {
            self.tangent = Some(tangent);
        }
    }
}

/// A displacement at one modulus and under one gravity.
pub(crate) struct State {
    /// A unit vector, LPS.
    pub(crate) gravity: Vector,
    /// 1/E, 1/kPa.
    pub(crate) softness: f64,
    /// Per node, mm.
    pub(crate) values: Vec<Vector>,
    /// Their derivative by the mean modulus E, mm/kPa.
    pub(crate) slope: Option<Vec<Vector>>,
}

/// States that were found, in the order in which they were.
pub(crate) struct SolutionHistory {
    keeps: bool,
    states: Vec<State>,
}

impl SolutionHistory {
    /// Keeps a state in place of one found before at the same modulus and under the same gravity.
    pub(crate) fn keep(&mut self, state: impl FnOnce() -> State) {
        if !self.keeps {
            return;
        }
        let state = state();
        let same = |s: &State| s.softness == state.softness && s.gravity == state.gravity;
        self.states.retain(|s| !same(s));
        if self.states.len() == KEPT {
            self.states.remove(0);
        }
        self.states.push(state);
    }

    /// The lowest modulus of a state, kPa.
    pub(crate) fn lowest_kpa(&self) -> Option<f64> {
        self.states.iter().map(|s| 1.0 / s.softness).min_by(f64::total_cmp)
    }

    /// What those found under the nearest gravity make expect at this softness (1/kPa), mm: the
    /// polynomial in it through the nearest ones, with their slopes, and through a rigid body,
    /// which does not move.
    ///
    /// `None` when nothing was found, or when the gravity of the CT, under which nothing moves, is
    /// nearer.
    pub(crate) fn expected(
        &self,
        gravity: &Vector,
        ct: &Vector,
        softness: f64,
    ) -> Option<Vec<Vector>> {
        let off = |s: &State| (s.gravity - gravity).norm();
        let nearest = self.states.iter().map(off).fold(f64::INFINITY, f64::min);
        if nearest > (ct - gravity).norm() {
            return None;
        }
        let mut near: Vec<&State> = self.states.iter().filter(|s| off(s) <= nearest).collect();
        near.sort_by(|a, b| {
            let [a, b] = [a, b].map(|s| (s.softness - softness).abs());
            a.total_cmp(&b)
        });
        near.truncate(THROUGH);
        if let Some(state) = near.first().filter(|s| s.softness == softness) {
            return Some(state.values.clone());
        }
        Some(extrapolated(&near, softness))
    }
}

/// The polynomial through the states and zero at softness 0.
fn extrapolated(states: &[&State], softness: f64) -> Vec<Vector> {
    let mut places = vec![0.0];
    for state in states {
        places.push(state.softness);
        if state.slope.is_some() {
            places.push(state.softness);
        }
    }
    let mut sum = vec![Vector::zeros(); states.first().map_or(0, |s| s.values.len())];
    for state in states {
        let of_value = |k: usize| if places[k] == state.softness { 1.0 } else { 0.0 };
        let value: Vec<f64> = (0..places.len()).map(of_value).collect();
        let none = vec![0.0; places.len()];
        add(&mut sum, polynomial(&places, value.clone(), &none, softness), &state.values);
        if let Some(slope) = &state.slope {
            // By 1/E it is −E² times that by E.
            let by_softness = -1.0 / (state.softness * state.softness);
            let weight = polynomial(&places, none, &value, softness);
            add(&mut sum, weight * by_softness, slope);
        }
    }
    sum
}

fn add(sum: &mut [Vector], weight: f64, values: &[Vector]) {
    sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v * weight);
}

/// The polynomial with these values at these places, and where a place stands twice with the slope
/// there, at `x`: Newton's form by divided differences.
fn polynomial(places: &[f64], values: Vec<f64>, slopes: &[f64], x: f64) -> f64 {
    let mut c = values;
    for order in 1..places.len() {
        for k in (order..places.len()).rev() {
            let way = places[k] - places[k - order];
            c[k] = if way == 0.0 { slopes[k] } else { (c[k] - c[k - 1]) / way };
        }
    }
    c.iter().zip(places).rev().fold(0.0, |sum, (c, place)| sum * (x - place) + c)
}

//! Newton's method for the minimum of the potential energy.

use crate::Error;
use crate::analysis::OutOfMemory;
use crate::batch::VolumeStrain;
use crate::model::Model;
use crate::outcome::{Cause, Equilibrium, NonConvergence, SolveError};
use crate::pattern::Pattern;
use crate::tangent::{LinearSolution, Tangent};
use std::sync::Arc;
use supine_space::{Progress, Vector};

/// Share of the promised decrease of energy that a step must bring (Armijo).
const ARMIJO: f64 = 1e-4;
/// Steps are shortened at most so often.
const SHORTENINGS: usize = 40;
/// Steps with a shifted stiffness are doubled at most so often.
const DOUBLINGS: i32 = 6;
/// Below this share of the energy's terms a change of it is rounding.
const ENERGY_ROUNDING: f64 = 1e-12;
/// Loads below this share of full gravity are solved to an absolute residual.
const SMALL_LOAD: f64 = 1e-4;
/// Residual goal between load steps.
const STEP_GOAL: f64 = 1e-6;
/// Smallest load step.
const SMALLEST_STEP: f64 = 1.0 / 32.0;
/// Forcing term (relative residual of the linear system) of the first direction, and the largest of
/// a later one. It falls with the residual, so that Newton's method stays quadratic: Eisenstat and
/// Walker, SIAM J. Sci. Comput. 17, 1996, choice 2.
const FIRST_FORCING: f64 = 0.03;
const MAX_FORCING: f64 = 0.1;
/// Relative residual of linear systems whose solution is a result.
const RESULT_TOLERANCE: f64 = 1e-11;
/// The last direction leaves this share of the goal.
const SPARE: f64 = 0.3;
/// Iterations of a load step: one that needs more is cut. Of all load steps together, in units of
/// those that the whole load at once may take.
const STEP_ITERATIONS: usize = 20;
const STEPS_ITERATIONS: usize = 4;
/// Iterations from an expected equilibrium; three are usual, and with more it is not where it was
/// expected.
const RESUMED_ITERATIONS: usize = 12;

/// An equilibrium to start from: its displacement (mm) and its load (mN per node).
#[derive(Clone, Copy)]
pub(crate) struct KnownEquilibrium<'a> {
    pub(crate) u: &'a [Vector],
    pub(crate) load: &'a [Vector],
}

/// When Newton's method ends.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// The relative residual to be reached.
    pub(crate) goal: f64,
    /// Most iterations.
    pub(crate) iterations: usize,
}

/// What was spent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Effort {
    /// Newton iterations.
    pub(crate) iterations: usize,
    /// Those whose exact stiffness was not positive definite.
    pub(crate) indefinite: usize,
    /// Load steps.
    pub(crate) load_steps: usize,
    /// Entries of the triangular factor.
    pub(crate) factor_entries: usize,
}

/// Newton's method on one body.
pub(crate) struct Newton<'a, const N: usize, const Q: usize> {
    model: &'a Model<N, Q>,
    pattern: Arc<Pattern>,
    held: &'a [bool],
    tangent: Tangent,
    /// Norm of the nodal forces of full gravity, mN.
    weight: f64,
    max_iterations: usize,
    /// What was spent so far.
    pub(crate) effort: Effort,
}

/// Euclidean norm over all nodes.
pub(crate) fn norm(nodes: &[Vector]) -> f64 {
    nodes.iter().map(Vector::norm_squared).sum::<f64>().sqrt()
}

fn dot(a: &[Vector], b: &[Vector]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// A state on the way: its displacement, energy and residual.
struct State<const Q: usize> {
    u: Vec<Vector>,
    /// ln J as the step that led here predicted it.
    predicted: Option<VolumeStrain<Q>>,
    /// Potential energy: elastic energy less the work of the load, mN mm.
    potential: f64,
    /// Work of the load, mN mm.
    work: f64,
    /// Internal less external forces of all nodes, mN; zero at held nodes.
    out_of_balance: Vec<Vector>,
    /// Norm of `out_of_balance` over that of load or reactions.
    residual: f64,
}

/// Where to go from a state.
struct Direction {
    /// The full step, mm.
    step: Vec<Vector>,
    /// By the shifted stiffness, not the exact one.
    shifted: bool,
}

impl<'a, const N: usize, const Q: usize> Newton<'a, N, Q> {
    /// Prepares the method: `tangent` is room for a factor, or one of a similar stiffness; `weight`
    /// is the norm of the nodal forces of full gravity, mN.
    pub(crate) fn new(
        model: &'a Model<N, Q>,
        tangent: Tangent,
        held: &'a [bool],
        weight: f64,
        max_iterations: usize,
    ) -> Self {
        let pattern = tangent.pattern().clone();
        let effort = Effort { factor_entries: tangent.factor_entries(), ..Effort::default() };
        Self { model, pattern, held, tangent, weight, max_iterations, effort }
    }

    /// The factor used last.
    pub(crate) fn into_tangent(self) -> Tangent {
        self.tangent
    }

    /// The equilibrium under `load` (mN per node): from `expected` (mm) if that leads there, else
    /// from `known`, an equilibrium and its load.
    ///
    /// # Errors
    /// As [`Self::equilibrium`].
    pub(crate) fn resumed(
        &mut self,
        load: &[Vector],
        expected: Option<Vec<Vector>>,
        known: KnownEquilibrium<'_>,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Equilibrium, SolveError> {
        let Some(expected) = expected else {
            return self.equilibrium(load, known.u, known, goal, progress);
        };
        let limits = Limits { goal, iterations: RESUMED_ITERATIONS.min(self.max_iterations) };
        match self.minimise(load, expected, limits, progress.part(0.0, 0.5)) {
            Ok(found) => {
                self.effort.load_steps = 1;
                Ok(found)
            }
            Err(SolveError::NotConverged(_)) => {
                self.equilibrium(load, known.u, known, goal, progress.part(0.5, 1.0))
            }
            Err(other) => Err(other),
        }
    }

    /// The equilibrium under `load` (mN per node): in one go from `start` (mm), and if that fails
    /// step by step from `known`, an equilibrium and its load.
    ///
    /// # Errors
    /// When stopped, out of memory, or when neither way finds an equilibrium.
    pub(crate) fn equilibrium(
        &mut self,
        load: &[Vector],
        start: &[Vector],
        known: KnownEquilibrium<'_>,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Equilibrium, SolveError> {
        let limits = Limits { goal, iterations: self.max_iterations };
        match self.minimise(load, start.to_vec(), limits, progress.part(0.0, 0.6)) {
            Ok(found) => {
                self.effort.load_steps = 1;
                Ok(found)
            }
            Err(SolveError::NotConverged(_)) => {
                self.step_by_step(load, known, goal, progress.part(0.6, 1.0))
            }
            Err(other) => Err(other),
        }
    }

    /// The equilibrium under `load`, following the load from a known equilibrium.
    fn step_by_step(
        &mut self,
        load: &[Vector],
        known: KnownEquilibrium<'_>,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Equilibrium, SolveError> {
        let (mut u, mut share, mut step) = (known.u.to_vec(), 0.0, 0.25);
        let last = self.effort.iterations + STEPS_ITERATIONS * self.max_iterations;
        loop {
            let next: f64 = if share + step > 1.0 - SMALLEST_STEP { 1.0 } else { share + step };
            let part: Vec<Vector> =
                load.iter().zip(known.load).map(|(l, k)| k * (1.0 - next) + l * next).collect();
            let left = last.saturating_sub(self.effort.iterations);
            let limits = Limits {
                goal: if next < 1.0 { STEP_GOAL.max(goal) } else { goal },
                iterations: STEP_ITERATIONS.min(self.max_iterations).min(left),
            };
            match self.minimise(&part, u.clone(), limits, progress.part(share, next)) {
                Ok(found) => {
                    self.effort.load_steps += 1;
                    if next >= 1.0 {
                        return Ok(found);
                    }
                    (u, share, step) = (found.u, next, 1.5 * step);
                }
                Err(SolveError::NotConverged(stall))
                    if step <= SMALLEST_STEP || self.effort.iterations >= last =>
                {
                    return Err(SolveError::NotConverged(NonConvergence {
                        load_share: share,
                        ..stall
                    }));
                }
                Err(SolveError::NotConverged(_)) => step *= 0.5,
                Err(other) => return Err(other),
            }
        }
    }

    /// Newton's method from `u`.
    ///
    /// # Errors
    /// When stopped, out of memory, or when no equilibrium was found.
    pub(crate) fn minimise(
        &mut self,
        load: &[Vector],
        u: Vec<Vector>,
        limits: Limits,
        progress: Progress<'_>,
    ) -> Result<Equilibrium, SolveError> {
        let Limits { goal, iterations } = limits;
        let stall = |cause, residual, u| {
            Err(SolveError::NotConverged(NonConvergence { cause, residual, u, load_share: 0.0 }))
        };
        let Some(mut state) = self.state(u.clone(), load) else {
            return stall(Cause::Start, f64::INFINITY, u);
        };
        let (first, mut share) = (state.residual, 0f64);
        let mut forcing = FIRST_FORCING;
        for _ in 0..iterations {
            if state.residual <= goal {
                return Ok(Equilibrium { u: state.u, residual: state.residual });
            }
            share = share.max((first / state.residual).ln() / (first / goal).ln());
            progress.at(share)?;
            self.effort.iterations += 1;
            let min = (SPARE * goal / state.residual).min(FIRST_FORCING);
            let Some(direction) = self.direction(&state, forcing.max(min))? else {
                return stall(Cause::Singular, state.residual, state.u);
            };
            match self.search(&state, &direction, load) {
                Some(mut next) => {
                    forcing = MAX_FORCING.min(0.9 * (next.residual / state.residual).powi(2));
                    let step: Vec<Vector> =
                        next.u.iter().zip(&state.u).map(|(new, old)| new - old).collect();
                    next.predicted = self.model.predicted(&state.u, &step);
                    state = next;
                }
                None => return stall(Cause::NoDescent, state.residual, state.u),
            }
        }
        if state.residual <= goal {
            return Ok(Equilibrium { u: state.u, residual: state.residual });
        }
        stall(Cause::Iterations, state.residual, state.u)
    }

    /// The body.
    pub(crate) fn model(&self) -> &'a Model<N, Q> {
        self.model
    }

    /// Number of nodes.
    pub(crate) fn nodes(&self) -> usize {
        self.held.len()
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        self.pattern.unknowns()
    }

    /// What a halt before a relative residual of `tolerance` means to a user.
    pub(crate) fn failed(&self, halt: SolveError, tolerance: f64) -> Error {
        match halt {
            SolveError::Stopped(stopped) => stopped.into(),
            SolveError::Memory => Error::Memory { unknowns: self.unknowns() },
            SolveError::NotConverged(NonConvergence { cause, residual, u, load_share }) => {
                let (tet, volume_ratio) = match self.model.volume_ratio(&u) {
                    Ok(ratio) => (ratio.worst, ratio.min),
                    Err(folded) => (folded.0, 0.0),
                };
                let (cause, advice) = cause.explain();
                Error::NonConvergence {
                    cause,
                    iterations: self.effort.iterations,
                    residual,
                    tolerance,
                    load_share,
                    tet,
                    volume_ratio,
                    advice,
                }
            }
        }
    }

    /// Whether the body is stable at `u`: its exact stiffness is positive definite.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn is_stable(&mut self, u: &[Vector]) -> Result<bool, OutOfMemory> {
        self.tangent.is_definite(self.model, u)
    }

    /// The state with displacement `u`; `None` when an element is turned inside out, or a node has
    /// slid to where the body it slides on has no normal.
    fn state(&self, u: Vec<Vector>, load: &[Vector]) -> Option<State<Q>> {
        let (energy, mut forces) = self.model.evaluate(&u)?;
        let mut reactions = 0.0;
        for ((force, load), held) in forces.iter_mut().zip(load).zip(self.held) {
            if *held {
                reactions += force.norm_squared();
                *force = Vector::zeros();
            } else {
                *force -= load;
            }
        }
        if let Some(slide) = &self.model.slide {
            reactions += slide.project(&u, &mut forces)?;
        }
        let scale = norm(load).max(reactions.sqrt()).max(SMALL_LOAD * self.weight);
        let work = dot(load, &u);
        let residual = norm(&forces) / scale;
        Some(State {
            u,
            predicted: None,
            potential: energy - work,
            work,
            out_of_balance: forces,
            residual,
        })
    }

    /// The Newton direction with this forcing term; `None` when the stiffness is singular.
    fn direction(
        &mut self,
        state: &State<Q>,
        forcing: f64,
    ) -> Result<Option<Direction>, OutOfMemory> {
        let right: Vec<f64> =
            self.pattern.gather(&state.out_of_balance).iter().map(|r| -r).collect();
        let (u, predicted) = (&state.u, state.predicted.as_ref());
        let solution = self.tangent.solve(self.model, u, predicted, [&right], forcing)?;
        Ok(solution.map(|[LinearSolution { x, exact }]| {
            self.effort.indefinite += usize::from(!exact);
            Direction { step: self.pattern.scatter(&x), shifted: !exact }
        }))
    }

    /// The solutions of the linear system at displacement `u` for nodal values `q` (those of held
    /// nodes count for nothing): with the exact stiffness, or the shifted one where the exact one
    /// is not positive definite. `None` when neither has a factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn linearised<const K: usize>(
        &mut self,
        u: &[Vector],
        q: [&[Vector]; K],
    ) -> Result<Option<[Vec<Vector>; K]>, OutOfMemory> {
        let right = q.map(|q| self.pattern.gather(q));
        let right = right.each_ref().map(Vec::as_slice);
        let mut solved = self.tangent.solve(self.model, u, None, right, RESULT_TOLERANCE)?;
        let exact = |solutions: &Option<[LinearSolution; K]>| {
            solutions.iter().flatten().all(|solution| solution.exact)
        };
        // A stiffness may only seem indefinite in single precision.
        if !exact(&solved) && self.tangent.use_double()? {
            solved = self.tangent.solve(self.model, u, None, right, RESULT_TOLERANCE)?;
        }
        Ok(solved.map(|solutions| {
            self.effort.indefinite += usize::from(solutions.iter().any(|solution| !solution.exact));
            solutions.map(|solution| self.pattern.scatter(&solution.x))
        }))
    }

    /// The first state along `direction` that lowers the potential enough, from the full step down.
    ///
    /// Near the equilibrium a change of the potential is rounding: there a step counts when the
    /// residual does not grow.
    fn search(&self, state: &State<Q>, direction: &Direction, load: &[Vector]) -> Option<State<Q>> {
        let slope = dot(&state.out_of_balance, &direction.step);
        let rounding = ENERGY_ROUNDING * (state.potential.abs() + state.work.abs());
        let mut t = 1.0;
        for _ in 0..SHORTENINGS {
            let Some(next) = self.state_at(self.moved(&state.u, t, &direction.step), load) else {
                t *= 0.5;
                continue;
            };
            let rise = next.potential - state.potential;
            if rise <= ARMIJO * t * slope {
                let short = direction.shifted && t == 1.0;
                return Some(if short { self.longer(state, next, direction, load) } else { next });
            }
            if (t * slope).abs() < rounding && next.residual <= state.residual {
                return Some(next);
            }
            // The minimum of the parabola through both potentials and the slope.
            let curvature = rise - slope * t;
            let best = if curvature > 0.0 { -slope * t * t / (2.0 * curvature) } else { 0.5 * t };
            t = best.clamp(0.1 * t, 0.5 * t);
        }
        None
    }

    /// u + t d, brought back to the wall where it slides on that.
    fn moved(&self, u: &[Vector], t: f64, d: &[Vector]) -> Vec<Vector> {
        let mut moved = u.iter().zip(d).map(|(u, d)| u + d * t).collect::<Vec<Vector>>();
        self.model.surfaces.follow_wall(u, &mut moved);
        moved
    }

    /// The state at `u`, nodes that slide brought back to their surface; `None` when that fails or
    /// an element is turned inside out.
    fn state_at(&self, mut u: Vec<Vector>, load: &[Vector]) -> Option<State<Q>> {
        let brought = self.model.slide.as_ref().is_none_or(|slide| slide.bring(&mut u));
        brought.then(|| self.state(u, load)).flatten()
    }

    /// The last of steps twice as long as the one before that lower the potential further than
    /// `next`, the full step from `state`: a shifted stiffness is stiffer than the body, and its
    /// steps fall short.
    fn longer(
        &self,
        state: &State<Q>,
        mut next: State<Q>,
        direction: &Direction,
        load: &[Vector],
    ) -> State<Q> {
        for doubling in 1..=DOUBLINGS {
            let t = 2f64.powi(doubling);
            match self.state_at(self.moved(&state.u, t, &direction.step), load) {
                Some(farther) if farther.potential < next.potential => next = farther,
                _ => break,
            }
        }
        next
    }
}

#[cfg(test)]
#[path = "newton_tests.rs"]
mod tests;

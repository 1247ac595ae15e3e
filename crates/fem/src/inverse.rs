//! The stress-free shape from which a load gives a known shape.
//!
//! The unknown is the stress-free position X of the nodes; all integrals run over the known, loaded
//! shape x. Source: Govindjee and Mihalic, Computational methods for inverse finite elastostatics,
//! Comput. Methods Appl. Mech. Eng. 136, 1996. With the same parent quadrature points the residual
//! equals the forward one on X, so the forward solution on X is x to rounding, if it is the one
//! that a forward solve finds.

use crate::analysis::OutOfMemory;
use crate::element::Elements;
use crate::krylov::{gmres, norm};
use crate::material::{Fibres, Gradient, LoadedState, Material};
use crate::model::{Folded, Model};
use crate::outcome::SolveError;
use crate::pattern::{Block, Pattern, Storage, block, pairs};
use crate::surfaces::Surfaces;
use crate::tangent::Tangent;
use supine_space::{Matrix, Progress, Vector};

/// Steps are shortened at most so often.
const SHORTENINGS: usize = 12;
/// Iterations; five to seven are usual, eleven near the limit of existence.
const ITERATIONS: usize = 20;
/// Residual goal between load steps.
const STEP_GOAL: f64 = 1e-6;
/// Steps of the linear iteration; ten to twenty are usual, a hundred near the limit of existence.
const KRYLOV_STEPS: usize = 120;
/// Such steps with the factor of a similar problem that cost about as much as a new factor.
const PATIENCE: usize = 40;
/// Relative residual of linear systems whose solution is a result.
const LINEAR_GOAL: f64 = 1e-11;

/// The inverse problem of one body.
#[derive(Clone, Copy)]
pub(crate) struct Inverse<'a, const N: usize, const Q: usize> {
    /// Elements on the loaded shape.
    pub(crate) loaded: &'a Elements<N, Q>,
    /// What each element is made of.
    pub(crate) materials: &'a [Material],
    /// Fibres on the loaded shape; of any length.
    pub(crate) fibres: Option<&'a Fibres<Q>>,
    /// What acts on its boundary; on any stress-free shape.
    pub(crate) surfaces: &'a Surfaces<N>,
    /// The load, kPa/mm per stress-free volume.
    pub(crate) force: Vector,
    /// Positions of the nodes of the loaded shape, mm.
    pub(crate) positions: &'a [Vector],
    /// Norm of the nodal forces of the load, mN: the scale of the residual.
    pub(crate) weight: f64,
    /// Pattern of the unsymmetric derivative.
    pub(crate) full: &'a Pattern,
}

impl<const N: usize, const Q: usize> Inverse<'_, N, Q> {
    /// Residual forces (mN per node, held nodes included) at X = x + `y`.
    ///
    /// f = dX/dx, F = f^-1, j = det f, b = F Fᵀ, σ = j [m (b − I) − λ ln j I],
    /// R_a = Σ_q w [σ g_a − j N_a force], g_a and w on the loaded shape, and the forces of the
    /// boundary.
    ///
    /// # Errors
    /// When an element of X is turned inside out.
    pub(crate) fn residual(&self, y: &[Vector]) -> Result<Vec<Vector>, Folded> {
        let mut residual = vec![Vector::zeros(); y.len()];
        for (e, nodes) in self.loaded.nodes.iter().enumerate() {
            for q in 0..Q {
                let state = self.state(e, q, y)?;
                let weight = self.loaded.weights[e][q];
                for (a, node) in nodes.iter().enumerate() {
                    let body = self.force * (state.j * self.loaded.values[q][a]);
                    residual[*node as usize] +=
                        (state.stress * self.loaded.gradients[e][q][a] - body) * weight;
                }
            }
        }
        let (surfaces, u) = self.boundary(y);
        surfaces.evaluate(&self.loaded.nodes, &u, &mut residual);
        Ok(residual)
    }

    /// Fills `values` with dR/dX.
    ///
    /// See [`crate::material::LoadedTangent`].
    ///
    /// # Errors
    /// When an element of X is turned inside out.
    pub(crate) fn derivative(&self, y: &[Vector], values: &mut [Block]) -> Result<(), Folded> {
        values.fill([0.0; 9]);
        for e in 0..self.loaded.nodes.len() {
            let mut blocks = [[Matrix::zeros(); N]; N];
            for q in 0..Q {
                let state = self.state(e, q, y)?;
                let body = self.loaded.values[q].map(|value| self.force * (state.j * value));
                let (weight, g) = (self.loaded.weights[e][q], &self.loaded.gradients[e][q]);
                let tangent = state.change(weight, g, body);
                let fibres = self.fibres.map(|fibres| fibres.change((e, q), &state, weight, g));
                for (a, c) in pairs(N, Storage::Full) {
                    tangent.add_to(&mut blocks[a][c], a, c);
                    fibres.iter().for_each(|fibres| fibres.add_to(&mut blocks[a][c], a, c));
                }
            }
            for ((a, c), place) in pairs(N, Storage::Full).zip(self.full.places::<N>(e)) {
                place.add(&block(&blocks[a][c]), values);
            }
        }
        let (surfaces, u) = self.boundary(y);
        surfaces.add_rest_stiffness(&self.loaded.nodes, &u, self.full, values);
        Ok(())
    }

    /// What acts on the boundary of the body whose stress-free shape is x + `y`, and the
    /// displacement from there to x.
    fn boundary(&self, y: &[Vector]) -> (Surfaces<N>, Vec<Vector>) {
        let rest: Vec<Vector> = self.positions.iter().zip(y).map(|(x, y)| x + y).collect();
        (self.surfaces.at_rest(&self.loaded.nodes, &rest), y.iter().map(|y| -y).collect())
    }

    fn state(&self, e: usize, q: usize, y: &[Vector]) -> Result<LoadedState, Folded> {
        let back = Gradient::new(self.loaded.gradient(e, q, y)).ok_or(Folded(e))?;
        let mut state = self.materials[e].loaded(&back).ok_or(Folded(e))?;
        if let Some(fibres) = self.fibres {
            fibres.load(e, q, &mut state).ok_or(Folded(e))?;
        }
        Ok(state)
    }

    /// X − x (mm per node) at which the residual is at most `goal` of the load; `None` when no such
    /// shape was found.
    ///
    /// Newton from where X is `expected`, if anywhere; if that fails from X = x under the whole
    /// load; if that fails too the load is followed in steps of at least `smallest_step` (1: no
    /// such attempt).
    ///
    /// # Errors
    /// When stopped or out of memory.
    pub(crate) fn solve(
        &self,
        solver: &mut Solver,
        expected: Option<Vec<Vector>>,
        goal: f64,
        smallest_step: f64,
        progress: Progress<'_>,
    ) -> Result<Option<Vec<Vector>>, SolveError> {
        if let Some(expected) = expected
            && let Some(found) = solver.newton(self, &expected, goal, progress)?
        {
            return Ok(Some(found));
        }
        let mut y = vec![Vector::zeros(); self.positions.len()];
        let (mut share, mut step) = (0.0f64, 1.0);
        while share < 1.0 {
            let next: f64 = (share + step).min(1.0);
            let part = Self { force: self.force * next, ..*self };
            let part_goal = if next < 1.0 { STEP_GOAL.max(goal) } else { goal };
            match solver.newton(&part, &y, part_goal, progress.part(share, next))? {
                Some(found) => (y, share, step) = (found, next, 2.0 * step),
                None if step <= smallest_step => return Ok(None),
                None => step *= 0.5,
            }
        }
        Ok(Some(y))
    }

    /// (dR/dX)⁻¹ `q` at X = x + `y`; `None` when the iteration does not get there.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn linearised(
        &self,
        solver: &mut Solver,
        y: &[Vector],
        q: &[Vector],
    ) -> Result<Option<Vec<Vector>>, OutOfMemory> {
        let negative = solver.direction(self, y, &self.full.gather(q), LINEAR_GOAL)?;
        Ok(negative.map(|d| d.into_iter().map(|v: Vector| -v).collect()))
    }

    /// dR/dX times `z` at X = x + `y`; `None` when an element of X is turned inside out.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn times_derivative(
        &self,
        y: &[Vector],
        z: &[Vector],
    ) -> Result<Option<Vec<Vector>>, OutOfMemory> {
        let mut values = self.full.zeros()?;
        if self.derivative(y, &mut values).is_err() {
            return Ok(None);
        }
        let mut product = vec![0.0; self.full.unknowns()];
        self.full.multiply(&values, &self.full.gather(z), &mut product);
        Ok(Some(self.full.scatter(&product)))
    }

    /// The body on the stress-free shape x + `y`; `None` when that is folded.
    pub(crate) fn body(&self, y: &[Vector]) -> Option<Model<N, Q>> {
        let rest: Vec<Vector> = self.positions.iter().zip(y).map(|(x, y)| x + y).collect();
        let elements = Elements::new(&rest, self.loaded.nodes.clone()).ok()?;
        let fibres = self.fibres.map(|fibres| fibres.pushed(self.loaded, y).unit());
        let surfaces = self.surfaces.at_rest(&self.loaded.nodes, &rest);
        Some(Model::new(elements, self.materials.to_vec(), fibres).bounded(surfaces))
    }
}

/// The linear systems of the inverse problem.
pub(crate) struct Solver {
    /// Stiffness of the body on the stress-free shape, loaded.
    pub(crate) tangent: Tangent,
    /// Newton iterations so far.
    pub(crate) iterations: usize,
    /// Steps that the linear iteration may take with the factor at hand before that is renewed;
    /// `None`: it is renewed every time.
    patience: Option<usize>,
}

impl Solver {
    /// That renews its factor every time.
    pub(crate) fn new(tangent: Tangent) -> Self {
        Self { tangent, iterations: 0, patience: None }
    }

    /// That begins with the factor at hand, if there is one, and keeps it as long as it serves.
    pub(crate) fn patient(tangent: Tangent) -> Self {
        Self { patience: Some(PATIENCE), ..Self::new(tangent) }
    }

    /// With a factor of this very problem.
    pub(crate) fn ready(tangent: Tangent) -> Self {
        Self { patience: Some(KRYLOV_STEPS), ..Self::new(tangent) }
    }

    fn newton<const N: usize, const Q: usize>(
        &mut self,
        problem: &Inverse<'_, N, Q>,
        start: &[Vector],
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Option<Vec<Vector>>, SolveError> {
        let residual = |y: &[Vector]| problem.residual(y).ok().map(|r| problem.full.gather(&r));
        let mut y = start.to_vec();
        let Some(mut r) = residual(&y) else { return Ok(None) };
        for iteration in 0..ITERATIONS {
            let relative = norm(&r) / problem.weight;
            if relative <= goal {
                return Ok(Some(y));
            }
            progress.at(iteration as f64 / 10.0)?;
            self.iterations += 1;
            // A smaller forcing term than this gains nothing in the next iteration.
            let forcing = relative.min(1e-2).max(0.1 * goal / relative);
            let Some(direction) = self.direction(problem, &y, &r, forcing)? else {
                return Ok(None);
            };
            let next = (0..SHORTENINGS).find_map(|shortening| {
                let t = 0.5f64.powi(shortening as i32);
                let mut next: Vec<Vector> =
                    y.iter().zip(&direction).map(|(y, d)| y + d * t).collect();
                problem.surfaces.follow_wall_rest(problem.positions, &y, &mut next);
                let r_next = residual(&next)?;
                (norm(&r_next) < (1.0 - 1e-4 * t) * norm(&r)).then_some((next, r_next))
            });
            match next {
                Some(next) => (y, r) = next,
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    /// The Newton direction by an iteration that the stiffness of the body on the present shape
    /// preconditions: moving the stress-free shape or the loaded one by the same small step changes
    /// the forces nearly oppositely.
    fn direction<const N: usize, const Q: usize>(
        &mut self,
        problem: &Inverse<'_, N, Q>,
        y: &[Vector],
        r: &[f64],
        forcing: f64,
    ) -> Result<Option<Vec<Vector>>, OutOfMemory> {
        let mut values = problem.full.zeros()?;
        if problem.derivative(y, &mut values).is_err() {
            return Ok(None);
        }
        let wanted: Vec<f64> = r.iter().map(|r| -r).collect();
        let iterate = |tangent: &mut Tangent, steps: usize| {
            gmres(
                |x, product| problem.full.multiply(&values, x, product),
                |x| tangent.apply_factor(x),
                &wanted,
                forcing,
                steps,
            )
            .map(|direction| problem.full.scatter(&direction))
        };
        if let Some(patience) = self.patience
            && self.tangent.is_factorised()
            && let Some(direction) = iterate(&mut self.tangent, patience)
        {
            return Ok(Some(direction));
        }
        let Some(body) = problem.body(y) else { return Ok(None) };
        let back: Vec<Vector> = y.iter().map(|y| -y).collect();
        if !self.tangent.renew(&body, &back)? {
            return Ok(None);
        }
        Ok(iterate(&mut self.tangent, KRYLOV_STEPS))
    }
}

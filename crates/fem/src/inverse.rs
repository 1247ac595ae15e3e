//! The stress-free shape from which a load gives a known shape.
//!
//! The unknown is the stress-free position X of the nodes; all integrals run over the known, loaded
//! shape x. Source: Govindjee and Mihalic, Computational methods for inverse finite elastostatics,
//! Comput. Methods Appl. Mech. Eng. 136, 1996. With the same parent quadrature points the residual
//! equals the forward one on X, so the forward solution on X is x to rounding, if it is the one
//! that a forward solve finds.

use crate::element::Elements;
use crate::linear::{Lu, OutOfMemory};
use crate::material::{Deformation, NeoHookean};
use crate::model::{Folded, pairs};
use crate::newton::Halt;
use crate::pattern::Pattern;
use supine_space::{Matrix, Progress, Vector};

/// Steps are shortened at most so often.
const SHORTENINGS: usize = 12;
/// Iterations at one load.
const ITERATIONS: usize = 40;
/// Residual goal between load steps.
const STEP_GOAL: f64 = 1e-6;
/// Smallest load step.
const SMALLEST_STEP: f64 = 1.0 / 256.0;

/// The inverse problem of one body.
pub(crate) struct Inverse<'a, const N: usize, const Q: usize> {
    /// Elements on the loaded shape.
    pub(crate) loaded: &'a Elements<N, Q>,
    /// What the body is made of.
    pub(crate) material: NeoHookean,
    /// The load, kPa/mm per stress-free volume.
    pub(crate) force: Vector,
    /// Pattern of the unsymmetric derivative.
    pub(crate) pattern: &'a Pattern,
}

impl<const N: usize, const Q: usize> Inverse<'_, N, Q> {
    /// Residual forces (mN per node, held nodes included) at X = x + `y`, with `share` of the load.
    ///
    /// f = dX/dx, F = f^-1, j = det f, b = F Fᵀ, σ = j [μ (b − I) − λ ln j I],
    /// R_a = Σ_q w [σ g_a − j N_a force], g_a and w on the loaded shape.
    ///
    /// # Errors
    /// When an element of X is turned inside out.
    pub(crate) fn residual(&self, y: &[Vector], share: f64) -> Result<Vec<Vector>, Folded> {
        let mut residual = vec![Vector::zeros(); y.len()];
        for (e, nodes) in self.loaded.nodes.iter().enumerate() {
            for q in 0..Q {
                let point = self.point(e, q, y)?;
                let weight = self.loaded.weights[e][q];
                for (a, node) in nodes.iter().enumerate() {
                    let body = self.force * (share * point.j * self.loaded.values[q][a]);
                    residual[*node as usize] +=
                        (point.stress * self.loaded.gradients[e][q][a] - body) * weight;
                }
            }
        }
        Ok(residual)
    }

    /// Fills `values` with dR/dX.
    ///
    /// dR_a/dX_b = w [(σ g_a − j λ g_a − j N_a force) t_bᵀ − j μ ((g_a · b g_b) F + (b g_b) t_aᵀ)],
    /// t_a = Fᵀ g_a.
    ///
    /// # Errors
    /// When an element of X is turned inside out.
    pub(crate) fn derivative(
        &self,
        y: &[Vector],
        share: f64,
        values: &mut [f64],
    ) -> Result<(), Folded> {
        values.fill(0.0);
        let NeoHookean { mu, lambda } = self.material;
        for (e, nodes) in self.loaded.nodes.iter().enumerate() {
            let mut blocks = [[Matrix::zeros(); N]; N];
            for q in 0..Q {
                let Point { f, b, j, stress } = self.point(e, q, y)?;
                let weight = self.loaded.weights[e][q];
                let g = &self.loaded.gradients[e][q];
                let (t, bg) = (g.map(|g| f.tr_mul(&g)), g.map(|g| b * g));
                let left: [Vector; N] = std::array::from_fn(|a| {
                    let body = self.force * (share * j * self.loaded.values[q][a]);
                    (stress * g[a] - g[a] * (j * lambda) - body) * weight
                });
                let shear = weight * j * mu;
                for (a, c) in pairs::<N>(self.pattern, e) {
                    let block = &mut blocks[a][c];
                    *block += left[a] * t[c].transpose();
                    *block -= f * (shear * g[a].dot(&bg[c]));
                    *block -= bg[c] * (t[a] * shear).transpose();
                }
            }
            for (a, c) in pairs::<N>(self.pattern, e) {
                self.pattern.add(nodes, (e, a, c), &blocks[a][c], values);
            }
        }
        Ok(())
    }

    fn point(&self, e: usize, q: usize, y: &[Vector]) -> Result<Point, Folded> {
        let back = Deformation::new(self.loaded.gradient(e, q, y)).ok_or(Folded(e))?;
        let f = back.inverse_transpose.transpose();
        let b = f * f.transpose();
        let NeoHookean { mu, lambda } = self.material;
        let pressure = Matrix::identity() * (mu + lambda * back.ln_j);
        Ok(Point { f, b, j: back.j, stress: (b * mu - pressure) * back.j })
    }

    /// X − x (mm per node) at which the residual is at most `goal` of the load, and the number of
    /// iterations; `None` when no such shape was found.
    ///
    /// Newton from X = x under the whole load; only if that fails the load is followed in steps.
    ///
    /// # Errors
    /// When stopped or out of memory.
    pub(crate) fn solve(
        &self,
        nodes: usize,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<(Option<Vec<Vector>>, usize), Halt> {
        let mut solver = Solver { lu: Lu::new(self.pattern)?, iterations: 0 };
        let mut y = vec![Vector::zeros(); nodes];
        let (mut share, mut step) = (0.0, 1.0);
        while share < 1.0 {
            let next: f64 = if share + step > 1.0 - SMALLEST_STEP { 1.0 } else { share + step };
            let step_goal = if next < 1.0 { STEP_GOAL.max(goal) } else { goal };
            match solver.newton(self, &y, next, step_goal, progress.part(share, next))? {
                Some(found) => (y, share, step) = (found, next, 2.0 * step),
                None if step <= SMALLEST_STEP => return Ok((None, solver.iterations)),
                None => step *= 0.5,
            }
        }
        Ok((Some(y), solver.iterations))
    }
}

/// State of the loaded body at a quadrature point.
struct Point {
    /// F = dx/dX.
    f: Matrix,
    /// F Fᵀ.
    b: Matrix,
    /// det dX/dx.
    j: f64,
    /// Cauchy stress, kPa.
    stress: Matrix,
}

struct Solver {
    lu: Lu,
    iterations: usize,
}

impl Solver {
    fn newton<const N: usize, const Q: usize>(
        &mut self,
        problem: &Inverse<'_, N, Q>,
        start: &[Vector],
        share: f64,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Option<Vec<Vector>>, Halt> {
        let pattern = problem.pattern;
        let norm = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>().sqrt();
        let residual = |y: &[Vector]| problem.residual(y, share).ok().map(|r| pattern.gather(&r));
        let weight = norm(&pattern.gather(&body_forces(problem, start.len())));
        let mut y = start.to_vec();
        let Some(mut r) = residual(&y) else { return Ok(None) };
        let mut values = vec![0.0; pattern.entries()];
        for iteration in 0..ITERATIONS {
            if norm(&r) <= goal * weight {
                return Ok(Some(y));
            }
            progress.at(iteration as f64 / 10.0)?;
            self.iterations += 1;
            let Some(direction) = self.direction(problem, &y, share, &r, &mut values)? else {
                return Ok(None);
            };
            let mut t = 1.0;
            let mut found = None;
            for _ in 0..SHORTENINGS {
                let next: Vec<Vector> = y.iter().zip(&direction).map(|(y, d)| y + d * t).collect();
                if let Some(r_next) = residual(&next)
                    && norm(&r_next) < (1.0 - 1e-4 * t) * norm(&r)
                {
                    found = Some((next, r_next));
                    break;
                }
                t *= 0.5;
            }
            match found {
                Some(next) => (y, r) = next,
                None => return Ok(None),
            }
        }
        Ok(None)
    }

    fn direction<const N: usize, const Q: usize>(
        &mut self,
        problem: &Inverse<'_, N, Q>,
        y: &[Vector],
        share: f64,
        r: &[f64],
        values: &mut [f64],
    ) -> Result<Option<Vec<Vector>>, OutOfMemory> {
        if problem.derivative(y, share, values).is_err()
            || !self.lu.factorise(problem.pattern, values)?
        {
            return Ok(None);
        }
        let mut direction: Vec<f64> = r.iter().map(|r| -r).collect();
        let solved = self.lu.solve(&mut direction);
        Ok(solved.then(|| problem.pattern.scatter(&direction)))
    }
}

/// Nodal forces of the load on the loaded shape, mN: the scale of the residual.
fn body_forces<const N: usize, const Q: usize>(
    problem: &Inverse<'_, N, Q>,
    nodes: usize,
) -> Vec<Vector> {
    let mut forces = vec![Vector::zeros(); nodes];
    for (e, element) in problem.loaded.nodes.iter().enumerate() {
        for q in 0..Q {
            let weight = problem.loaded.weights[e][q];
            for (node, value) in element.iter().zip(problem.loaded.values[q]) {
                forces[*node as usize] += problem.force * (weight * value);
            }
        }
    }
    forces
}

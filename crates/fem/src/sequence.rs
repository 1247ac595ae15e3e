//! Solutions of one body one after the other.

use crate::discretisation::Discretisation;
use crate::either::{Either, either};
use crate::warm_start::WarmStart;
use crate::{Body, Error, Job, Load, Params, Solution, checked};
use supine_mesh::{Edges, Order};
use supine_space::{Progress, Vector};

/// Solutions of one body one after the other, each begun from those before.
///
/// What depends on neither modulus nor load is found once. A solution starts where those before,
/// found under the nearest gravity, make it expect by a polynomial in 1/E, and the factors of their
/// stiffness serve it too; where such a start leads to no equilibrium, the solution is begun cold
/// as by [`crate::solve`]. So it equals that of [`crate::solve`] to the tolerance whatever came
/// before, as long as the tissue has one equilibrium. Same calls in the same order, same bytes.
///
/// The unloaded shape depends on the modulus alone: it serves all targets. It counts only if the CT
/// shape is a stable equilibrium on it, but that a cold forward solve from it returns to the CT
/// shape is not tried: [`crate::Unloading::reload_error_mm`] is `None`. A result that counts is to
/// be checked by [`crate::solve`].
pub struct Sequence {
    body: Body,
    edges: Edges,
    ct: Vector,
    params: Params,
    solver: Either<Kept<4, 1>, Kept<10, 4>>,
}

/// What is kept from one solution to the next.
struct Kept<const N: usize, const Q: usize> {
    discretisation: Discretisation<N, Q>,
    before: WarmStart<N, Q>,
}

impl<const N: usize, const Q: usize> Kept<N, Q> {
    fn new(job: &Job<'_>) -> Result<Self, Error> {
        Ok(Self { discretisation: Discretisation::new(job)?, before: WarmStart::empty() })
    }
}

impl Sequence {
    /// Prepares solutions of `body`, which lay under `ct_gravity` (a unit vector, LPS) in the CT.
    ///
    /// # Errors
    /// As [`crate::solve`], for what does not depend on the load.
    pub fn new(body: &Body, ct_gravity: Vector, params: &Params) -> Result<Self, Error> {
        let load = &Load { ct: ct_gravity, target: ct_gravity };
        let edges = checked(body, load, params)?;
        let job = Job::new(body, &edges, load, params);
        let solver = match params.order {
            Order::Linear => Either::Linear(Kept::new(&job)?),
            Order::Quadratic => Either::Quadratic(Kept::new(&job)?),
        };
        Ok(Self { body: body.clone(), edges, ct: ct_gravity, params: *params, solver })
    }

    /// The deformation when gravity turns to `target` (a unit vector, LPS) and the mean modulus is
    /// `young_kpa`, the proportions of the moduli kept; with its derivative by that modulus if
    /// `slope` is set.
    ///
    /// # Errors
    /// As [`crate::solve`]; [`Error::Singular`] when a slope is asked for and the solution is not a
    /// stable one. No modulus is searched for at which there is an unloaded shape:
    /// [`Error::NoUnloadedShape`] names the lowest one that had one before, if any. After an error
    /// the sequence goes on.
    pub fn at(
        &mut self,
        young_kpa: f64,
        target: Vector,
        slope: bool,
        progress: Progress<'_>,
    ) -> Result<Solution, Error> {
        let load = &Load { ct: self.ct, target };
        load.check()?;
        self.body.with_mean(young_kpa).check()?;
        let stiffer = young_kpa / self.body.mean_young_kpa();
        let job = Job { stiffer, slope, ..Job::new(&self.body, &self.edges, load, &self.params) };
        let solved = either!(&mut self.solver, Kept { discretisation, before } => {
            job.run(discretisation, before, progress)
        })?;
        job.solution(solved)
    }
}

impl std::fmt::Debug for Sequence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sequence").field("ct", &self.ct).field("params", &self.params).finish()
    }
}

#[cfg(test)]
#[path = "sequence_tests.rs"]
mod tests;

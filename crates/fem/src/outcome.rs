//! What Newton's method ends in: an equilibrium, or why there is none.

use crate::analysis::OutOfMemory;
use supine_space::{Stopped, Vector};

/// An equilibrium.
#[derive(Clone, Debug)]
pub(crate) struct Equilibrium {
    /// Displacement of the nodes from the stress-free shape, mm.
    pub(crate) u: Vec<Vector>,
    /// Relative residual.
    pub(crate) residual: f64,
}

/// How a step went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Corrections made, or Newton iterations.
    pub corrections: usize,
    /// Estimate of the error left at the worst node, mm.
    pub error_mm: f64,
    /// Whether corrections did not suffice and Newton's method took over: this step took its time.
    pub by_newton: bool,
}

/// Why no equilibrium was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    /// The start is turned inside out.
    Start,
    /// Too many iterations.
    Iterations,
    /// No step along the direction lowers the energy.
    NoDescent,
    /// The shifted stiffness has no Cholesky factor.
    Singular,
}

/// Where Newton's method came to a halt without an equilibrium.
#[derive(Clone, Debug)]
pub(crate) struct NonConvergence {
    /// Why.
    pub(crate) cause: Cause,
    /// Relative residual.
    pub(crate) residual: f64,
    /// Displacement at the end, mm.
    pub(crate) u: Vec<Vector>,
    /// Share of the load up to which equilibria were found.
    pub(crate) load_share: f64,
}

/// No result.
#[derive(Clone, Debug)]
pub(crate) enum SolveError {
    /// The user stopped.
    Stopped(Stopped),
    /// Out of memory.
    Memory,
    /// No equilibrium found.
    NotConverged(NonConvergence),
}

impl From<Stopped> for SolveError {
    fn from(stopped: Stopped) -> Self {
        Self::Stopped(stopped)
    }
}

impl From<OutOfMemory> for SolveError {
    fn from(_: OutOfMemory) -> Self {
        Self::Memory
    }
}

impl Cause {
    /// What it means, and what to do.
    pub(crate) fn explain(self) -> (&'static str, &'static str) {
        match self {
            Self::Start => (
                "a tetrahedron is turned inside out at the start",
                "Mesh again with other tetrahedra",
            ),
            Self::Iterations => (
                "too many iterations",
                "The tissue may be too soft for this load: try a higher modulus, more iterations, \
                 or a mesh with better tetrahedra there",
            ),
            Self::NoDescent => (
                "no step lowers the energy",
                "The tissue may be too soft for this load, or the tolerance too small for this \
                 mesh: try a higher modulus, or a mesh with better tetrahedra there",
            ),
            Self::Singular => (
                "the stiffness is singular",
                "Part of the mesh may hang by a single point or edge: mesh again",
            ),
        }
    }
}

//! Where a mesh is to be finer.

use crate::Error;
use std::sync::Arc;
use supine_fem::{Body, Load, Tissue, error_shares};
use supine_space::{Progress, Sphere};
use supine_tetrahedralise::{Domain, Near, Refinement};

/// Most tetrahedra of the first mesh by which the lengths are found.
const FIRST: usize = 5000;

/// Where a mesh is to be finer than its boundary asks for.
#[derive(Clone, Debug, Default)]
pub enum Refine {
    /// Nowhere.
    #[default]
    Nowhere,
    /// In and around a place.
    Near(Near),
    /// Where the displacement of a place depends on it.
    Goal(Box<Goal>),
}

/// The displacement that is to be most accurate.
#[derive(Clone, Debug)]
pub struct Goal {
    /// The place, LPS, mm.
    pub place: Sphere,
    /// What moves.
    pub tissue: Tissue,
    /// Why.
    pub load: Load,
    /// How it is solved.
    pub solver: supine_fem::Params,
}

impl Refine {
    /// What the mesher has to know for a mesh of that many tetrahedra of this tissue.
    ///
    /// For a goal a first mesh is made and solved, and its tetrahedra are judged by what they add
    /// to the error there.
    ///
    /// # Errors
    /// As the mesher's and the solver's.
    pub(crate) fn of(
        &self,
        domain: &Domain,
        tetrahedra: usize,
        progress: Progress<'_>,
    ) -> Result<Refinement, Error> {
        match self {
            Self::Nowhere => Ok(Refinement::None),
            Self::Near(near) => Ok(Refinement::Near(*near)),
            Self::Goal(goal) => {
                let (first, _) = domain.mesh(tetrahedra.min(FIRST), progress.part(0.0, 0.6))?;
                let first = Arc::new(first);
                let Goal { place, tissue, load, solver } = goal.as_ref();
                let progress = progress.part(0.6, 1.0);
                let shares = error_shares(
                    &Body::new(Arc::clone(&first), *tissue),
                    load,
                    solver,
                    place,
                    progress,
                )?;
                Ok(Refinement::balanced(&first, &shares, solver.order)?)
            }
        }
    }
}

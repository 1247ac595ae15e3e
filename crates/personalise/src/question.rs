//! What is asked of the interval of the tumour's displacement.

use crate::modulus_prior::ModulusPrior;
use supine_fem::{Body, Load, Params};
use supine_mesh::{Deformation, Edges, Locator};
use supine_record::UncertainPatch;
use supine_space::{Point, Sphere, Vector};

/// What is asked.
#[derive(Clone, Copy)]
pub struct Question<'a> {
    /// What is deformed.
    pub body: &'a Body,
    /// The same tissue on a mesh that may be coarser: on it is solved how the displacement changes
    /// with modulus and rest state. The run's own displacement takes off what the curves of both
    /// states have too much or too little.
    pub coarse: &'a Body,
    /// Why.
    pub load: &'a Load,
    /// How it was solved, the rest state included.
    pub params: &'a Params,
    /// What was found.
    pub solved: &'a Deformation,
    /// The tumour in the CT, LPS, mm.
    pub tumour: Sphere,
    /// What is known of the modulus.
    pub prior: ModulusPrior,
    /// The error of the chest wall that 19 of 20 places like the one given (LPS, mm) do not exceed,
    /// mm.
    pub wall_error_mm: &'a (dyn Fn(&Point) -> f64 + Sync),
    /// Its uncertain places.
    pub patches: &'a [UncertainPatch],
    /// The body with each proportion of its tissues' moduli another one, by one standard deviation:
    /// independent of each other.
    pub tissues: &'a [Body],
}

impl std::fmt::Debug for Question<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Question({:?}, {:?})", self.tumour, self.prior)
    }
}

/// The displacement of the place nearest to a point, LPS, mm.
pub(crate) fn at_centre(solved: &Deformation, centre: &Point) -> Vector {
    let mesh = solved.mesh();
    let found = Locator::new(mesh.clone()).nearest(centre);
    solved.displacement().at(mesh, &Edges::new(mesh), found.tet, found.weights)
}

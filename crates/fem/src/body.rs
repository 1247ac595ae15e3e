//! What is deformed.

use crate::material::Material;
use crate::{Error, Tissue};
use std::sync::Arc;
use supine_mesh::{Displacement, TetMesh};

/// A meshed body and what it is made of. Copies share mesh, moduli and offsets.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its shape in the CT.
    pub mesh: Arc<TetMesh>,
    /// Its tissue; the modulus counts where `young_kpa` gives none.
    pub tissue: Tissue,
    /// Young's modulus of each tetrahedron, kPa, in place of that of `tissue`.
    pub young_kpa: Option<Arc<[f64]>>,
    /// How far the nodes of quadratic elements lie off the points and edge middles of `mesh`, mm:
    /// for elements that follow a curved surface. Linear elements stay straight. Results are given
    /// at the places of straight elements.
    pub curved: Option<Displacement>,
}

impl Body {
    /// A body of one tissue.
    pub fn new(mesh: Arc<TetMesh>, tissue: Tissue) -> Self {
        Self { mesh, tissue, young_kpa: None, curved: None }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] names the value and its range, [`Error::Moduli`] says that there are
    /// not as many moduli as tetrahedra.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.tissue.check()?;
        let Some(moduli) = &self.young_kpa else { return Ok(()) };
        if moduli.len() != self.mesh.tets().len() {
            return Err(Error::Moduli { moduli: moduli.len(), tets: self.mesh.tets().len() });
        }
        moduli.iter().try_for_each(|&young_kpa| Tissue { young_kpa, ..self.tissue }.check())
    }

    /// The law of each tetrahedron, its moduli taken `factor` times.
    pub(crate) fn materials(&self, factor: f64) -> Vec<Material> {
        let of = |young_kpa: f64| {
            Material::new(&Tissue { young_kpa: young_kpa * factor, ..self.tissue })
        };
        match &self.young_kpa {
            Some(moduli) => moduli.iter().map(|e| of(*e)).collect(),
            None => vec![of(self.tissue.young_kpa); self.mesh.tets().len()],
        }
    }

    /// The body with all its moduli taken as many times as makes this their mean over the volume,
    /// kPa.
    #[must_use]
    pub fn with_mean(&self, young_kpa: f64) -> Self {
        let factor = young_kpa / self.mean_young_kpa();
        let moduli = self.young_kpa.as_ref().map(|all| all.iter().map(|e| e * factor).collect());
        let tissue = Tissue { young_kpa: self.tissue.young_kpa * factor, ..self.tissue };
        Self { tissue, young_kpa: moduli, ..self.clone() }
    }

    /// Mean modulus over the volume, kPa.
    pub fn mean_young_kpa(&self) -> f64 {
        let Some(moduli) = &self.young_kpa else { return self.tissue.young_kpa };
        let (mut sum, mut whole) = (0.0, 0.0);
        for (t, e) in moduli.iter().enumerate() {
            let volume = self.mesh.volume(t);
            sum += e * volume;
            whole += volume;
        }
        sum / whole
    }
}

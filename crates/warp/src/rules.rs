//! What a resampling does with voxels, and how many were what.

use crate::filter::Interpolation;
use crate::kernel::Kernel;

/// What is done with voxels, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    /// Value of voxels that the tissue left.
    pub(crate) air_hu: i16,
    /// Voxels of the CT at or above this, outside mesh and collar, are not the collar's to change.
    pub(crate) body_hu: i16,
    pub(crate) kernel: Kernel,
    pub(crate) interpolation: Interpolation,
    /// Below this det F voxels are averages.
    pub(crate) supersample_below: f64,
}

/// How many voxels were what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    /// Sampled through the mesh.
    pub(crate) mesh: usize,
    /// Sampled through the collar.
    pub(crate) collar: usize,
    /// Turned to air.
    pub(crate) vacated: usize,
    /// Claimed by more than one tetrahedron of the mesh.
    pub(crate) folded: usize,
}

impl std::ops::Add for Counts {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            mesh: self.mesh + other.mesh,
            collar: self.collar + other.collar,
            vacated: self.vacated + other.vacated,
            folded: self.folded + other.folded,
        }
    }
}

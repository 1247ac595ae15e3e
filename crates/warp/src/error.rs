//! What can go wrong.

use supine_mesh::{DisplacementError, SurfaceError};
use supine_space::{Failure, Stopped};

/// Why a volume, field or list of points could not be warped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A displacement is not one of the mesh at hand.
    #[error(transparent)]
    Displacement(#[from] DisplacementError),
    /// An axis of the volume has a single voxel: nothing can be interpolated along it.
    #[error("the volume has {size:?} voxels; interpolation needs 2 or more along each axis")]
    Thin {
        /// Voxels along i, j, k.
        size: [usize; 3],
    },
    /// The volume has more voxels than can be addressed.
    #[error(
        "the volume has {size:?} voxels; at most 8192 along i and j, and 2147483647 in all, can be carried"
    )]
    Large {
        /// Voxels along i, j, k.
        size: [usize; 3],
    },
    /// A parameter is outside its range.
    #[error("the warp parameter {name} is {value:.3}; it must be {need}")]
    Parameter {
        /// Name of the field of `Params`.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        need: &'static str,
    },
    /// Fields that belong together lie on several grids.
    #[error("the fields of a map must lie on one grid")]
    Grids,
    /// A part of a grid lies beyond it.
    #[error(transparent)]
    Grid(#[from] supine_space::GridError),
    /// Values do not fill a grid.
    #[error(transparent)]
    Volume(#[from] supine_volume::VolumeError),
    /// The contours enclose nothing, or lie across the slices.
    #[error("the structure cannot be carried: {0}")]
    Contours(#[from] supine_volume::ContourError),
    /// A carried surface bounds nothing: it collapsed, or its contours do.
    #[error("the carried surface cannot be used: {0}")]
    Surface(#[from] SurfaceError),
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Displacement(error) => error.kind(),
            Self::Thin { .. }
            | Self::Large { .. }
            | Self::Parameter { .. }
            | Self::Grids
            | Self::Grid(_)
            | Self::Volume(_)
            | Self::Contours(_) => Failure::Input,
            // The surfaces that are given are closed: what a map made of one is the method's doing.
            Self::Surface(_) => Failure::Method,
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

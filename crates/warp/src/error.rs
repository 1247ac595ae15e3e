//! What can go wrong.

use supine_mesh::{DisplacementError, SurfaceError};
use supine_space::Stopped;

/// Why a volume, field or list of points could not be warped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The displacement belongs to another mesh.
    #[error("the displacement belongs to another mesh: {0}")]
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
    #[error("the warp parameter {name} is {value}; it must be {need}")]
    Parameter {
        /// Name of the field of `Params`.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        need: &'static str,
    },
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

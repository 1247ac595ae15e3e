//! Why no mesh can be made.

use supine_mesh::{DisplacementError, MeshError};
use supine_space::{Failure, GridError, Stopped};
use supine_volume::VolumeError;

/// Why no mesh can be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// Fewer tetrahedra were asked for than the shape needs.
    #[error("{asked} tetrahedra are too few for this region; ask for {min} or more")]
    TooFew {
        /// Tetrahedra asked for.
        asked: usize,
        /// The smallest number found that works.
        min: usize,
    },
    /// A mesh is coarsened to fewer tetrahedra only.
    #[error("the mesh has {has} tetrahedra; {asked} are not fewer: ask for a smaller number")]
    NotCoarser {
        /// Tetrahedra asked for.
        asked: usize,
        /// Tetrahedra of the mesh.
        has: usize,
    },
    /// More tetrahedra were asked for than can be numbered and held.
    #[error("{asked} tetrahedra are too many; ask for {max} or fewer")]
    TooMany {
        /// Tetrahedra asked for.
        asked: usize,
        /// The largest number.
        max: usize,
    },
    /// The refined place leaves too few tetrahedra for the rest.
    #[error(
        "{asked} tetrahedra are too few for edges so short at the place to be refined; ask for {needed} or \
         more, or for longer edges or faster growth there"
    )]
    TooFine {
        /// Tetrahedra asked for.
        asked: usize,
        /// A number that should do.
        needed: usize,
    },
    /// A setting is out of its range.
    #[error("the mesh setting {name} = {value:.3} must be {range}")]
    Setting {
        /// Name of the field of `Params`.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// A label value that means nothing here.
    #[error("the label map holds the value {label} at voxel {voxel:?}; labels are 0 to 9")]
    UnknownLabel {
        /// The value.
        label: u8,
        /// Where it stands first.
        voxel: [usize; 3],
    },
    /// No soft tissue is left that is thick enough to be meshed.
    #[error(
        "the region holds no soft tissue that is thicker than {thickness_mm:.1} mm; check the \
         labels or move the region"
    )]
    NothingToMesh {
        /// Least thickness that is meshed, mm.
        thickness_mm: f64,
    },
    /// Neither the asked number nor a larger one could be reached.
    #[error(
        "the mesh of this region came to {reached} tetrahedra where {asked} were asked for, and no \
         number tried up to {tried} could be met; look at the labels in the region or move it"
    )]
    Count {
        /// Tetrahedra asked for.
        asked: usize,
        /// Tetrahedra reached.
        reached: usize,
        /// The largest number tried.
        tried: usize,
    },
    /// The piece at the sphere's centre is asked for, and there is none.
    #[error("no soft tissue lies at the centre of the region: move it, or take the largest piece")]
    NotAtCentre,
    /// The region's sphere lies beside the label map.
    #[error("the region lies beside the label map; move it")]
    Beside,
    /// The part of the label map around the region cannot be taken.
    #[error("the label map cannot be cropped to the region: {0}")]
    Crop(#[from] GridError),
    /// The part of the label map around the region cannot be filled.
    #[error("the label map cannot be cropped to the region: {0}")]
    Fill(#[from] VolumeError),
    /// The surfaces it is to be made of cannot be used.
    #[error(transparent)]
    Solid(#[from] SolidError),
    /// The surfaces give no curved shape.
    #[error("the curved sides of the mesh make no sense, please report this with the labels: {0}")]
    Curved(#[from] DisplacementError),
    /// The result is not a mesh.
    #[error("the mesher made a broken mesh, please report this with the labels: {0}")]
    Broken(#[from] MeshError),
}

impl Error {
    /// The kind of failure: surfaces that cannot be used are input, all else is a failure of the
    /// method.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Stopped(_) => Failure::Stopped,
            Self::Solid(_) => Failure::Input,
            _ => Failure::Method,
        }
    }
}

/// Why surfaces of skin and chest wall cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolidError {
    /// The numbers are too small for mm.
    #[error(
        "the surface of the {which} is only {extent:.3} mm large, the region's radius {radius:.1} mm: is \
         it in {unit}? give it in mm"
    )]
    Units {
        /// `skin` or `chest wall`.
        which: &'static str,
        /// Largest side of its box, mm.
        extent: f64,
        /// Radius of the sphere, mm.
        radius: f64,
        /// A unit that would fit.
        unit: &'static str,
    },
    /// The surface lies beside the sphere.
    #[error(
        "the surface of the {which} does not reach into the region: it ends {missing:.1} mm before \
         it{advice}"
    )]
    Beside {
        /// `skin` or `chest wall`.
        which: &'static str,
        /// Distance of its box from the sphere, mm.
        missing: f64,
        /// What may be wrong.
        advice: &'static str,
    },
    /// Chest wall and soft tissue do not meet.
    #[error(
        "within the region the chest wall touches no soft tissue: is it of the same patient and frame, \
         and is the gap between both narrower than {gap_mm:.3} mm?"
    )]
    Apart {
        /// The widest gap that is closed, mm.
        gap_mm: f64,
    },
}

impl SolidError {
    /// The kind of failure: the surfaces cannot be used.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

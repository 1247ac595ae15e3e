//! Voxel volumes on a grid in patient space: CT, labels, seeds, distances, components, contours.
//!
//! Knows no file, no mesh and no anatomy beyond the names of the labels.

mod components;
mod contours;
mod distance;
mod region;
mod sample;
mod seeds;
mod signed_distance;
mod smooth;
mod surfaces;
mod volume;

pub mod label;

pub use components::{Components, components};
pub use contours::{ContourError, Filled, fill_contours};
pub use distance::distance_mm;
pub use region::{Region, RegionError};
pub use sample::{sample_trilinear, sample_trilinear_at};
pub use seeds::{SeedKind, Seeds};
pub use signed_distance::SignedDistance;
pub use smooth::gaussian;
pub use surfaces::Surfaces;
pub use volume::{Volume, VolumeError};

/// CT in Hounsfield units after rescale.
pub type Ct = Volume<i16>;
/// One label of [`label`] per voxel.
pub type LabelMap = Volume<u8>;

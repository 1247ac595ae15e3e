//! Voxel volumes on a grid in patient space: CT, labels, seeds, distances, components, contours.
//!
//! Knows no file, no mesh and no anatomy beyond the names of the labels.

mod components;
mod contours;
mod distance;
mod enclosed;
mod field;
mod isosurface;
mod outlines;
mod plane;
mod quantile;
mod region;
mod sample;
mod seeds;
mod signed_distance;
mod smooth;
mod stroke;
mod surfaces;
mod volume;

pub mod label;

pub use components::{Components, Parts, Run, components};
pub use contours::{
    Beyond, ContourError, Filled, MARGIN_MM, Overlap, fill_contours, held_by, widest_bridged_mm,
};
pub use distance::distance_mm;
pub use enclosed::{Enclosed, Stray, Undrawn, enclosed, overlap, stray, undrawn};
pub use field::Field;
pub use isosurface::{Layers, isosurface};
pub use outlines::{Outlines, Rule};
pub use plane::{contour, sample_plane};
pub use quantile::{Ordered, median, quantile, ranked};
pub use region::{Region, RegionError, largest_radius};
pub use sample::{Cell, sample_trilinear, sample_trilinear_at, sample_vector};
pub use seeds::{SeedKind, Seeds};
pub use signed_distance::SignedDistance;
pub use smooth::{gaussian, gaussian_rows, gaussian_slice, slice_kernel, weigh};
pub use stroke::Stroke;
pub use surfaces::Surfaces;
pub use volume::{Ct, LabelMap, Volume, VolumeError};

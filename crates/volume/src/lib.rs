//! Voxel volumes on a grid in patient space: CT, labels, seeds, distances, components, contours.
//!
//! Knows no file, no mesh and no anatomy beyond the names of the labels.
//!
//! # Example
//!
//! ```
//! use supine_space::{Grid, Matrix, Point, Vector};
//! use supine_volume::{Ct, Volume, sample_trilinear_at};
//!
//! # fn main() -> Result<(), supine_space::GridError> {
//! let grid = Grid::new([8, 8, 8], Vector::repeat(2.0), Point::origin(), Matrix::identity())?;
//! // Fat at the right, gland at the left.
//! let ct: Ct = Volume::from_fn(grid, |[i, _, _]| if i < 4 { -100 } else { 40 });
//! let between = Point::new(7.0, 6.0, 6.0);
//! assert_eq!(sample_trilinear_at(&ct, &between), -30.0);
//! # Ok(())
//! # }
//! ```

mod components;
mod contours;
mod distance;
mod enclosed;
mod field;
mod isosurface;
mod joined;
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
    Beyond, ByPlane, ContourError, Filled, MARGIN_MM, Overlap, SAME_PLANE_MM, contours_by_plane,
    fill_contours, held_by, widest_bridged_mm,
};
pub use distance::distance_mm;
pub use enclosed::{Enclosed, Stray, Undrawn, enclosed, overlap, stray, undrawn};
pub use field::Field;
pub use isosurface::{Layers, isosurface};
pub use joined::joined;
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

//! Labels in a sphere to a tagged tetrahedral mesh of an asked size.
//!
//! The way: smooth level functions of skin and chest wall from the uncropped labels and the
//! analytic sphere (`fields`); a lattice cut by them (`start`); coarsening and rounds of split,
//! collapse, swap and smooth (`remesh`); the exact count (`count`); fitting the boundary in the
//! mean (`fit`); betterment without change of the count. Knows no files and no mechanics.
//!
//! All work is done in the mesher's frame: millimetres along the voxel grid's axes from the
//! sphere's centre. The result is in LPS, mm.
//!
//! ```
//! use std::sync::Arc;
//! use supine_space::{Grid, Matrix, Point, Progress, Sphere, Vector};
//! use supine_tetrahedralise::{Params, tetrahedralise};
//! use supine_volume::{Region, Volume, label};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Soft tissue 45 mm thick in front of chest wall; y points to the back.
//! let origin = Point::new(-60.0, -80.0, -60.0);
//! let grid = Grid::new([41, 41, 41], Vector::repeat(3.0), origin, Matrix::identity())?;
//! let labels = Volume::from_fn(grid.clone(), |voxel| match grid.centre(voxel).y {
//!     y if y < -45.0 => label::OUTSIDE,
//!     y if y < 0.0 => label::SOFT_TISSUE,
//!     _ => label::CHEST_WALL,
//! });
//! let region = Region::new(Arc::new(labels), Sphere::new(Point::new(0.0, -20.0, 0.0), 40.0)?)?;
//! let params = Params { tetrahedra: 600, ..Params::default() };
//! let (mesh, _) = tetrahedralise(&region, &params, Progress::none())?;
//! assert_eq!(mesh.tets().len(), 600);
//! # Ok(())
//! # }
//! ```

mod balance;
mod base_length;
mod boundary;
#[cfg(test)]
mod carry_tests;
mod coarsen;
mod collapse;
mod complex;
mod count;
mod curved;
mod deviation;
mod domain;
mod error;
mod exactly;
mod faces;
#[cfg(test)]
mod faults;
mod fields;
mod finish;
mod fit;
mod folds;
mod follow;
mod frame;
#[cfg(test)]
mod fuzz_tests;
mod info;
mod labels;
mod levels;
mod mesher;
#[cfg(test)]
mod operation_tests;
mod params;
mod patches;
#[cfg(test)]
mod peer_tests;
mod peers;
mod refinement;
#[cfg(test)]
mod refinement_tests;
#[cfg(test)]
mod region_tests;
mod remesh;
mod rims;
mod samples;
mod shape;
mod sizing;
mod smooth;
mod solids;
#[cfg(test)]
mod solids_tests;
mod split;
mod start;
#[cfg(test)]
mod surface_tests;
mod swap;
#[cfg(test)]
mod tests;
mod winding;

pub use coarsen::coarsen;
pub use deviation::Deviation;
pub use domain::Domain;
pub use error::{Error, SolidError};
pub use info::Info;
pub use params::{Params, Piece};
pub use peers::Shell;
pub use refinement::{Near, Refinement};
pub use solids::Solids;
pub use supine_record::Curved;

use supine_mesh::TetMesh;
use supine_space::Progress;
use supine_volume::Region;

/// Meshes the soft tissue inside the region's sphere with the asked number of tetrahedra:
/// [`Domain::new`] and [`Domain::mesh`] in a row.
///
/// # Errors
/// As these two.
pub fn tetrahedralise(
    region: &Region,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(TetMesh, Info), Error> {
    let domain = Domain::new(region, params, progress.part(0.0, 0.2))?;
    domain.mesh(params.tetrahedra, progress.part(0.2, 1.0))
}

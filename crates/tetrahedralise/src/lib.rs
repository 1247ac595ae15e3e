//! Labels in a sphere to a tagged tetrahedral mesh of an asked size.
//!
//! The way: smooth level functions of skin and chest wall from the uncropped labels and the
//! analytic sphere (`fields`); a lattice cut by them (`start`); coarsening and rounds of split,
//! collapse, swap and smooth (`remesh`); the exact count (`count`); fitting the boundary in the
//! mean (`fit`); betterment without change of the count. Knows no files and no mechanics.
//!
//! All work is done in the mesher's frame: millimetres along the voxel grid's axes from the
//! sphere's centre. The result is in LPS, mm.

mod balance;
mod boundary;
#[cfg(test)]
mod carry_tests;
mod coarsen;
mod collapse;
mod complex;
mod count;
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
#[cfg(test)]
mod fuzz_tests;
mod info;
mod labels;
mod levels;
mod mesher;
#[cfg(test)]
mod operation_tests;
mod patches;
#[cfg(test)]
mod peer_tests;
mod refinement;
#[cfg(test)]
mod refinement_tests;
#[cfg(test)]
mod region_tests;
mod remesh;
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

pub use domain::{Curving, Domain, Shell};
pub use error::Error;
pub use info::{Deviation, Info};
pub use refinement::{Near, Refinement};
pub use solids::{SolidError, Solids};

use supine_mesh::TetMesh;
use supine_space::Progress;
use supine_volume::Region;

/// Settings of the mesher.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Tetrahedra asked for.
    pub tetrahedra: usize,
    /// Standard deviation of the Gaussian that smooths the labels where their surfaces are not
    /// known between the voxels, mm; never below 0.9 of the largest voxel spacing. Labels rougher
    /// than voxels of a smooth shape are smoothed more widely, up to twice.
    pub smoothing_mm: f64,
    /// Standard deviation of the Gaussian that smooths the distances to known surfaces, mm.
    pub surface_smoothing_mm: f64,
    /// Growth of the edge length with depth below the boundary, mm per mm.
    pub growth: f64,
    /// Largest edge length inside, in units of that at the boundary; 1 or more.
    pub growth_limit: f64,
    /// Edge length on the rims in units of that on the surfaces; above 0, at most 1.
    pub rim_refinement: f64,
    /// Soft tissue between chest wall and skin that is thinner than this counts as chest wall,
    /// mm: wedges end in a face of this height with the tag of the chest wall.
    pub least_thickness_mm: f64,
    /// Which piece is meshed when there are several.
    pub piece: Piece,
}

/// Which of several separate pieces of soft tissue in the region is meshed; the others are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Piece {
    /// The largest.
    #[default]
    Largest,
    /// The one that holds the sphere's centre.
    Centre,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            tetrahedra: 5000,
            smoothing_mm: 1.9,
            surface_smoothing_mm: 1.0,
            growth: 0.4,
            growth_limit: 1.7,
            rim_refinement: 0.58,
            least_thickness_mm: 1.0,
            piece: Piece::Largest,
        }
    }
}

/// More than this are not numbered.
const MOST: usize = 5_000_000;

/// Meshes the soft tissue inside the region's sphere with the asked number of tetrahedra:
/// [`Domain::new`] and [`Domain::mesh`] in a row.
///
/// # Errors
/// As these two.
pub fn tetrahedralise(
    region: &Region<'_>,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(TetMesh, Info), Error> {
    let domain = Domain::new(region, params, progress.part(0.0, 0.2))?;
    domain.mesh(params.tetrahedra, progress.part(0.2, 1.0))
}

fn check(params: &Params) -> Result<(), Error> {
    let settings = [
        ("smoothing_mm", params.smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("surface_smoothing_mm", params.surface_smoothing_mm, 0.0..=20.0, "0 to 20"),
        ("growth", params.growth, 0.0..=2.0, "0 to 2"),
        ("growth_limit", params.growth_limit, 1.0..=5.0, "1 to 5"),
        ("rim_refinement", params.rim_refinement, 0.2..=1.0, "0.2 to 1"),
        ("least_thickness_mm", params.least_thickness_mm, 0.1..=10.0, "0.1 to 10"),
    ];
    for (name, value, allowed, range) in settings {
        if !allowed.contains(&value) {
            return Err(Error::Setting { name, value, range });
        }
    }
    Ok(())
}

//! CT to labels: the patient's soft tissue and her chest wall as one rigid body.
//!
//! No machine learning: the body without table, gown and wire (`body`); bones and the axis of the
//! thorax (`bones`); a shell through the outer edges of the ribs (`shell`); the levels of fat
//! and muscle in this scan (`levels`); and outside the shell the surface that leaves muscle
//! inside and gland outside (`wall`). Both surfaces are one radius per ray from the axis, found
//! by semi-global aggregation (`aggregate`). The user's seeds bind that surface (`seeds`).
//!
//! Numbers: docs/SEGMENTATION.md describes the method step by step, with what was measured when it
//! was built, on the fixture, three synthetic patients and the real CT breast-flt013 with contours.
//! Constants that name no source were chosen, not measured; that the whole works with them is
//! measured in docs/VERIFICATION.md, "Segmentation".
//!
//! ```
//! use supine_segment::tumour_place;
//! use supine_space::{Grid, Matrix, Point, Side, Sphere, Vector};
//! use supine_volume::{Ct, Volume};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let origin = Point::new(-195.0, -145.0, -45.0);
//! let grid = Grid::new([40, 30, 10], Vector::repeat(10.0), origin, Matrix::identity())?;
//! // A body of 300 mm by 200 mm in air.
//! let inside = |p: Point| (p.x / 150.0).powi(2) + (p.y / 100.0).powi(2) < 1.0;
//! let ct: Ct = Volume::from_fn(grid.clone(), |v| if inside(grid.centre(v)) { 40 } else { -1000 });
//! let tumour = Sphere::new(Point::new(60.0, -20.0, 0.0), 8.0)?;
//! assert_eq!(tumour_place(&ct, tumour, Some(Side::Left))?.side, Some(Side::Left));
//! assert!(tumour_place(&ct, tumour, Some(Side::Right)).is_err());
//! # Ok(())
//! # }
//! ```

mod aggregate;
mod band;
mod below_ribs;
mod body;
mod bones;
mod breast;
mod confidence;
mod contents;
mod denoise;
mod devices;
mod error;
mod find_body;
mod foreign;
mod frame;
mod free_border;
mod front;
mod histogram;
mod hounsfield;
mod implant;
mod inclusions;
mod info;
mod labels_error;
mod levels;
mod lung_hull;
mod muscle;
mod nipple;
mod noise;
mod orientation;
mod other_side;
mod paint;
mod pairs;
mod params;
mod pieces;
mod plane;
mod posture;
mod radial_map;
mod region_check;
mod rib_evidence;
mod scan;
mod seeds;
mod segmentation;
mod segmenter;
mod shape_mismatch;
mod shell;
mod slice_tissue;
mod smoothing;
mod spikes;
mod supplied;
mod tissues;
mod tubes;
mod tumour;
mod tumour_place;
mod uncertainty;
mod wall;
mod wall_costs;
mod weights;
mod whole_chest;

#[cfg(test)]
mod tests;

pub use body::Device;
pub use breast::Breast;
pub use confidence::PER_MM as UNCERTAINTY_PER_MM;
pub use error::Error;
pub use info::Info;
pub use labels_error::LabelsError;
pub use nipple::Nipple;
pub use params::Params;
pub use region_check::{BreastPlace, RegionCheck, check_region};
pub use seeds::check_seeds_lie_in;
pub use segmentation::Segmentation;
pub use segmenter::Segmenter;
pub use supine_record::QualityCheck;
pub use supine_volume::{SeedKind, Seeds};
pub use supplied::take_labels;
pub use tissues::{TissueInfo, TissueShare, tissue_shares, tissues};
pub use tumour_place::{TumourPlace, TumourPlaceError, tumour_place};
pub use uncertainty::{UNCERTAIN_MM, wall_uncertainty};
pub use weights::Weights;

use std::sync::Arc;
use supine_space::Progress;
use supine_volume::{Ct, Field};

/// Soft tissue and chest wall of a supine chest CT that does not say what was measured:
/// [`Field::found`], [`Segmenter::new`] and [`Segmenter::segment`] in a row; the segmenter gives
/// their surfaces and their uncertainty too.
///
/// The slices (k) must be within 20 degrees of axial; their rows and columns may run in any
/// direction. Values are HU; padding may have any value below -1024. Do not crop the CT before.
///
/// # Errors
/// As the segmenter's.
pub fn segment(
    ct: Arc<Ct>,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Segmentation, Info), Error> {
    let field = Field::found(&ct);
    let segmenter = Segmenter::new(ct, &field, params, progress.part(0.0, 0.85))?;
    segmenter.segment(&params.seeds, progress.part(0.85, 1.0))
}

//! CT to labels: the patient's soft tissue and her chest wall as one rigid body.
//!
//! No machine learning: the body without table, gown and wire (`body`); bones and the axis of the
//! thorax (`bones`); a shell through the outer edges of the ribs (`shell`); the levels of fat
//! and muscle in this scan (`levels`); and outside the shell the surface that leaves muscle
//! inside and gland outside (`wall`). Both surfaces are one radius per ray from the axis, found
//! by semi-global aggregation (`aggregate`). The user's seeds bind that surface (`seeds`).

mod aggregate;
mod below_ribs;
mod body;
mod bones;
mod breast;
mod brought;
mod confidence;
mod doubt;
mod error;
mod foreign;
mod frame;
mod front;
mod gate;
mod gates;
mod hounsfield;
mod implant;
mod info;
mod levels;
mod muscle;
mod nipple;
mod paint;
mod params;
mod parts;
mod plane;
mod posture;
mod scan;
mod seeds;
mod segmenter;
mod sheet;
mod shell;
mod spikes;
mod tissues;
mod tumour;
mod wall;

#[cfg(test)]
mod tests;

pub use breast::Breast;
pub use brought::{LabelsError, take_labels};
pub use doubt::{DOUBTFUL_MM, Doubt, Patch, doubt};
pub use error::Error;
pub use gate::{Bound, Gate};
pub use gates::{RegionCheck, check_region};
pub use info::Info;
pub use nipple::Nipple;
pub use params::Params;
pub use segmenter::Segmenter;
pub use supine_volume::{SeedKind, Seeds};
pub use tissues::{TissueInfo, TissueShare, tissue_shares, tissues};

use supine_space::Progress;
use supine_volume::{Ct, LabelMap};

/// What [`segment`] makes.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// [`supine_volume::label::OUTSIDE`], [`supine_volume::label::SOFT_TISSUE`] and
    /// [`supine_volume::label::CHEST_WALL`], which includes lungs, bones and all else within, on the
    /// grid of the CT.
    pub labels: LabelMap,
    /// Outer surface of the chest wall, radius in mm per ray.
    outline: sheet::Sheet,
    /// Its error that 9 of 10 such places do not exceed, mm.
    error: sheet::Sheet,
    levels: levels::Levels,
}

/// Soft tissue and chest wall of a supine chest CT: [`Segmenter::new`] and
/// [`Segmenter::segment`] in a row; the segmenter gives their surfaces and the doubt about them too.
///
/// The slices (k) must be within 20 degrees of axial; their rows and columns may run in any
/// direction. Values are HU; padding may have any value below -1024. Do not crop the CT before.
///
/// # Errors
/// As these two.
pub fn segment(
    ct: &Ct,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Segmentation, Info), Error> {
    let segmenter = Segmenter::new(ct, params, progress.part(0.0, 0.85))?;
    segmenter.segment(&params.seeds, progress.part(0.85, 1.0))
}

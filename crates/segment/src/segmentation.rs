//! What a segmentation is.

use crate::levels::Levels;
use crate::radial_map::RadialMap;
use std::sync::Arc;
use supine_volume::LabelMap;

/// Labels with what is known of their boundary; cheap to clone.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// [`supine_volume::label::OUTSIDE`], [`supine_volume::label::SOFT_TISSUE`] and
    /// [`supine_volume::label::CHEST_WALL`], which includes lungs, bones and all else within, on
    /// the grid of the CT.
    pub labels: Arc<LabelMap>,
    /// Outer surface of the chest wall, radius in mm per ray.
    pub(crate) outline: RadialMap,
    /// Its error that 19 of 20 such places do not exceed, mm.
    pub(crate) error: RadialMap,
    pub(crate) levels: Levels,
}

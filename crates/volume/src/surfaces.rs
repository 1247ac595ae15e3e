//! The surfaces between the tissues.

use crate::SignedDistance;

/// Skin and chest wall of a label map, known between its voxels, on its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Surfaces {
    /// Negative inside the patient: where the label is not [`crate::label::OUTSIDE`].
    pub skin: SignedDistance,
    /// Negative inside the chest wall: where [`crate::label::is_chest_wall`] holds.
    pub chest_wall: SignedDistance,
}

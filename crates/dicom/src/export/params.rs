//! What an export says about itself.

use crate::clock::Clock;
use crate::policy::Policy;
use supine_space::Side;

/// What an export says about itself.
#[derive(Clone, Debug)]
pub struct ExportParams {
    /// Series Description; must contain DEFORMED, 64 characters at most.
    pub series_description: String,
    /// How the volume was made: Derivation Description, 1024 characters at most.
    pub derivation: String,
    /// Image Comments, 10240 characters at most.
    pub image_comments: String,
    /// Side of the breast, for Laterality.
    pub laterality: Side,
    /// Date and time written everywhere "now" is meant.
    pub clock: Clock,
    /// Version of this software, 64 characters at most.
    pub software_version: String,
    /// Hash of everything that made the volume; goes into the UIDs with the pixel data.
    pub identity: [u8; 32],
    /// Farthest that the content of a voxel came from along the slice normal, mm: each slice names
    /// the source slices within this distance and one step. Infinite names all.
    pub reach_mm: f64,
    /// Departures from what is safest.
    pub policy: Policy,
}

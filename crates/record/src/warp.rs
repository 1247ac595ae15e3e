//! What became of the CT in the operating position.

use crate::Consistency;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Result of the warp.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Warp {
    /// Width over which the displacement faded at the cut, mm.
    pub fade_mm: f64,
    /// Voxels whose value was taken from another place of the CT.
    pub moved_voxels: usize,
    /// Voxels the soft tissue left, now air.
    pub vacated_voxels: usize,
    /// Voxels where the map folds (det J not above 0): 0 in a sound result.
    pub folded_voxels: usize,
    /// det J of the map from the CT to the operating position over the moved voxels: the local
    /// change of volume, 1 for none.
    pub jacobian: Jacobian,
    /// How well the two fields of the run undo each other; `None` when nothing moves, and absent in
    /// summaries of older versions.
    #[serde(default)]
    pub forward_then_backward: Option<Consistency>,
    /// Metal and other dense things outside the chest wall.
    #[serde(default)]
    pub dense: Vec<DenseThing>,
}

/// Something dense outside the chest wall: a clip, a wire, a coarse calcification, a clasp.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct DenseThing {
    /// Its middle in the CT, LPS, mm.
    pub before_mm: [f64; 3],
    /// Its middle in the operating position, LPS, mm.
    pub after_mm: [f64; 3],
    /// Voxels of at least 300 HU.
    pub voxels: usize,
    /// Its volume, mm³.
    pub volume_mm3: f64,
    /// Its largest value, HU.
    pub peak_hu: i16,
    /// What became of it.
    pub fate: DenseFate,
}

/// What became of a dense thing.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum DenseFate {
    /// It moved as a whole, every value as scanned.
    Whole,
    /// It is too large for that: it deformed with the tissue.
    Deformed,
    /// It lies where nothing moves.
    Still,
    /// It lies outside the body, a wire or a clasp on the skin: it stayed where it was, as scanned.
    OutsideBody,
}

/// Distribution of the Jacobian determinant.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Jacobian {
    /// Smallest.
    pub min: f64,
    /// First percentile.
    pub p01: f64,
    /// Mean.
    pub mean: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

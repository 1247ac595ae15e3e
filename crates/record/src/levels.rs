//! What tissues measure in the CT.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// By what fat, gland and tumour were told from each other.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
pub struct TissueLevels {
    /// Commonest value of the fat, HU.
    pub fat_hu: f64,
    /// Median of the gland where it is thick, HU; `None` where none is.
    pub gland_hu: Option<f64>,
    /// Whether the tumour was grown from its centre; else it is the sphere of the case.
    pub tumour_grown: bool,
}

//! What the user must know.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What the user must know before trusting the result.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Warning {
    /// The stage that says it: `import`, `segment`, `mesh`, `solve`, `warp`, `export`, ...
    pub stage: String,
    /// The kind of warning, for programs: lower-case words joined by `-`, the same for every
    /// occurrence.
    #[serde(default)]
    pub code: String,
    /// What it says.
    pub message: String,
    /// What to do about it.
    #[serde(default)]
    pub advice: String,
    /// What was measured, by names with their units (`mm`, `area_cm2`, `voxels`); absent when there
    /// is nothing.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub values: BTreeMap<String, f64>,
    /// The place that it is about, LPS, mm in the CT; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place_mm: Option<[f64; 3]>,
    /// Whether the planner has ticked it as looked at; absent when not.
    #[serde(default, skip_serializing_if = "is_not")]
    pub seen: bool,
}

/// Whether a switch is off, and so not written.
pub(crate) fn is_not(on: &bool) -> bool {
    !*on
}

//! What makes the tumour's displacement uncertain.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where what is known of the modulus comes from.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum ModulusOrigin {
    /// Moduli of other patients.
    Literature,
    /// An interval that was given.
    Given,
    /// Scans of the patient.
    Scans,
}

impl ModulusOrigin {
    /// Name in summaries and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Literature => "literature",
            Self::Given => "given",
            Self::Scans => "scans",
        }
    }
}

/// What makes the displacement uncertain.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum UncertaintySource {
    /// Young's modulus.
    Modulus,
    /// The moduli of the tissues in proportion to each other.
    Tissues,
    /// The rest state.
    RestState,
    /// The place of the chest wall.
    ChestWall,
    /// The tissue beyond the sphere that bounds the region.
    Region,
    /// The mesh.
    Mesh,
    /// How the tissue resists beyond its modulus, and how it hangs on the chest wall.
    Law,
    /// Arms that lie otherwise than in the CT.
    Arms,
    /// Breath.
    Breath,
}

/// What one source of uncertainty does while the others stay as in the run.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct UncertaintyShare {
    /// The source.
    pub source: UncertaintySource,
    /// Interval of the displacement's length, mm.
    pub length_mm: [f64; 2],
    /// The tumour's place lies within this distance of the place given, mm.
    pub within_mm: f64,
}

impl UncertaintyShare {
    /// Width of its interval, mm.
    pub fn width_mm(&self) -> f64 {
        self.length_mm[1] - self.length_mm[0]
    }
}

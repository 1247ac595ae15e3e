//! How sure the chest wall is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How sure the boundary between chest wall and soft tissue is within the region.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct WallUncertainty {
    /// Its area, cm².
    pub boundary_cm2: f64,
    /// The area that may be wrong by more than `limit_mm`, cm².
    pub uncertain_cm2: f64,
    /// The boundary is called uncertain where it may be wrong by more than this, mm.
    pub limit_mm: f64,
    /// The uncertain places, the largest first.
    pub patches: Vec<UncertainPatch>,
}

impl WallUncertainty {
    /// Share of the boundary that is uncertain, 0..=1.
    pub fn share(&self) -> f64 {
        if self.boundary_cm2 > 0.0 { self.uncertain_cm2 / self.boundary_cm2 } else { 0.0 }
    }

    /// The uncertain places, what moves the tumour most first.
    pub fn ranked(&self) -> Vec<&UncertainPatch> {
        let effect = |patch: &UncertainPatch| patch.effect_mm.unwrap_or(0.0);
        let mut ranked: Vec<_> = self.patches.iter().collect();
        ranked.sort_by(|a, b| effect(b).total_cmp(&effect(a)));
        ranked
    }
}

/// A connected part of the boundary that is uncertain.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct UncertainPatch {
    /// Area, cm².
    pub area_cm2: f64,
    /// Its middle, LPS, mm.
    pub centre_mm: [f64; 3],
    /// The error that 19 of 20 such places do not exceed, mm.
    pub error_mm: f64,
    /// Where it lies, as in `upper outer quadrant`.
    pub place: String,
    /// How far the tumour's displacement changes when the wall is off by that error there, mm;
    /// `None` when it is not known.
    pub effect_mm: Option<f64>,
    /// Pairs of seeds on both sides of the boundary as it was found, for a planner to move to where
    /// it is: in the chest wall, then in the soft tissue, LPS, mm. All together make the place
    /// sure.
    pub seeds_mm: Vec<[[f64; 3]; 2]>,
}

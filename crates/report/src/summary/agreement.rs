//! What a registration would be judged by (AAPM TG-132), of the movement here.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Measures of the AAPM's Task Group 132 (Brock et al., Med Phys 44:e43-e76, 2017) that apply to a
/// simulated deformation. Landmarks and second contours there are none: of them nothing is said.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Longest side of a voxel of the CT, mm: the tolerance of the report.
    pub voxel_mm: f64,
    /// Between the skin of the moved mesh and that of the moved CT; `None` when no skin was
    /// simulated.
    pub skin: Option<SkinAgreement>,
}

/// Distance between two skins along the normal.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct SkinAgreement {
    /// Places on the mesh's skin that were measured.
    pub places: usize,
    /// Places without a skin in the CT within 5 mm; the distances are those of the others.
    pub lost: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// 95 % lie below this, mm.
    pub p95_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
}

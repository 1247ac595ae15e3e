//! What acts on the boundary of the tissue, where it is asked for.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A part of the chest wall on which the tissue slides: that nearer to its middle than `radius_mm`.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct SlidingArea {
    /// Its middle, LPS, mm; absent: the point of the wall below the middle of the breast.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 3]>,
    /// Radius, mm.
    pub radius_mm: f64,
    /// Width of the rim over which the tissue is held more and more, mm.
    pub rim_mm: f64,
    /// Shear traction per displacement within the rim, kPa/mm; 0: without friction. A layer of
    /// shear modulus G and thickness h has G/h.
    pub stiffness_kpa_mm: f64,
}

/// Skin as an incompressible membrane on the tissue.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct Membrane {
    /// Thickness, mm.
    pub thickness_mm: f64,
    /// Young's modulus at small strain, kPa.
    pub young_kpa: f64,
    /// How far it is stretched in its plane where the tissue is free of stress; 1: not at all.
    pub stretch: f64,
}

//! How far what was made lies from what it follows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How far from where it began a voxel of the CT comes out that goes forward by one field and back
/// by the other, sampled between its voxels.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct Consistency {
    /// Voxels that count: those in the mesh that move to where all voxels around are of the mesh.
    pub voxels: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// 99 % lie below this, mm.
    pub p99_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
}

/// Nodes that lie off the straight mesh so that elements follow skin and chest wall.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
pub struct Curved {
    /// How many.
    pub nodes: usize,
    /// Those that do not reach their surface, for the sake of an element.
    pub shortened: usize,
    /// Their mean distance from the straight mesh, mm.
    pub mean_mm: f64,
    /// The largest, mm.
    pub max_mm: f64,
}

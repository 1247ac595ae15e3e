//! How far what was made lies from what it follows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How far a voxel comes out from where it should: of two fields, going forward by one and back by
/// the other, sampled between their voxels; of a registration, what a reader finds between its
/// vectors against the map.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
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

/// Signed distances of a scan's points from a surface, positive outside.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq)]
pub struct SkinDistances {
    /// Points.
    pub points: usize,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Root mean square, mm.
    pub rms_mm: f64,
    /// What 95 % of their sizes do not exceed, mm.
    pub p95_mm: f64,
    /// The largest size, mm.
    pub max_mm: f64,
}

/// Distances of the faces of a mesh from the surface that they follow.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct SurfaceDistance {
    /// Mean distance over the area, mm.
    pub mean_mm: f64,
    /// Distance that 95 % of the area keep within, mm.
    pub p95_mm: f64,
    /// Largest distance, mm.
    pub max_mm: f64,
}

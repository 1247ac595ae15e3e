//! How the displacement was found.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Result of the mechanics.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, Default, PartialEq)]
pub struct Solve {
    /// Newton iterations over all load steps.
    pub iterations: usize,
    /// Iterations in which the tangent stiffness was not positive definite.
    pub indefinite: usize,
    /// Load steps: 1 when the full load was reached at once.
    pub load_steps: usize,
    /// Residual at the end, relative to the load.
    pub residual: f64,
    /// Smallest det F over all integration points, against the tissue's shape without load.
    pub min_det_f: f64,
    /// Middle of the tetrahedron with it, in the CT, LPS, mm.
    pub min_det_f_mm: [f64; 3],
    /// Largest det F over all integration points, against the tissue's shape without load.
    pub max_det_f: f64,
    /// Largest displacement of a node, mm.
    pub max_displacement_mm: f64,
    /// Mean stiffness of the springs on the cut, kPa/mm; absent without springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spring_kpa_mm: Option<f64>,
    /// Where the tissue slides on the chest wall; absent where it is held.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sliding: Option<Slid>,
    /// Of a stress-free shape that was searched: how far the CT shape is missed when gravity acts
    /// on it again, largest distance of a node, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reload_error_mm: Option<f64>,
}

/// A chest wall on which the tissue slid.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct Slid {
    /// Middle of the area in the CT, LPS, mm.
    pub centre_mm: [f64; 3],
    /// The longest way of a node of it, mm.
    pub most_mm: f64,
}

//! A scan on the operating table held against the result.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use supine_record::SkinDistances;

/// How far a scan of the patient on the operating table lies off the skin of the CT and of models.
/// Its pose comes from the torso beside the breasts. Distances of skin are not the error of the
/// tumour: skin that slides, and what happens below it, is not seen.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// The skin of the CT as it lies (`ct`), of the default tissue where that is not the run's
    /// (`default`), and of the run (`run`).
    pub surfaces: Vec<EvaluatedSurface>,
    /// The point of the run's skin nearest to the tumour, LPS, mm.
    pub near_mm: [f64; 3],
    /// What lies this near to it counts as near the tumour, mm.
    pub near_radius_mm: f64,
    /// Residuals of the torso, which the pose rests on, mm rms.
    pub torso_mm: f64,
    /// Pose of the scan: rows of the matrix that takes its coordinates, mm, to those of the
    /// patient.
    pub patient_from_scan: [[f64; 4]; 4],
}

/// How far the scan lies off one surface.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct EvaluatedSurface {
    /// `ct`, `default` or `run`.
    pub name: String,
    /// Near the tumour.
    pub near: SkinDistances,
    /// On the whole breast, less 12 mm along the edge of the model.
    pub breast: SkinDistances,
}

impl Evaluation {
    /// What a surface is, in words.
    pub fn words(name: &str) -> &'static str {
        match name {
            "ct" => "CT, not deformed",
            "default" => "default tissue",
            _ => "this result",
        }
    }
}

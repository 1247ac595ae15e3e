//! What is told of the movement: the warp, volumes, points.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use supine_record::Jacobian;

/// How the volume of a structure changes.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct VolumeChange {
    /// The structure: what is simulated, the tumour's sphere, or a finer label by its name.
    pub structure: String,
    /// Volume in the CT of what lies in the mesh, ml.
    pub before_ml: f64,
    /// The same tissue on the operating table, ml.
    pub after_ml: f64,
    /// det F over its volume in the CT; the mean is the ratio of the volumes.
    pub jacobian: Jacobian,
    /// Where in the CT det F is smallest, LPS, mm.
    pub min_mm: [f64; 3],
    /// Where in the CT det F is largest, LPS, mm.
    pub max_mm: [f64; 3],
    /// The classes of `shares` go as far below and above det F = 1, alike for all structures.
    pub span: f64,
    /// Share of the volume in 40 classes of det F, equally wide; the outermost hold all beyond.
    pub shares: Vec<f64>,
}

/// A point of the body in the CT and on the operating table.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Movement {
    /// In the CT, LPS, mm.
    pub before_mm: [f64; 3],
    /// On the operating table, LPS, mm.
    pub after_mm: [f64; 3],
    /// `after - before`, LPS, mm.
    pub displacement_mm: [f64; 3],
    /// Length of the displacement, mm.
    pub distance_mm: f64,
}

impl Movement {
    /// The movement of a point from `before_mm` to `after_mm`, LPS, mm.
    pub fn new(before_mm: [f64; 3], after_mm: [f64; 3]) -> Self {
        let displacement_mm = std::array::from_fn(|a| after_mm[a] - before_mm[a]);
        let distance_mm = displacement_mm.iter().map(|d: &f64| d * d).sum::<f64>().sqrt();
        Self { before_mm, after_mm, displacement_mm, distance_mm }
    }
}

/// A point that was carried along.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct CarriedPoint {
    /// Its name in the file it came from.
    pub name: String,
    /// In the CT, LPS, mm.
    pub before_mm: [f64; 3],
    /// On the operating table, LPS, mm.
    pub after_mm: [f64; 3],
    /// Whether it lies in the mesh; outside, nothing is known to move and `after` is `before`.
    pub inside: bool,
}

/// A dose, a structure set or a segmentation of the patient's own that was carried along.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct CarriedObject {
    /// `dose`, `structures` or `segmentation`.
    pub kind: String,
    /// The object that was written, below the run's folder.
    pub file: String,
    /// Its SOP Instance UID.
    pub instance_uid: String,
    /// Of a dose: its largest value before and after, Gy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_gy: Option<[f64; 2]>,
    /// Of a dose: the energy imparted before and after, mJ, by 1 + HU / 1000 g/ml.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy_mj: Option<[f64; 2]>,
    /// Of structures and segments: all that have a volume, in the order of the file.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub regions: Vec<CarriedRegion>,
}

/// A region of interest or segment that was carried along.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct CarriedRegion {
    /// Its name, as it was written.
    pub name: String,
    /// Volume in the CT, ml.
    pub before_ml: f64,
    /// Volume on the operating table, ml.
    pub after_ml: f64,
}

/// The cumulative dose-volume histogram of a structure before and after.
///
/// The dose is the planned one, carried with the tissue: not computed anew on the deformed anatomy.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct DoseVolumeHistogram {
    /// The file of the dose, as in `carried`.
    pub dose: String,
    /// The file of the structures, as in `carried`.
    pub structures: String,
    /// Name of the structure.
    pub region: String,
    /// From one share of the curves to the next, Gy.
    pub step_gy: f64,
    /// The planned dose in the structure of the CT.
    pub before: DoseVolumeCurve,
    /// The carried dose in the carried structure.
    pub after: DoseVolumeCurve,
}

/// Dose within a structure.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct DoseVolumeCurve {
    /// Volume of the structure, ml.
    pub volume_ml: f64,
    /// Share of it beyond the grid of the dose, taken as 0 Gy, 0 to 1.
    pub beyond: f64,
    /// Mean dose, Gy.
    pub mean_gy: f64,
    /// Least dose to the 98 % of the volume that receive most, Gy.
    pub d98_gy: f64,
    /// Median dose, Gy.
    pub d50_gy: f64,
    /// Least dose to the 2 % of the volume that receive most, Gy.
    pub d2_gy: f64,
    /// Largest dose, Gy.
    pub max_gy: f64,
    /// Share of the volume that receives at least 0, 1, 2, ... steps, 0 to 1.
    pub shares: Vec<f64>,
}

/// Of a structure of which more lies beyond the grid of the dose no dose is told: what is counted
/// as 0 Gy there is not known. Chosen: less than half of the 2 % that D98 leaves out, and what
/// rounding at the rim of a grid amounts to.
const MOST_BEYOND: f64 = 0.005;

impl DoseVolumeHistogram {
    /// The larger share of the structure that lies beyond the grid of the dose, where that is too
    /// much for its doses to be told.
    pub fn outside(&self) -> Option<f64> {
        let share = self.before.beyond.max(self.after.beyond);
        (share > MOST_BEYOND).then_some(share)
    }
}

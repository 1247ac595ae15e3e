//! What a scan tells of the tissue.

use crate::RestState;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The modulus that fits best in one rest state. A modulus belongs to its rest state: those of two
/// are not to be compared.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct StateFit {
    /// That state.
    pub rest: RestState,
    /// Young's modulus, kPa; the mean over the mesh where it differs from tissue to tissue.
    pub young_kpa: f64,
    /// The interval that holds it with 95 % probability if the model describes the breast, kPa.
    pub interval_kpa: [f64; 2],
    /// Standard deviation of its logarithm.
    pub deviation: f64,
    /// What that is made of.
    pub parts: DeviationParts,
    /// How far the patient leaned back in the scan beyond what is said of her, degrees; negative:
    /// forward. Fitted with the modulus, within 4 degrees taken for likely.
    pub lean_deg: f64,
    /// Distance of the scan from the model's skin on the breast, mm rms.
    pub misfit_mm: f64,
    /// The part of it that is alike at points 3 mm apart, mm rms: what the model leaves, without
    /// the noise of single points.
    #[serde(default)]
    pub structured_mm: f64,
    /// Where a piece of the breast's skin lies farthest from the scan; absent in fits of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub farthest: Option<OffPlace>,
    /// Moduli of the tissues in proportion to that of fat, where they were fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tissues: Option<FittedTissues>,
    /// The objective in the best pose of the scan that is another one, over that in the best;
    /// absent when one pose was followed, or all became one. Near 1 the pose is open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_pose: Option<f64>,
    /// Pose of the scan: rows of the matrix that takes its coordinates, mm, to those of the
    /// patient.
    pub patient_from_scan: [[f64; 4]; 4],
    /// The moduli that were tried, from stiff to soft.
    pub path: Vec<FitStep>,
    /// Why no softer modulus was tried; absent when the fit had become worse.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
}

/// A piece of skin, 25 mm wide, that lies off a scan.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct OffPlace {
    /// Its middle in the fitted pose, LPS, mm.
    pub place_mm: [f64; 3],
    /// How far the scan lies outside of the model's skin there, mean, mm; negative: inside.
    pub off_mm: f64,
}

/// Structured residuals above which the law does not describe the breast, mm rms: 0.27 to 0.34 on
/// synthetic patients whose law was the program's, 0.58 and more where it was not.
pub const STRUCTURED_MM: f64 = 0.45;

/// A modulus that was tried.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct FitStep {
    /// Young's modulus, kPa.
    pub young_kpa: f64,
    /// Mean robust loss of the scan's points with it, mm².
    pub objective_mm2: f64,
}

/// Standard deviations of the modulus's logarithm, independent of each other.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct DeviationParts {
    /// By the scan: noise, holes, which patches of skin it shows.
    pub scan: f64,
    /// By how upright the patient sat.
    pub posture: f64,
    /// By the moduli of the tissues in proportion to each other, where they were fitted.
    pub tissues: f64,
    /// By the mesh and the weights of the fit.
    pub mesh: f64,
    /// By where the chest wall lies.
    pub wall: f64,
    /// By tissue that one modulus does not describe.
    pub misfit: f64,
}

impl DeviationParts {
    /// All of them together.
    pub fn whole(&self) -> f64 {
        self.all().iter().map(|part| part * part).sum::<f64>().sqrt()
    }

    /// Scan, posture, tissues, mesh, wall, misfit.
    pub fn all(&self) -> [f64; 6] {
        [self.scan, self.posture, self.tissues, self.mesh, self.wall, self.misfit]
    }
}

/// Young's moduli of tissues over that of fat.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct FittedTissues {
    /// Of gland.
    pub gland: f64,
    /// The interval that holds it with 95 % probability.
    pub gland_interval: [f64; 2],
    /// Of skin.
    pub skin: f64,
    /// The interval that holds it with 95 % probability.
    pub skin_interval: [f64; 2],
    /// Of the tumour; not fitted.
    pub tumour: f64,
    /// Standard deviations of the logarithms of gland's, skin's and the tumour's.
    pub deviations: [f64; 3],
}

/// Standard deviations on each side of the median that hold 95 %.
const NORMAL_95: f64 = 1.96;

/// The interval that holds a value with 95 % probability whose logarithm is normally distributed,
/// from its median and the logarithm's standard deviation.
pub fn interval_95(median: f64, deviation: f64) -> [f64; 2] {
    [-NORMAL_95, NORMAL_95].map(|side| median * (side * deviation).exp())
}

impl FittedTissues {
    /// Moduli of gland, skin and tumour over that of fat, and the standard deviations of their
    /// logarithms.
    pub fn new([gland, skin, tumour]: [f64; 3], deviations: [f64; 3]) -> Self {
        let gland_interval = interval_95(gland, deviations[0]);
        let skin_interval = interval_95(skin, deviations[1]);
        Self { gland, gland_interval, skin, skin_interval, tumour, deviations }
    }

    /// Fat, gland, skin, tumour.
    pub fn proportions(&self) -> [f64; 4] {
        [1.0, self.gland, self.skin, self.tumour]
    }
}

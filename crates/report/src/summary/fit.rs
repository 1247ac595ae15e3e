//! The tissue that was fitted to scans.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use supine_record::RestState;

/// Young's modulus by a scan of the sitting patient.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct TissueFit {
    /// The rest states that were fitted, one at least, the one that the run goes on with first.
    #[serde(deserialize_with = "some")]
    pub states: Vec<StateFit>,
    /// Whether the scan tells the rest state, or the case named it.
    pub decided: bool,
    /// N ln(S'/S): S the squares of the breast's residuals in the first and the second state, N of
    /// them independent; above 10 it decides. Absent when the case named the rest state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<f64>,
    /// One modulus for all tissues beside those of the case; absent when the case has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub one_modulus: Option<OneModulus>,
    /// The scan of the lying patient on the skin of the CT; absent without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supine: Option<ScanFit>,
}

/// A list that is not empty.
fn some<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<StateFit>, D::Error> {
    let states = Vec::deserialize(from)?;
    match states.is_empty() {
        true => Err(serde::de::Error::custom("a fit has one rest state at least")),
        false => Ok(states),
    }
}

/// One modulus for all tissues, fitted to the same scan in the rest state that the run goes on
/// with.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct OneModulus {
    /// Young's modulus, kPa.
    pub young_kpa: f64,
    /// Distance of the scan from the model's skin on the breast, mm rms.
    pub misfit_mm: f64,
    /// N ln(S'/S), S the squares of the breast's residuals with one modulus, S' with those by
    /// tissue: above 10 the scan speaks for one modulus, below -10 for those by tissue.
    pub evidence: f64,
}

impl TissueFit {
    /// What the run goes on with.
    ///
    /// # Panics
    /// Without any state: neither a fit nor a file that is read gives none.
    pub fn best(&self) -> &StateFit {
        &self.states[0]
    }
}

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
    /// How far the patient leaned back in the scan, degrees; negative: forward. Fitted with the
    /// modulus, upright within 4 degrees taken for likely.
    pub lean_deg: f64,
    /// Distance of the scan from the model's skin on the breast, mm rms.
    pub misfit_mm: f64,
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
    /// Scan, posture, tissues, mesh, wall, misfit.
    pub(crate) fn all(&self) -> [f64; 6] {
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

impl FittedTissues {
    /// Fat, gland, skin, tumour.
    pub fn proportions(&self) -> [f64; 4] {
        [1.0, self.gland, self.skin, self.tumour]
    }
}

/// A modulus that was tried.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct FitStep {
    /// Young's modulus, kPa.
    pub young_kpa: f64,
    /// Mean robust loss of the scan's points with it, mm².
    pub objective_mm2: f64,
}

/// A scan on the skin of the CT.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct ScanFit {
    /// Distance of its points from the skin within the region, mm rms.
    pub rms_mm: f64,
    /// How many times as large as the skin of the CT it is.
    pub scale: f64,
    /// Pose of the scan: rows of the matrix that takes its coordinates, mm, to those of the
    /// patient.
    pub patient_from_scan: [[f64; 4]; 4],
}

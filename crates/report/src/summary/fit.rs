//! The tissue that was fitted to scans.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};
use supine_record::{Addition, LawFit, StateFit};

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
    /// Laws of the tissue that were held against the scan, that of the run first; empty where the
    /// case names one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub laws: Vec<LawFit>,
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
    /// What the run's law has by the scan beyond plain tissue.
    pub fn additions(&self) -> &[Addition] {
        self.laws.first().map_or(&[], |law| &law.additions)
    }

    /// What the run goes on with.
    ///
    /// # Panics
    /// Without any state: neither a fit nor a file that is read gives none.
    pub fn best(&self) -> &StateFit {
        &self.states[0]
    }
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

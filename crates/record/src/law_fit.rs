//! Laws of the tissue that were held against a scan.

use crate::{Membrane, RestState, SlidingArea};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What tissue or its boundary has beyond neo-Hookean tissue that is held on the chest wall.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
#[serde(rename_all = "snake_case")]
pub enum Addition {
    /// It stiffens exponentially: the parameter of the law `exponential`.
    Stiffening(f64),
    /// Fibres from the chest wall to the skin, of so many times its modulus.
    Fibres(f64),
    /// It slides on the chest wall.
    Sliding(SlidingArea),
    /// The skin is a membrane on it.
    Skin(Membrane),
    /// Gland and skin have moduli of their own.
    Tissues,
}

impl Addition {
    /// In words, in place of a full sentence.
    pub fn words(&self) -> String {
        match self {
            Self::Stiffening(by) => format!("stiffens exponentially ({by})"),
            Self::Fibres(ratio) => format!("fibres of {ratio} times its modulus"),
            Self::Sliding(area) => format!(
                "slides on the chest wall ({} kPa/mm within {} mm)",
                area.stiffness_kpa_mm, area.radius_mm
            ),
            Self::Skin(skin) => format!("a skin of {} kPa", skin.young_kpa),
            Self::Tissues => "gland and skin with moduli of their own".into(),
        }
    }
}

/// A law that was fitted to a scan on a coarse mesh: its modulus is for comparison.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct LawFit {
    /// What it has; empty: plain tissue.
    pub additions: Vec<Addition>,
    /// What is taken as stress-free.
    pub rest: RestState,
    /// Young's modulus that fits best, kPa.
    pub young_kpa: f64,
    /// Distance of the scan from the model's skin on the breast, mm rms.
    pub misfit_mm: f64,
    /// The same of the scan on the table, where there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table_mm: Option<f64>,
    /// N ln(S/S'), S the squares of the breast's residuals with this law and S' those with the law
    /// that fits best, N of them independent, summed over both scans where there are two: above 10
    /// they speak against it.
    pub against: f64,
    /// Its probability among all that were tried.
    pub probability: f64,
}

impl LawFit {
    /// In words.
    pub fn words(&self) -> String {
        match self.additions.as_slice() {
            [] => "neo-Hookean, held on the chest wall".into(),
            some => some.iter().map(Addition::words).collect::<Vec<_>>().join(", "),
        }
    }
}

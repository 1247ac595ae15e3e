//! How sure the displacement of the tumour is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use supine_record::{ModulusOrigin, RestState, UncertaintyShare};

/// How far the tumour moves with the stated probability, when modulus, rest state, chest wall,
/// region and mesh are as uncertain as they are known to be.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct TumourInterval {
    /// Probability with which each interval and the ellipsoid hold the truth: 0.95.
    pub level: f64,
    /// The tumour's true place lies within this distance of the place given, mm.
    pub within_mm: f64,
    /// The length of the displacement, mm.
    pub length_mm: [f64; 2],
    /// Each component of the displacement, LPS, mm.
    pub components_mm: [[f64; 2]; 3],
    /// The tumour's centre on the operating table lies in this ellipsoid.
    pub ellipsoid: Ellipsoid,
    /// What is known of the modulus.
    pub modulus: ModulusKnown,
    /// The tumour with the same modulus in the other rest state; absent when the modulus was given
    /// with its rest state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub other_rest: Option<OtherRest>,
    /// What each source of uncertainty does alone, the widest first.
    pub shares: Vec<UncertaintyShare>,
}

/// An ellipsoid of places.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Its centre, LPS, mm.
    pub centre_mm: [f64; 3],
    /// Its semi-axes, LPS, mm, the longest first.
    pub semi_axes_mm: [[f64; 3]; 3],
}

/// What is known of Young's modulus: its logarithm is normally distributed.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct ModulusKnown {
    /// The interval that holds it with the stated probability, kPa; of the mean modulus where it
    /// differs from tissue to tissue.
    pub young_kpa: [f64; 2],
    /// The modulus that is as often exceeded as not, kPa.
    pub median_kpa: f64,
    /// Where that comes from.
    pub origin: ModulusOrigin,
    /// The softest modulus with a usable unloaded shape, of those tried, kPa: softer tissue is no
    /// possibility in that state. Absent when that state was not asked for or has no usable shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub softest_unloaded_kpa: Option<f64>,
}

/// The tumour in the other rest state, with the same modulus, or with the one that was fitted
/// there.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct OtherRest {
    /// That state.
    pub rest: RestState,
    /// Its displacement, LPS, mm; `None` where that state has no usable shape at this modulus.
    pub displacement_mm: Option<[f64; 3]>,
}

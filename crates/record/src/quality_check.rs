//! A measured figure beside the limits it is judged by.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A figure that the whole case was judged by, and how near a warning or refusal it was.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct QualityCheck {
    /// What was measured.
    pub what: Cow<'static, str>,
    /// Its unit.
    pub unit: Cow<'static, str>,
    /// The figure.
    pub value: f64,
    /// Whether the limits are maxima (or minima).
    pub at_most: bool,
    /// Beyond it there is a warning; `None` when the figure alone never warns.
    pub warns: Option<f64>,
    /// Beyond it the case is refused; `None` when the figure alone never refuses.
    pub refuses: Option<f64>,
    /// Whether it refuses only together with another figure marked so.
    pub jointly: bool,
}

impl QualityCheck {
    /// A figure that should not exceed its limits.
    pub fn at_most(what: &'static str, value: f64, unit: &'static str) -> Self {
        let (what, unit) = (what.into(), unit.into());
        Self { what, unit, value, at_most: true, warns: None, refuses: None, jointly: false }
    }

    /// A figure that should not fall below its limits.
    pub fn at_least(what: &'static str, value: f64, unit: &'static str) -> Self {
        Self { at_most: false, ..Self::at_most(what, value, unit) }
    }

    /// The same with a limit beyond which there is a warning.
    #[must_use]
    pub fn warns(self, limit: f64) -> Self {
        Self { warns: Some(limit), ..self }
    }

    /// The same with a limit beyond which the case is refused.
    #[must_use]
    pub fn refuses(self, limit: f64) -> Self {
        Self { refuses: Some(limit), ..self }
    }

    /// The same with a limit beyond which the case is refused when another figure is beyond such a
    /// limit too.
    #[must_use]
    pub fn refuses_jointly(self, limit: f64) -> Self {
        Self { jointly: true, ..self.refuses(limit) }
    }
}

//! A measured figure beside the limits it is judged by.

/// A figure that a whole case is judged by, with its limits: how near a warning or refusal was.
#[derive(Clone, Debug, PartialEq)]
pub struct QualityCheck {
    /// What was measured.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// The figure.
    pub value: f64,
    /// Which side of the limits is sound.
    pub bound: Bound,
    /// Beyond it the user is warned; `None` when the figure alone never warns.
    pub warns: Option<f64>,
    /// Beyond it the case is refused; `None` when the figure alone never refuses.
    pub refuses: Option<f64>,
    /// Whether it refuses only when another figure marked so lies beyond its limit too.
    pub jointly: bool,
}

/// Which side of a limit is sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// The figure should not exceed its limits.
    AtMost,
    /// The figure should not fall below its limits.
    AtLeast,
}

impl QualityCheck {
    /// A figure that should not exceed its limits.
    pub(crate) fn at_most(what: &'static str, value: f64, unit: &'static str) -> Self {
        Self { what, unit, value, bound: Bound::AtMost, warns: None, refuses: None, jointly: false }
    }

    /// A figure that should not fall below its limits.
    pub(crate) fn at_least(what: &'static str, value: f64, unit: &'static str) -> Self {
        Self { bound: Bound::AtLeast, ..Self::at_most(what, value, unit) }
    }

    pub(crate) fn warns(self, limit: f64) -> Self {
        Self { warns: Some(limit), ..self }
    }

    pub(crate) fn refuses(self, limit: f64) -> Self {
        Self { refuses: Some(limit), ..self }
    }

    pub(crate) fn refuses_jointly(self, limit: f64) -> Self {
        Self { jointly: true, ..self.refuses(limit) }
    }
}

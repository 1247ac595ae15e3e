//! Whether a result may be used.

use crate::words::{capital, fixed};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use supine_record::DoseTolerance;

/// Whether a result may be used, and why.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// That of the worst reason; green without any.
    pub colour: Colour,
    /// How far off the tumour's place may be, with the interval's probability, for green, mm.
    pub tolerance_mm: f64,
    /// Where that was asked as dose, what was asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dose: Option<DoseTolerance>,
    /// Why: red before amber, and of each what moves the tumour most first.
    pub reasons: Vec<Reason>,
}

impl Verdict {
    /// The verdict in a word, for programs. Checks that failed make it red.
    pub fn status(&self) -> Status {
        if self.colour == Colour::Red { Status::NotUsable } else { Status::Done }
    }
}

/// Whether a run left what may be used.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It did: the verdict is green or amber, and all checks passed.
    Done,
    /// It did not: the verdict is red.
    NotUsable,
}

/// The colour of a verdict or a reason.
#[derive(
    Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord,
)]
#[serde(rename_all = "lowercase")]
pub enum Colour {
    /// The tumour's place is known within the tolerance, and nothing was found that speaks against
    /// the result.
    #[default]
    Green,
    /// To be looked at before use.
    Amber,
    /// Not to be used.
    Red,
}

/// A reason of a verdict.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Debug, PartialEq)]
pub struct Reason {
    /// How bad it is.
    pub colour: Colour,
    /// Its kind, for programs.
    pub code: String,
    /// What it says.
    pub message: String,
    /// How far it may move the tumour's place, mm, where that is known.
    pub effect_mm: Option<f64>,
    /// Where to look in the CT, LPS, mm, where there is one place.
    pub place_mm: Option<[f64; 3]>,
    /// Whether the planner has ticked it as looked at; absent when not.
    #[serde(default, skip_serializing_if = "super::is_not")]
    pub seen: bool,
}

impl Reason {
    /// What it says, after what it is worth at the tumour.
    pub fn told(&self) -> String {
        let effect = self.effect_mm.map_or(String::new(), |mm| format!("{} mm: ", fixed(mm, 1)));
        let seen = if self.seen { " (ticked as looked at)" } else { "" };
        effect + &capital(&self.message) + seen
    }
}

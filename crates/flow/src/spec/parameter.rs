//! What a row of the table of parameters says.

use super::case::Case;
use serde_json::Value as Json;

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// `true` or `false`.
    Switch,
    /// A number between two others, both allowed.
    Number {
        /// The smallest.
        min: f64,
        /// The largest.
        max: f64,
    },
    /// A whole number between two others, both allowed.
    Whole {
        /// The smallest.
        min: u64,
        /// The largest.
        max: u64,
    },
    /// One of some words.
    Choice(&'static [&'static str]),
    /// A text without meaning here.
    Text,
    /// A position, LPS, mm.
    Point,
    /// Positions, LPS, mm.
    Points,
    /// Strokes of a brush: tissue, radius in mm, and positions, LPS, mm.
    Strokes,
    /// Two ascending numbers within a range.
    Interval {
        /// The smallest.
        min: f64,
        /// The largest.
        max: f64,
    },
    /// A file or folder.
    File,
    /// Files or folders.
    Files,
    /// Names of regions in a file.
    Names,
}

/// The modulus that a tissue may have, kPa: the range of [`supine_fem::Tissue::check`].
pub(super) const MODULUS: Kind = Kind::Number { min: 0.001, max: 1e6 };
/// Degrees.
pub(super) const TILT: Kind = Kind::Number { min: -180.0, max: 180.0 };
/// How far a patient may lean back who sits, degrees: farther she lies.
pub(super) const LEAN: Kind = Kind::Number { min: -30.0, max: 60.0 };
/// Radii of spheres within a patient, mm.
pub(super) const RADIUS: Kind = Kind::Number { min: 0.1, max: 500.0 };
/// Beyond these radii of a tumour that is operated, mm, a diameter or a typing error is likelier.
pub(super) const TUMOUR_RADIUS: Kind = Kind::Number { min: 0.5, max: 50.0 };

/// A parameter.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Its key in the case file: `table.key` or `key`.
    pub key: &'static str,
    /// What its value may be.
    pub kind: Kind,
    /// Unit of its numbers; empty without one.
    pub unit: &'static str,
    /// What holds when it is not given.
    pub default: Preset,
    /// Name of its option on the command line, where a command takes it: `--name`.
    pub option: &'static str,
    /// One line for people.
    pub help: &'static str,
    /// How the canonical form has it where that rests on other values too.
    pub(super) derived: Option<fn(&Case) -> Json>,
}

impl Parameter {
    /// A value that rests on others, in place of what was given or the default.
    pub(super) const fn derived(mut self, by: fn(&Case) -> Json) -> Self {
        self.derived = Some(by);
        self
    }

    /// Whether its value may say who the patient is: texts, names and files are whatever somebody
    /// typed.
    pub(super) fn may_identify(&self) -> bool {
        matches!(self.kind, Kind::Text | Kind::File | Kind::Files | Kind::Names)
    }

    /// The table it stands in, if any, and its name there.
    pub fn path(&self) -> (Option<&'static str>, &'static str) {
        match self.key.split_once('.') {
            Some((table, name)) => (Some(table), name),
            None => (None, self.key),
        }
    }

    /// What is expected, in words: range, unit, choices.
    pub fn expected(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.kind {
            Kind::Switch => "true or false".into(),
            Kind::Number { min, max } => format!("a number from {min} to {max}{unit}"),
            Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
            Kind::Choice(choices) => {
                let quoted: Vec<String> = choices.iter().map(|c| format!("\"{c}\"")).collect();
                format!("one of {}", quoted.join(", "))
            }
            Kind::Text => "a text".into(),
            Kind::Point if unit.is_empty() => "three numbers [x, y, z]".into(),
            Kind::Point => format!("three numbers [x, y, z],{unit}"),
            Kind::Points => "a list of positions [[x, y, z], ...], mm".into(),
            Kind::Strokes => "a list of { tissue, radius, points }, mm".into(),
            Kind::Interval { min, max } => {
                format!("two ascending numbers from {min} to {max}{unit}")
            }
            Kind::File => "a file or folder".into(),
            Kind::Files => "a file or folder, or a list of them".into(),
            Kind::Names => "a name, or a list of names".into(),
        }
    }

    /// What holds when it is not given, in words.
    pub fn default_text(&self) -> String {
        match self.default {
            Preset::Required => "required".into(),
            Preset::RequiredOr(other) => format!("required, or `{other}`"),
            Preset::Absent(what) => what.into(),
            Preset::Switch(on) => on.to_string(),
            Preset::Number(x) => x.to_string(),
            Preset::Whole(n) => n.to_string(),
            Preset::Choice(word) => format!("\"{word}\""),
        }
    }
}

/// What holds when a parameter is not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Preset {
    /// It has to be given.
    Required,
    /// It has to be given, or another key in its place.
    RequiredOr(&'static str),
    /// Nothing: what then happens is said in brackets.
    Absent(&'static str),
    /// `false`, or `true`.
    Switch(bool),
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(u64),
    /// The word.
    Choice(&'static str),
}

/// A row.
pub(super) const fn row(
    (key, option): (&'static str, &'static str),
    kind: Kind,
    unit: &'static str,
    default: Preset,
    help: &'static str,
) -> Parameter {
    Parameter { key, kind, unit, default, option, help, derived: None }
}

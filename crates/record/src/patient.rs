//! Whose CT it is.

use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;

/// Whose CT it is: for the eyes of those who treat her, not for logs and summaries, hence no
/// content in its `Debug`. What is not known is empty.
#[derive(Serialize, JsonSchema, Clone, Default, PartialEq, Eq)]
pub struct PatientIdentity {
    /// Name, family name first.
    pub name: String,
    /// Patient ID.
    pub id: String,
    /// Date of birth, as `1960-05-17`.
    pub born: String,
    /// Study Description and its date.
    pub study: String,
    /// Series Number and Series Description.
    pub series: String,
}

impl fmt::Debug for PatientIdentity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("PatientIdentity(..)")
    }
}

impl PatientIdentity {
    /// What is known, each with what it is.
    pub fn known(&self) -> Vec<(&'static str, &str)> {
        let Self { name, id, born, study, series } = self;
        let all =
            [("Patient", name), ("ID", id), ("Born", born), ("Study", study), ("Series", series)];
        let known = all.into_iter().filter(|(_, text)| !text.is_empty());
        known.map(|(what, text)| (what, text.as_str())).collect()
    }

    /// Name, ID, date of birth and study, as far as they are known, in one line.
    pub fn line(&self) -> String {
        in_line([&self.name, &self.beside_name()])
    }

    /// The same without the name.
    pub fn beside_name(&self) -> String {
        let Self { id, born, study, .. } = self;
        let born = if born.is_empty() { String::new() } else { format!("born {born}") };
        in_line([id, &born, study])
    }
}

/// What is known of these, in one line.
fn in_line<const N: usize>(all: [&String; N]) -> String {
    let known = all.into_iter().filter(|text| !text.is_empty()).map(String::as_str);
    known.collect::<Vec<_>>().join(" \u{b7} ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_stands_in_one_line() {
        let [name, id] = ["Doe, Jane", "7"].map(String::from);
        let patient =
            PatientIdentity { name, id, born: "1960-05-17".into(), ..PatientIdentity::default() };
        assert_eq!(patient.line(), "Doe, Jane \u{b7} 7 \u{b7} born 1960-05-17");
        assert_eq!(PatientIdentity::default().line(), "");
    }
}

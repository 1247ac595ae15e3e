//! Whose CT a report shows.

use std::fmt::Write as _;
use supine_space::visible;

/// So many of the things that are known stand at the head of a printed page: there is one line for
/// them.
const PRINTED: usize = 3;

/// Whose CT a report or the workstation shows: stands on their pages alone, never in the summary.
/// What is not known is empty.
#[derive(Clone, Default, serde::Serialize)]
pub struct PatientIdentity {
    /// Name, family name first.
    pub name: String,
    /// Patient ID.
    pub id: String,
    /// Date of birth.
    pub born: String,
    /// Study and its date.
    pub study: String,
    /// Series.
    pub series: String,
}

impl std::fmt::Debug for PatientIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("PatientIdentity(..)")
    }
}

impl PatientIdentity {
    /// What is known, each with what it is.
    pub(crate) fn known(&self) -> Vec<(&'static str, &str)> {
        let Self { name, id, born, study, series } = self;
        let all =
            [("Patient", name), ("ID", id), ("Born", born), ("Study", study), ("Series", series)];
        let known = all.into_iter().filter(|(_, text)| !text.is_empty());
        known.map(|(what, text)| (what, text.as_str())).collect()
    }

    /// Who it is, for the head of every printed page: the inside of a CSS string (CSS Syntax
    /// 4.3.7), without any character that could end it or the page's `<style>`.
    pub(crate) fn printed(&self) -> String {
        let known = self.known().into_iter().take(PRINTED);
        let told: Vec<String> = known.map(|(what, text)| format!("{what} {text}")).collect();
        let mut escaped = String::new();
        for c in visible(&told.join(" \u{b7} ")).chars() {
            if c.is_ascii_alphanumeric() {
                escaped.push(c);
            } else {
                // A String takes whatever is written.
                let _fits = write!(escaped, "\\{:x} ", u32::from(c));
            }
        }
        escaped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_ends_neither_the_string_nor_the_style() {
        let name = "A\"}</style>\\\n\u{fc}".to_owned();
        let text = PatientIdentity { name, id: "7".into(), ..PatientIdentity::default() }.printed();
        assert!(text.starts_with("Patient\\20 A\\22 \\7d \\3c \\2f style"), "{text}");
        assert!(!text.contains(['"', '<', '\n']) && text.is_ascii(), "{text}");
        assert!(text.ends_with("ID\\20 7"), "{text}");
    }
}

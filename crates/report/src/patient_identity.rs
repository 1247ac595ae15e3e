//! Who the patient is, on paper.

use std::fmt::Write as _;
use supine_record::PatientIdentity;
use supine_space::visible;

/// So many of the things that are known stand at the head of a printed page: there is one line for
/// them.
const PRINTED: usize = 3;

/// Who it is, for the head of every printed page: the inside of a CSS string (CSS Syntax 4.3.7),
/// without any character that could end it or the page's `<style>`.
pub(crate) fn printed(patient: &PatientIdentity) -> String {
    let known = patient.known().into_iter().take(PRINTED);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_ends_neither_the_string_nor_the_style() {
        let name = "A\"}</style>\\\n\u{fc}".to_owned();
        let text = printed(&PatientIdentity { name, id: "7".into(), ..PatientIdentity::default() });
        assert!(text.starts_with("Patient\\20 A\\22 \\7d \\3c \\2f style"), "{text}");
        assert!(!text.contains(['"', '<', '\n']) && text.is_ascii(), "{text}");
        assert!(text.ends_with("ID\\20 7"), "{text}");
    }
}

//! Whose CT a series is, as a person reads it.

use crate::character_set::readable;
use crate::data_set::DataSet;
use crate::source::Source;
use dicom_dictionary_std::tags;

/// Whose CT a series is: for the eyes of those who treat her, not for logs, hence no content in its
/// `Debug`.
#[derive(Clone, PartialEq, Eq, Default)]
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

impl std::fmt::Debug for PatientIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("PatientIdentity(..)")
    }
}

impl PatientIdentity {
    /// By the header of a file.
    pub(crate) fn of(header: &DataSet) -> Self {
        let text = |tag| readable(header, tag);
        let joined = |parts: [String; 2]| {
            let there: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            there.join(", ")
        };
        Self {
            name: name(&text(tags::PATIENT_NAME)),
            id: text(tags::PATIENT_ID),
            born: date(&text(tags::PATIENT_BIRTH_DATE)),
            study: joined([text(tags::STUDY_DESCRIPTION), date(&text(tags::STUDY_DATE))]),
            series: joined([text(tags::SERIES_NUMBER), text(tags::SERIES_DESCRIPTION)]),
        }
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

impl Source {
    /// Whose CT it is; what its header lacks is empty.
    pub fn whose(&self) -> PatientIdentity {
        PatientIdentity::of(&self.slices[0].header)
    }

    /// Study Instance UID.
    pub fn study_uid(&self) -> String {
        self.slices[0].header.text(tags::STUDY_INSTANCE_UID)
    }

    /// SOP Instance UIDs of its files, ascending along the normal; frames of one file are one
    /// instance.
    pub fn instance_uids(&self) -> Vec<String> {
        let mut uids: Vec<String> =
            self.slices.iter().map(|s| s.header.text(tags::SOP_INSTANCE_UID)).collect();
        uids.dedup();
        uids
    }
}

/// What is known of these, in one line.
fn in_line<const N: usize>(all: [&String; N]) -> String {
    let known = all.into_iter().filter(|text| !text.is_empty()).map(String::as_str);
    known.collect::<Vec<_>>().join(" \u{b7} ")
}

/// A person's name (PS3.5 6.2.1.1): of the alphabetic group family name, given and middle names.
fn name(text: &str) -> String {
    let group = text.split('=').find(|group| !group.is_empty()).unwrap_or_default();
    let mut parts = group.split('^').map(str::trim);
    let family = parts.next().unwrap_or_default();
    let given: Vec<&str> = parts.take(2).filter(|part| !part.is_empty()).collect();
    match (family, given.join(" ")) {
        (family, given) if given.is_empty() => family.into(),
        ("", given) => given,
        (family, given) => format!("{family}, {given}"),
    }
}

/// A date as people write it; the text itself when it is none.
fn date(text: &str) -> String {
    let part = |from: usize, to: usize| text.get(from..to).unwrap_or_default();
    let digits = text.len() == 8 && text.bytes().all(|b| b.is_ascii_digit());
    if digits { format!("{}-{}-{}", part(0, 4), part(4, 6), part(6, 8)) } else { text.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_set::Value;
    use dicom_core::VR;

    #[test]
    fn names_and_dates_are_as_people_write_them() {
        assert_eq!(name("Doe^Jane^Q^Dr"), "Doe, Jane Q");
        assert_eq!(name("PHANTOM"), "PHANTOM");
        assert_eq!(name("^Jane"), "Jane");
        assert_eq!(name("=Kanji^Name"), "Kanji, Name");
        assert_eq!(date("19600517"), "1960-05-17");
        assert_eq!(date("1960"), "1960");
    }

    #[test]
    fn what_is_known_stands_in_one_line() {
        let [name, id] = ["Doe, Jane", "7"].map(String::from);
        let whose =
            PatientIdentity { name, id, born: "1960-05-17".into(), ..PatientIdentity::default() };
        assert_eq!(whose.line(), "Doe, Jane \u{b7} 7 \u{b7} born 1960-05-17");
        assert_eq!(PatientIdentity::default().line(), "");
    }

    #[test]
    fn texts_are_read_in_their_own_character_set() {
        let shown = |set: &str, bytes: &[u8]| {
            let mut header = DataSet::default();
            header.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, set);
            header.put(tags::PATIENT_NAME, VR::PN, Value::Bytes(bytes.to_vec()));
            name(&readable(&header, tags::PATIENT_NAME))
        };
        assert_eq!(shown("ISO_IR 100", b"M\xfcller^Eva "), "Müller, Eva");
        assert_eq!(shown("ISO_IR 192", "Müller^Eva".as_bytes()), "Müller, Eva");
        assert_eq!(shown("", b"Doe^Jane"), "Doe, Jane");
    }
}

//! Whose CT a series is, as a person reads it.

use crate::character_set::readable;
use crate::data_set::DataSet;
use crate::source::Source;
use dicom_dictionary_std::tags;
use supine_record::PatientIdentity;

/// Whose CT a series is, by the header of a file.
pub(crate) fn patient_identity(header: &DataSet) -> PatientIdentity {
    let text = |tag| readable(header, tag);
    let joined = |parts: [String; 2]| {
        let there: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        there.join(", ")
    };
    PatientIdentity {
        name: name(&text(tags::PATIENT_NAME)),
        id: text(tags::PATIENT_ID),
        born: date(&text(tags::PATIENT_BIRTH_DATE)),
        study: joined([text(tags::STUDY_DESCRIPTION), date(&text(tags::STUDY_DATE))]),
        series: joined([text(tags::SERIES_NUMBER), text(tags::SERIES_DESCRIPTION)]),
    }
}

impl Source {
    /// Whose CT it is; what its header lacks is empty.
    pub fn whose(&self) -> PatientIdentity {
        patient_identity(&self.slices[0].header)
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

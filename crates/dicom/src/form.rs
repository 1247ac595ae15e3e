//! The form that values must have (PS3.5 6.2), and values of others that are brought into it.
//!
//! Scanners, information systems and anonymisers write texts that are too long, ages without their
//! unit and dates with hyphens. Readers take them; in a new object they would be our fault.

use crate::data_set::{DataSet, Value, dictionary_vr};
use crate::derived::PATIENT_AND_STUDY;
use crate::export::{COPIED_PER_SLICE, EQUIPMENT, SCAN};
use crate::number::{parse_ds, parse_is};
use crate::uid::is_uid;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use supine_space::Warning;

/// By these an object is found and a text is read: they stay as they are.
const KEPT: &[Tag] = &[
    tags::PATIENT_ID,
    tags::STUDY_INSTANCE_UID,
    tags::SPECIFIC_CHARACTER_SET,
    tags::FRAME_OF_REFERENCE_UID,
];

/// Most characters of a value; `None` where there is no such limit.
pub(crate) fn longest(vr: VR) -> Option<usize> {
    Some(match vr {
        VR::AE | VR::CS | VR::DS | VR::SH => 16,
        VR::IS => 12,
        VR::DA => 8,
        VR::AS => 4,
        VR::TM => 14,
        VR::DT => 26,
        VR::LO | VR::UI => 64,
        VR::PN => 324,
        _ => return None,
    })
}

/// What is wrong with one value.
pub(crate) fn fault(vr: VR, value: &str, longest: usize) -> Option<String> {
    // The padding to even length does not count but for numbers, which it must not exceed.
    let value = match vr {
        VR::UI => value.trim_end_matches('\0'),
        _ => value,
    };
    let bare = value.trim_matches(' ');
    let counted = if matches!(vr, VR::DS | VR::IS) { value } else { bare };
    let length = counted.chars().count();
    if length > longest {
        return Some(format!("has a value of {length} characters, {longest} fit"));
    }
    let digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    let formed = bare.is_empty()
        || match vr {
            VR::UI => is_uid(value),
            VR::DS => parse_ds(value).is_some(),
            VR::IS => parse_is(value).is_some(),
            VR::CS => value.chars().all(is_code),
            VR::DA => bare.len() == 8 && digits(bare),
            VR::TM => digits(&bare.replace('.', "")) && bare.len() >= 2,
            VR::AS => bare.len() == 4 && digits(&bare[..3]) && bare.ends_with(['D', 'W', 'M', 'Y']),
            _ => true,
        };
    (!formed).then(|| "does not have the form of its VR".into())
}

fn is_code(c: char) -> bool {
    c.is_ascii_uppercase() || c.is_ascii_digit() || matches!(c, ' ' | '_')
}

/// Whether what is too long is cut. Half a number or half a date is another one.
fn is_cut(vr: VR) -> bool {
    matches!(vr, VR::SH | VR::LO | VR::PN | VR::CS)
}

/// The nearest value that has its form; empty where there is none.
fn mended_value(vr: VR, value: &str, longest: usize) -> String {
    let bare = value.trim_matches([' ', '\0']);
    let digits: String = bare.chars().filter(char::is_ascii_digit).collect();
    let text = match vr {
        VR::CS => {
            bare.to_ascii_uppercase().chars().map(|c| if is_code(c) { c } else { '_' }).collect()
        }
        VR::DA => digits,
        VR::TM => bare.replace(':', ""),
        VR::AS if digits.is_empty() => String::new(),
        VR::AS => {
            let unit = bare.to_ascii_uppercase().chars().last().filter(|c| "DWMY".contains(*c));
            format!("{:0>3}{}", digits.trim_start_matches('0'), unit.unwrap_or('Y'))
        }
        VR::DS | VR::IS => bare.replace(',', "."),
        _ => bare.to_owned(),
    };
    let cut: String = text.chars().take(longest).collect();
    let kept = if is_cut(vr) { cut } else { text };
    if fault(vr, &kept, longest).is_none() { kept } else { String::new() }
}

/// The elements that an object inherits and that do not have their form, with what is inherited in
/// their place.
fn mended(header: &DataSet) -> Vec<(Tag, VR, String)> {
    let open = inherited().filter(|tag| !KEPT.contains(tag));
    let one = |&tag: &Tag| {
        let vr = header.get(tag)?.vr;
        let longest = longest(vr)?;
        let bytes = header.bytes(tag)?;
        // In other sets a byte may be half a letter.
        let text = std::str::from_utf8(bytes).ok().filter(|text| text.is_ascii())?;
        let values: Vec<&str> = text.split('\\').collect();
        let is_odd = values.iter().any(|value| fault(vr, value, longest).is_some());
        let fitting = |value: &&str| match fault(vr, value, longest) {
            // A number is only cut to its form when it is written.
            Some(_) if vr == VR::DS && parse_ds(value).is_some() => (*value).to_owned(),
            Some(_) => mended_value(vr, value, longest),
            None => (*value).to_owned(),
        };
        let found: Vec<String> = values.iter().map(fitting).collect();
        let found = found.join("\\");
        (is_odd && found != text && dictionary_vr(tag) == vr).then_some((tag, vr, found))
    };
    open.filter_map(one).collect()
}

fn inherited() -> impl Iterator<Item = &'static Tag> {
    PATIENT_AND_STUDY.iter().chain(SCAN).chain(EQUIPMENT).chain(COPIED_PER_SLICE)
}

/// The set that texts are in which are not ASCII although no set is named.
fn set_of_bytes(header: &DataSet) -> Option<&'static str> {
    if !header.text(tags::SPECIFIC_CHARACTER_SET).is_empty() {
        return None;
    }
    let texts = inherited().filter_map(|tag| header.bytes(*tag));
    let odd: Vec<&[u8]> = texts.filter(|bytes| !bytes.is_ascii()).collect();
    let is_utf8 = odd.iter().all(|bytes| std::str::from_utf8(bytes).is_ok());
    (!odd.is_empty()).then_some(if is_utf8 { "ISO_IR 192" } else { "ISO_IR 100" })
}

/// Brings what an object inherits from a header into its form.
pub(crate) fn mend(header: &mut DataSet) {
    if let Some(set) = set_of_bytes(header) {
        header.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, set);
    }
    for (tag, vr, text) in mended(header) {
        header.put(tag, vr, Value::Bytes(text.into_bytes()));
    }
}

/// What [`mend`] changes, without the values, which may name the patient.
pub(crate) fn told(header: &DataSet) -> Vec<Warning> {
    let mut told: Vec<Warning> = mended(header)
        .into_iter()
        .map(|(tag, vr, text)| {
            let cut = is_cut(vr)
                && longest(vr).is_some_and(|most| header.text(tag).chars().count() > most);
            let done = match (text.is_empty(), cut) {
                (true, _) => "left out".into(),
                (false, false) => "written as it must be".into(),
                // Who searches for the whole value does not find it.
                (false, true) => format!("cut to {} characters", text.chars().count()),
            };
            let text = format!(
                "{tag} of the source does not have the form that DICOM asks for: it is {done} in what is exported"
            );
            Warning::new("source-ill-formed", text)
        })
        .collect();
    told.extend(set_of_bytes(header).map(|set| {
        let text = format!(
            "texts of the source have letters but name no character set: they are read, and exported, as {set}"
        );
        Warning::new("source-ill-formed", text)
    }));
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(values: &[(Tag, VR, &[u8])]) -> DataSet {
        let mut set = DataSet::default();
        values.iter().for_each(|(tag, vr, bytes)| set.put(*tag, *vr, Value::Bytes(bytes.to_vec())));
        set
    }

    #[test]
    fn what_others_wrote_is_brought_into_its_form() {
        let cases: [(Tag, VR, &[u8], &str); 9] = [
            (tags::ACCESSION_NUMBER, VR::SH, b"ACC-2026-0000000000012345 ", "ACC-2026-0000000"),
            (tags::PATIENT_AGE, VR::AS, b"58", "058Y"),
            (tags::PATIENT_AGE, VR::AS, b"7m", "007M"),
            (tags::PATIENT_AGE, VR::AS, b"old ", ""),
            (tags::PATIENT_BIRTH_DATE, VR::DA, b"1968-04-12", "19680412"),
            (tags::PATIENT_BIRTH_DATE, VR::DA, b"1968", ""),
            (tags::STUDY_TIME, VR::TM, b"12:30:05", "123005"),
            (tags::PATIENT_SEX, VR::CS, b"f ", "F"),
            (tags::PATIENT_WEIGHT, VR::DS, b"65,5", "65.5"),
        ];
        for (tag, vr, bytes, want) in cases {
            let mut set = header(&[(tag, vr, bytes)]);
            let said = told(&set);
            assert_eq!(said.len(), 1, "{want}");
            let cut = said[0].to_string().contains("cut to 16 characters");
            assert_eq!(cut, tag == tags::ACCESSION_NUMBER, "{said:?}");
            mend(&mut set);
            assert_eq!((set.text(tag).as_str(), told(&set).len()), (want, 0));
        }
    }

    #[test]
    fn what_has_its_form_stays() {
        let mut set = header(&[
            (tags::ACCESSION_NUMBER, VR::SH, b"A1"),
            (tags::PATIENT_AGE, VR::AS, b"058Y"),
            (tags::PATIENT_ID, VR::LO, &[b'1'; 80]),
        ]);
        let before = set.clone();
        mend(&mut set);
        assert!(set == before && told(&set).is_empty());
    }

    #[test]
    fn letters_without_a_set_have_one() {
        for (name, set) in
            [(&b"M\xfcller^Eva"[..], "ISO_IR 100"), ("Müller".as_bytes(), "ISO_IR 192")]
        {
            let mut header = header(&[(tags::PATIENT_NAME, VR::PN, name)]);
            assert_eq!(told(&header).len(), 1);
            mend(&mut header);
            assert_eq!(header.text(tags::SPECIFIC_CHARACTER_SET), set);
        }
    }
}

//! The form that values must have (PS3.5 6.2), and values of others that are brought into it.
//!
//! Scanners, information systems and anonymisers write texts that are too long, ages without their
//! unit and dates with hyphens. Readers take them; in a new object they would be our fault.

use crate::character_set::{ESCAPE, decode, holds, is_known};
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

/// Most characters of a component group of a name.
const GROUP: usize = 64;

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
    if matches!(vr, VR::SH | VR::LO | VR::PN | VR::CS) && value.chars().any(is_control) {
        return Some("has control characters".into());
    }
    let group = longest_group(value);
    if vr == VR::PN && group > GROUP {
        return Some(format!("has a component group of {group} characters, {GROUP} fit"));
    }
    let formed = bare.is_empty()
        || match vr {
            VR::UI => is_uid(value),
            VR::DS => parse_ds(value).is_some(),
            VR::IS => parse_is(value).is_some(),
            VR::CS => value.chars().all(is_code),
            VR::DA => bare.len() == 8 && digits(bare) && is_day(&bare[4..]),
            VR::TM => digits(&bare.replace('.', "")) && bare.len() >= 2 && is_time(bare),
            VR::AS => bare.len() == 4 && digits(&bare[..3]) && bare.ends_with(['D', 'W', 'M', 'Y']),
            _ => true,
        };
    (!formed).then(|| "does not have the form of its VR".into())
}

/// Characters of the longest component group of a name.
fn longest_group(name: &str) -> usize {
    name.split('=').map(|group| group.chars().count()).max().unwrap_or(0)
}

/// Escape sequences of character sets are none.
fn is_control(c: char) -> bool {
    c.is_ascii_control() && c != char::from(ESCAPE)
}

/// Whether four digits are a month and a day.
fn is_day(digits: &str) -> bool {
    let number = |text: &str| text.parse::<u8>().unwrap_or(0);
    (1..=12).contains(&number(&digits[..2])) && (1..=31).contains(&number(&digits[2..]))
}

/// Whether digits begin with an hour, and a minute if there is one; seconds may be leap seconds.
fn is_time(digits: &str) -> bool {
    let below = |from: usize, end: u8| {
        digits.get(from..from + 2).is_none_or(|text| text.parse().is_ok_and(|n: u8| n < end))
    };
    below(0, 24) && below(2, 60) && below(4, 61)
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
    let plain: String = value.chars().map(|c| if is_control(c) { ' ' } else { c }).collect();
    let bare = plain.trim();
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
        VR::PN => {
            let cut = |group: &str| group.chars().take(GROUP).collect::<String>();
            bare.split('=').map(cut).collect::<Vec<_>>().join("=")
        }
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
        let repaired: Vec<String> = values.iter().map(fitting).collect();
        let repaired = repaired.join("\\");
        (is_odd && repaired != text && dictionary_vr(tag) == vr).then_some((tag, vr, repaired))
    };
    open.filter_map(one).collect()
}

fn inherited() -> impl Iterator<Item = &'static Tag> {
    PATIENT_AND_STUDY.iter().chain(SCAN).chain(EQUIPMENT).chain(COPIED_PER_SLICE)
}

/// How the texts of a header become texts of the set that it names.
struct Lettering {
    /// The set that is named, as the standard spells it.
    named: String,
    set: String,
    /// Whether the texts are written anew in UTF-8.
    recode: bool,
    why: &'static str,
}

/// The set that texts are in: where none is named, one is misspelt, or they are not of the one that
/// is named.
fn lettering(header: &DataSet) -> Option<Lettering> {
    let (named, set) = (header.text(tags::SPECIFIC_CHARACTER_SET), set_named(header));
    let odd: Vec<&[u8]> = inherited()
        .filter(|tag| header.get(**tag).is_some_and(|element| has_letters(element.vr)))
        .filter_map(|tag| header.bytes(*tag))
        .filter(|bytes| !bytes.is_ascii() || bytes.contains(&ESCAPE))
        .collect();
    let fit = |set: &str| odd.iter().all(|bytes| holds(set, bytes));
    let other = |other: &str, recode, why| {
        Some(Lettering { named: set.clone(), set: other.into(), recode, why })
    };
    if fit(&set) {
        let why = "name their character set as no standard spells it";
        return if set == named { None } else { other(&set, false, why) };
    }
    let why = match named.is_empty() {
        true => "have letters but name no character set",
        false => "are not in the character set that they name",
    };
    match is_known(&set) {
        false => None,
        true if fit("ISO_IR 192") => other("ISO_IR 192", false, why),
        true if named.is_empty() && fit("ISO_IR 100") => other("ISO_IR 100", false, why),
        true => other("ISO_IR 192", true, why),
    }
}

/// The Specific Character Set that an object names, as the standard spells it.
pub(crate) fn set_named(set: &DataSet) -> String {
    let named = set.text(tags::SPECIFIC_CHARACTER_SET);
    named.split('\\').map(spelt).collect::<Vec<_>>().join("\\")
}

/// Whether values are in the object's character set; others are ASCII.
pub(crate) fn has_letters(vr: VR) -> bool {
    matches!(vr, VR::PN | VR::LO | VR::SH | VR::ST | VR::LT | VR::UT | VR::UC)
}

/// The defined term that a name of a character set means; the name itself where that is not known.
fn spelt(name: &str) -> String {
    let name = name.trim();
    let plain: String =
        name.to_ascii_uppercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let known = match plain.as_str() {
        "UTF8" => "ISO_IR 192",
        "ISO88591" | "LATIN1" | "WINDOWS1252" | "CP1252" => "ISO_IR 100",
        "ISO88592" | "LATIN2" => "ISO_IR 101",
        "ISO88595" => "ISO_IR 144",
        "ASCII" | "USASCII" => "ISO_IR 6",
        _ => "",
    };
    let number = plain.strip_prefix("ISOIR").filter(|n| n.bytes().all(|b| b.is_ascii_digit()));
    let term = number.map(|number| format!("ISO_IR {number}"));
    let term = if known.is_empty() { term } else { Some(known.into()) };
    term.filter(|term| is_known(term)).unwrap_or_else(|| name.into())
}

/// A text that is not in its set: as Windows writes Latin-1 where that is the set, else as it is
/// read.
fn in_utf8(set: &str, bytes: &[u8]) -> String {
    /// What Windows-1252 has at 0x80 to 0x9F.
    const WINDOWS: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8d}Ž\u{8f}\u{90}‘’“”•–—˜™š›œ\u{9d}žŸ";
    let letter = |&byte: &u8| match byte {
        0x80..0xA0 => WINDOWS.chars().nth(usize::from(byte) - 0x80).unwrap_or('?'),
        _ => char::from(byte),
    };
    match (set, std::str::from_utf8(bytes)) {
        ("ISO_IR 192", Ok(text)) => text.into(),
        ("" | "ISO_IR 6" | "ISO_IR 100" | "ISO_IR 192", _) => bytes.iter().map(letter).collect(),
        _ => decode(set, bytes),
    }
}

/// Brings what an object inherits from a header into its form.
pub(crate) fn mend(header: &mut DataSet) {
    if let Some(Lettering { named, set, recode, .. }) = lettering(header) {
        for tag in inherited().filter(|_| recode) {
            let vr = header.get(*tag).map(|element| element.vr).filter(|vr| has_letters(*vr));
            if let (Some(vr), Some(bytes)) = (vr, header.bytes(*tag)) {
                let text = in_utf8(&named, bytes);
                header.put_text(*tag, vr, &text);
            }
        }
        header.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, &set);
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
            let whole = header.text(tag);
            let most = longest(vr).unwrap_or(usize::MAX);
            let cut = is_cut(vr)
                && (whole.chars().count() > most || (vr == VR::PN && longest_group(&whole) > GROUP));
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
    told.extend(lettering(header).map(|Lettering { set, why, .. }| {
        let text = format!("texts of the source {why}: they are read, and exported, as {set}");
        Warning::new("source-ill-formed", text)
    }));
    let id = header.text(tags::PATIENT_ID).chars().count();
    told.extend(longest(VR::LO).filter(|most| id > *most).map(|most| {
        let text = format!(
            "the Patient ID of the source has {id} characters, where DICOM allows {most}: it is exported whole, as archives find her by it"
        );
        Warning::new("source-ill-formed", text)
    }));
    told
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::character_set::readable;

    fn header(values: &[(Tag, VR, &[u8])]) -> DataSet {
        let mut set = DataSet::default();
        values.iter().for_each(|(tag, vr, bytes)| set.put(*tag, *vr, Value::Bytes(bytes.to_vec())));
        set
    }

    #[test]
    fn what_others_wrote_is_brought_into_its_form() {
        let long = format!("{}^Eva=Lee", "A".repeat(70));
        let cases: [(Tag, VR, &[u8], &str); 13] = [
            (tags::STUDY_DATE, VR::DA, b"20261350", ""),
            (tags::STUDY_TIME, VR::TM, b"256000", ""),
            (tags::STUDY_DESCRIPTION, VR::LO, b"CT\tBreast\r\nplan", "CT Breast  plan"),
            (tags::PATIENT_NAME, VR::PN, long.as_bytes(), &format!("{}=Lee", "A".repeat(64))),
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
            let cut = said[0].to_string().contains("cut to ");
            let long = [tags::ACCESSION_NUMBER, tags::PATIENT_NAME].contains(&tag);
            assert_eq!(cut, long, "{said:?}");
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
        let said = told(&set);
        assert!(set == before && said.len() == 1 && said[0].to_string().contains("Patient ID"));
    }

    #[test]
    fn letters_without_a_set_have_one() {
        // The set that is named, a name, the set that it is in, and what is read then.
        let cases: [(&[u8], &[u8], &str, &str); 9] = [
            (b"", b"M\xfcller^Eva", "ISO_IR 100", "Müller^Eva"),
            (b"", "Müller".as_bytes(), "ISO_IR 192", "Müller"),
            (b"", b"O\x92Hara", "ISO_IR 192", "O’Hara"),
            (b"ISO_IR 100", b"\x8aimkov\xe1", "ISO_IR 192", "Šimková"),
            (b"ISO_IR 100", "Łukasz".as_bytes(), "ISO_IR 192", "Łukasz"),
            (b"ISO-IR 100", b"M\xfcller", "ISO_IR 100", "Müller"),
            (b"ISO8859-1", b"Mueller ", "ISO_IR 100", "Mueller"),
            (b"UTF-8", "Müller".as_bytes(), "ISO_IR 192", "Müller"),
            (b"ISO_IR 192", b"M\xfcller", "ISO_IR 192", "Müller"),
        ];
        for (named, name, set, read) in cases {
            let mut header = header(&[
                (tags::SPECIFIC_CHARACTER_SET, VR::CS, named),
                (tags::PATIENT_NAME, VR::PN, name),
            ]);
            let said = told(&header);
            assert!(said.len() == 1 && said[0].to_string().contains(set), "{read}: {said:?}");
            mend(&mut header);
            assert_eq!(header.text(tags::SPECIFIC_CHARACTER_SET), set, "{read}");
            assert_eq!(readable(&header, tags::PATIENT_NAME), read);
            assert!(told(&header).is_empty(), "{read}");
        }
        for (set, name) in [("ISO_IR 100", &b"M\xfcller"[..]), ("ISO_IR 999", b"M\xfcller")] {
            let header = header(&[
                (tags::SPECIFIC_CHARACTER_SET, VR::CS, set.as_bytes()),
                (tags::PATIENT_NAME, VR::PN, name),
            ]);
            assert!(told(&header).is_empty(), "{set}");
        }
    }
}

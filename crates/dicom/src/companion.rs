//! What goes with an exported CT: doses, structures and registrations say the same of patient,
//! study, frame of reference and maker.

use crate::character_set::{ESCAPE, holds, question_marks};
use crate::clock::Clock;
use crate::data_set::{DataSet, Value, encode, part10};
use crate::deformed::{MANUFACTURER, MODEL};
use crate::derived::{
    PATIENT_AND_STUDY, REQUIRED_OF_ALL, check_clock, check_text, code, copy, instance_reference,
    put_missing,
};
use crate::error::Error;
use crate::form::{has_letters, set_named};
use crate::series::Place;
use crate::source::Source;
use crate::whole_file::is_text;
use crate::{series, uid, whole_file};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use sha2::{Digest as _, Sha256};
use std::path::Path;
use supine_space::Warning;

/// What an object that goes with an exported CT says about itself.
#[derive(Clone, Debug)]
pub struct CompanionParams {
    /// Series Description; must contain DEFORMED or CHEST WALL, 64 characters at most.
    pub series_description: String,
    /// How it was made, 1024 characters at most; what the CT says of its derivation is put behind
    /// it.
    pub derivation: String,
    /// Date and time written everywhere "now" is meant.
    pub clock: Clock,
    /// How many objects of its kind were written beside the CT before: decides its Series Number.
    pub before: usize,
    /// Version of this software, 64 characters at most.
    pub software_version: String,
}

/// An object that was written, by which others refer to it.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct ObjectReference {
    /// SOP Class UID.
    pub class_uid: String,
    /// SOP Instance UID.
    pub instance_uid: String,
    /// Series Instance UID.
    pub series_uid: String,
}

/// Kind of an object: its class and modality.
pub(crate) struct Kind {
    pub(crate) class: &'static str,
    pub(crate) modality: &'static str,
    /// What its identifiers are made for.
    pub(crate) role: &'static str,
}

impl CompanionParams {
    fn check(&self) -> Result<(), Error> {
        let Self { series_description, derivation, software_version, clock, .. } = self;
        let one = |text: &str| !text.is_empty() && !text.contains('\\');
        let marked = ["DEFORMED", "CHEST WALL"].iter().any(|m| series_description.contains(m));
        check_text(
            "Series Description",
            series_description,
            64,
            one(series_description) && marked,
        )?;
        check_text("Derivation Description", derivation, 1024, !derivation.is_empty())?;
        check_text("Software Versions", software_version, 64, one(software_version))?;
        check_clock(clock)
    }
}

/// Patient, study and frame of reference of `ct`, and the object's own series, equipment and times
/// (PS3.3 C.7.1 to C.7.5, C.12.1).
pub(crate) fn common(
    ct: &Source,
    params: &CompanionParams,
    (kind, place): (&Kind, Place),
) -> Result<DataSet, Error> {
    params.check()?;
    let first = &ct.slices[0].header;
    let mut set = DataSet::default();
    for &tag in PATIENT_AND_STUDY {
        copy(&mut set, tag, first);
    }
    copy(&mut set, tags::FRAME_OF_REFERENCE_UID, first);
    put_missing(&mut set, REQUIRED_OF_ALL);
    let number = place.beside(ct).to_string();
    let description = series::described(&params.series_description, ct);
    let Clock { date, time } = &params.clock;
    for (tag, vr, text) in [
        (tags::SOP_CLASS_UID, VR::UI, kind.class),
        (tags::MODALITY, VR::CS, kind.modality),
        (tags::INSTANCE_CREATION_DATE, VR::DA, date),
        (tags::INSTANCE_CREATION_TIME, VR::TM, time),
        (tags::SERIES_DATE, VR::DA, date),
        (tags::SERIES_TIME, VR::TM, time),
        (tags::SERIES_DESCRIPTION, VR::LO, &description),
        (tags::SERIES_NUMBER, VR::IS, &number),
        (tags::INSTANCE_NUMBER, VR::IS, "1"),
        (tags::MANUFACTURER, VR::LO, MANUFACTURER),
        (tags::MANUFACTURER_MODEL_NAME, VR::LO, MODEL),
        (tags::DEVICE_SERIAL_NUMBER, VR::LO, "0"),
        (tags::SOFTWARE_VERSIONS, VR::LO, &params.software_version),
    ] {
        set.put_text(tag, vr, text);
    }
    Ok(set)
}

/// What says that an image was made from another by resampling (PS3.3 C.7.6.1.1, C.12.4).
pub(crate) fn put_derivation(
    set: &mut DataSet,
    params: &CompanionParams,
    ct: &Source,
    from: &DataSet,
) {
    set.put_text(tags::IMAGE_TYPE, VR::CS, "DERIVED\\SECONDARY");
    set.put_text(tags::DERIVATION_DESCRIPTION, VR::ST, &derivation(params, ct));
    let resampling = code("DCM", "113085", "Spatial resampling");
    set.put_items(tags::DERIVATION_CODE_SEQUENCE, vec![resampling]);
    let mut item = instance_reference(from);
    item.put_text(tags::SPATIAL_LOCATIONS_PRESERVED, VR::CS, "NO");
    let purpose = code("DCM", "121322", "Source image for image processing operation");
    item.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);
    set.put_items(tags::SOURCE_IMAGE_SEQUENCE, vec![item]);
}

/// How the object was made, and how the CT was that it goes with (ST: 1024 characters).
pub(crate) fn derivation(params: &CompanionParams, ct: &Source) -> String {
    let own = ct.slices[0].header.text(tags::DERIVATION_DESCRIPTION);
    let whole = format!("{} {own}", params.derivation);
    whole.trim_end().chars().filter(char::is_ascii).take(1024).collect()
}

/// The item that refers to an instance (PS3.3 table 10-11).
pub(crate) fn item(class: &str, instance: &str) -> DataSet {
    let mut item = DataSet::default();
    item.put_text(tags::REFERENCED_SOP_CLASS_UID, VR::UI, class);
    item.put_text(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, instance);
    item
}

/// The items that refer to all slices of a series; frames of one file are one instance.
pub(crate) fn slices(ct: &Source) -> Vec<DataSet> {
    let mut items: Vec<DataSet> = ct.slices.iter().map(|s| instance_reference(&s.header)).collect();
    items.dedup();
    items
}

/// Common Instance Reference: every slice of these series, those of other studies apart (PS3.3
/// C.12.2).
pub(crate) fn put_series(set: &mut DataSet, series: &[&Source]) {
    let item = |ct: &Source| {
        let mut item = DataSet::default();
        item.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &ct.series_uid());
        item.put_items(tags::REFERENCED_INSTANCE_SEQUENCE, slices(ct));
        item
    };
    let own = set.text(tags::STUDY_INSTANCE_UID);
    let study = |ct: &Source| ct.slices[0].header.text(tags::STUDY_INSTANCE_UID);
    let (here, elsewhere): (Vec<&Source>, Vec<&Source>) =
        series.iter().copied().partition(|ct| study(ct) == own);
    set.put_items(tags::REFERENCED_SERIES_SEQUENCE, here.into_iter().map(item).collect());
    let other = |ct: &Source| {
        let mut other = DataSet::default();
        other.put_text(tags::STUDY_INSTANCE_UID, VR::UI, &study(ct));
        other.put_items(tags::REFERENCED_SERIES_SEQUENCE, vec![item(ct)]);
        other
    };
    if !elsewhere.is_empty() {
        let items = elsewhere.into_iter().map(other).collect();
        set.put_items(tags::STUDIES_CONTAINING_OTHER_REFERENCED_INSTANCES_SEQUENCE, items);
    }
}

/// Gives the object its identifiers, made from all it holds, and writes it; it appears under its
/// name only when another reader sees all of it and `check` finds no fault.
pub(crate) fn write(
    mut set: DataSet,
    params: &CompanionParams,
    kind: &Kind,
    path: &Path,
    check: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<ObjectReference, Error> {
    let hash: [u8; 32] = Sha256::digest(encode(&set)).into();
    let reference = ObjectReference {
        class_uid: kind.class.to_owned(),
        instance_uid: uid::from_content(kind.role, &hash),
        series_uid: uid::from_content(&format!("{} series", kind.role), &hash),
    };
    set.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &reference.series_uid);
    set.put_text(tags::SOP_INSTANCE_UID, VR::UI, &reference.instance_uid);
    let version: String = params.software_version.chars().take(9).collect();
    let bytes = part10(&set, &format!("SUPINE_{version}"));
    whole_file::write(path, &bytes, |written| {
        whole_file::same_elements(written, &set)?;
        check(written)
    })?;
    Ok(reference)
}

/// Takes care that the names in these sequences of `from` keep their letters in `set`; whether they
/// cannot.
pub(crate) fn characters(
    set: &mut DataSet,
    from: &DataSet,
    names: &[Tag],
    warnings: &mut Vec<Warning>,
) -> bool {
    let items = || names.iter().flat_map(|&tag| from.items(tag));
    if items().all(ascii) {
        return false;
    }
    let charset = set_named;
    let fit = items().flat_map(DataSet::elements).all(|element| match &element.value {
        Value::Bytes(bytes) if has_letters(element.vr) => holds(&charset(from), bytes),
        _ => true,
    });
    if fit && charset(set) == charset(from) {
        return false;
    }
    if fit && ascii(set) {
        set.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, &charset(from));
        return false;
    }
    let why = match fit {
        true => "are written in another character set than the patient's name",
        false => "are not in the character set that their object names",
    };
    let text = format!("names of regions {why}: letters beyond ASCII became question marks");
    warnings.push(Warning::new("letters-replaced", text));
    true
}

/// Whether all its own values are ASCII. Letters after an escape sequence have seven bits and are
/// none.
fn ascii(set: &DataSet) -> bool {
    set.elements().iter().all(|e| match &e.value {
        Value::Bytes(bytes) => is_plain(bytes),
        _ => true,
    })
}

/// Whether bytes are ASCII and hold no escape sequence.
fn is_plain(bytes: &[u8]) -> bool {
    bytes.iter().all(|b| b.is_ascii() && *b != ESCAPE)
}

/// Question marks for letters beyond ASCII, also in sequences.
pub(crate) fn plain(set: &mut DataSet) {
    for element in set.elements().to_vec() {
        let value = match element.value {
            Value::Bytes(bytes) if is_text(element.vr) && !is_plain(&bytes) => {
                Value::Bytes(question_marks(&bytes))
            }
            Value::Items(mut items) => {
                items.iter_mut().for_each(plain);
                Value::Items(items)
            }
            other => other,
        };
        set.put(element.tag, element.vr, value);
    }
}

/// Puts texts that are the object's own.
pub(crate) fn put_texts(set: &mut DataSet, texts: &[(Tag, VR, &str)]) {
    for (tag, vr, text) in texts {
        set.put_text(*tag, *vr, text);
    }
}

/// Refuses an object of another patient than the CT: it would be written under the CT's name. An
/// object for a CT that was de-identified comes here as its `for_export` left it.
///
/// # Errors
/// When both name a patient and not the same, or the CT is de-identified and the object is not.
pub(crate) fn same_patient(file: &str, header: &DataSet, ct: &Source) -> Result<(), Error> {
    let both = [header, &ct.slices[0].header];
    let [a, b] = both.map(|h| h.text(tags::PATIENT_ID));
    if a == b && !a.is_empty() {
        return Ok(());
    }
    // Without numbers that agree, names and UIDs of a patient could go into what no longer names
    // her.
    let [given, wanted] = both.map(|h| h.text(tags::PATIENT_IDENTITY_REMOVED) == "YES");
    if wanted && !given {
        let reason = "is not YES as in the CT: the CT is de-identified, this is not";
        return Err(Error::attribute(file, "Patient Identity Removed", reason));
    }
    if a.is_empty() || b.is_empty() {
        return Ok(());
    }
    Err(Error::attribute(file, "Patient ID", "is not that of the CT: it is of another patient"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A structure set with one region, called 腫瘍 in ISO-2022-JP.
    fn japanese() -> DataSet {
        let mut roi = DataSet::default();
        roi.put(tags::ROI_NAME, VR::LO, Value::Bytes(b"\x1b$B<pag\x1b(B ".to_vec()));
        let mut set = DataSet::default();
        set.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, "\\ISO 2022 IR 87");
        set.put(tags::STRUCTURE_SET_ROI_SEQUENCE, VR::SQ, Value::Items(vec![roi]));
        set
    }

    #[test]
    fn names_of_seven_bits_behind_an_escape_keep_their_character_set() {
        let (from, names) = (japanese(), [tags::STRUCTURE_SET_ROI_SEQUENCE]);
        let ct = |name: &[u8]| {
            let mut set = DataSet::default();
            set.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, "ISO_IR 100");
            set.put(tags::PATIENT_NAME, VR::PN, Value::Bytes(name.to_vec()));
            set
        };
        let (mut set, mut warnings) = (ct(b"Doe^Jane"), Vec::new());
        assert!(!characters(&mut set, &from, &names, &mut warnings) && warnings.is_empty());
        assert_eq!(set.text(tags::SPECIFIC_CHARACTER_SET), "\\ISO 2022 IR 87");
        // Bytes that are no text of the set that is named, and a set that is misspelt.
        let named = |charset: &str, name: &[u8]| {
            let mut roi = DataSet::default();
            roi.put(tags::ROI_NAME, VR::LO, Value::Bytes(name.to_vec()));
            let mut set = DataSet::default();
            set.put_text(tags::SPECIFIC_CHARACTER_SET, VR::CS, charset);
            set.put_items(tags::STRUCTURE_SET_ROI_SEQUENCE, vec![roi]);
            set
        };
        let mut set = ct(b"Doe^Jane");
        let odd = named("ISO_IR 100", b"Brust\x92s GTV");
        assert!(characters(&mut set, &odd, &names, &mut warnings) && warnings.len() == 1);
        warnings.clear();
        let misspelt = named("ISO-IR 192", "Brüste".as_bytes());
        assert!(!characters(&mut set, &misspelt, &names, &mut warnings) && warnings.is_empty());
        assert_eq!(set.text(tags::SPECIFIC_CHARACTER_SET), "ISO_IR 192");
        // Where the patient's own name needs the other set, that is told, and no code is left.
        let mut set = ct(b"M\xfcller^Eva");
        assert!(characters(&mut set, &from, &names, &mut warnings) && warnings.len() == 1);
        let mut plain_set = from;
        plain(&mut plain_set);
        let roi = &plain_set.items(tags::STRUCTURE_SET_ROI_SEQUENCE)[0];
        assert_eq!(roi.text(tags::ROI_NAME), "??");
    }
}

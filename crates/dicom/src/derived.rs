//! What every object that is made here says of its patient, its study and its maker.

use crate::clock::Clock;
use crate::data_set::{DataSet, Element, Value};
use crate::error::Error;
use crate::number::{DS_LENGTH, format_ds, parse_ds, parse_is};
use crate::pixel_format::Frame;
use crate::source::{Source, SourceSlice};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;

/// Copied from the first slice: the same patient and study.
pub(crate) const PATIENT_AND_STUDY: &[Tag] = &[
    tags::SPECIFIC_CHARACTER_SET,
    tags::PATIENT_NAME,
    tags::PATIENT_ID,
    tags::ISSUER_OF_PATIENT_ID,
    tags::PATIENT_BIRTH_DATE,
    tags::PATIENT_SEX,
    tags::PATIENT_AGE,
    tags::PATIENT_SIZE,
    tags::PATIENT_WEIGHT,
    tags::PATIENT_IDENTITY_REMOVED,
    tags::DEIDENTIFICATION_METHOD,
    tags::DEIDENTIFICATION_METHOD_CODE_SEQUENCE,
    tags::LONGITUDINAL_TEMPORAL_INFORMATION_MODIFIED,
    tags::STUDY_INSTANCE_UID,
    tags::STUDY_DATE,
    tags::STUDY_TIME,
    tags::STUDY_ID,
    tags::STUDY_DESCRIPTION,
    tags::ACCESSION_NUMBER,
    tags::REFERRING_PHYSICIAN_NAME,
];

/// Required of every object, if need be without a value (type 2).
pub(crate) const REQUIRED_OF_ALL: &[(Tag, VR)] = &[
    (tags::PATIENT_NAME, VR::PN),
    (tags::PATIENT_ID, VR::LO),
    (tags::PATIENT_BIRTH_DATE, VR::DA),
    (tags::PATIENT_SEX, VR::CS),
    (tags::STUDY_DATE, VR::DA),
    (tags::STUDY_TIME, VR::TM),
    (tags::STUDY_ID, VR::SH),
    (tags::ACCESSION_NUMBER, VR::SH),
    (tags::REFERRING_PHYSICIAN_NAME, VR::PN),
    (tags::POSITION_REFERENCE_INDICATOR, VR::LO),
];

/// Puts the elements that are missing, without a value.
pub(crate) fn put_missing(set: &mut DataSet, required: &[(Tag, VR)]) {
    for &(tag, vr) in required {
        if set.get(tag).is_none() {
            set.put_text(tag, vr, "");
        }
    }
}

/// Series Number of a header, if it has one.
pub(crate) fn own_number(header: &DataSet) -> Option<i64> {
    parse_is(&header.text(tags::SERIES_NUMBER)).filter(|n| (0..100_000).contains(n))
}

/// Once compressed with loss, always compressed with loss (PS3.3 C.7.6.1.1.5).
pub(crate) fn put_lossy(set: &mut DataSet, source: &Source) {
    let lossy = source.slices.iter().find(|s| s.slice.lossy);
    set.put_text(tags::LOSSY_IMAGE_COMPRESSION, VR::CS, if lossy.is_some() { "01" } else { "00" });
    if let Some(slice) = lossy {
        copy(set, tags::LOSSY_IMAGE_COMPRESSION_RATIO, &slice.header);
        copy(set, tags::LOSSY_IMAGE_COMPRESSION_METHOD, &slice.header);
    }
}

/// The object that a header is of (PS3.3 10.8).
pub(crate) fn instance_reference(header: &DataSet) -> DataSet {
    let mut item = DataSet::default();
    let text = |tag| header.text(tag);
    item.put_text(tags::REFERENCED_SOP_CLASS_UID, VR::UI, &text(tags::SOP_CLASS_UID));
    item.put_text(tags::REFERENCED_SOP_INSTANCE_UID, VR::UI, &text(tags::SOP_INSTANCE_UID));
    item
}

/// The image that a slice of the source is, or the frame of one (PS3.3 10.3).
pub(crate) fn image_reference(source: &SourceSlice) -> DataSet {
    let mut item = instance_reference(&source.header);
    if source.slice.frame != Frame::ONLY {
        let number = (source.slice.frame.index + 1).to_string();
        item.put_text(tags::REFERENCED_FRAME_NUMBER, VR::IS, &number);
    }
    item
}

/// An item of a code sequence (PS3.16 section 7).
pub(crate) fn code(scheme: &str, value: &str, meaning: &str) -> DataSet {
    let mut item = DataSet::default();
    item.put_text(tags::CODE_VALUE, VR::SH, value);
    item.put_text(tags::CODING_SCHEME_DESIGNATOR, VR::SH, scheme);
    item.put_text(tags::CODE_MEANING, VR::LO, meaning);
    item
}

/// Copies an element that has a value, byte for byte; a decimal string that is too long is written
/// anew, since readers may cut it.
pub(crate) fn copy(set: &mut DataSet, tag: Tag, from: &DataSet) {
    let Some(Element { vr, value, .. }) = from.get(tag) else { return };
    match value {
        Value::Bytes(bytes) if bytes.iter().all(|b| matches!(b, b' ' | 0)) && *vr != VR::US => {}
        Value::Bytes(_) if *vr == VR::DS => {
            let fitting = |text: String| match parse_ds(&text) {
                Some(number) if text.len() > DS_LENGTH => format_ds(number),
                _ => text,
            };
            let texts: Vec<String> = from.texts(tag).into_iter().map(fitting).collect();
            set.put_text(tag, VR::DS, &texts.join("\\"));
        }
        Value::Items(items) if items.is_empty() => {}
        _ => set.put(tag, *vr, value.clone()),
    }
}

/// A text that has to fit its attribute in any character set.
pub(crate) fn check_text(
    attribute: &'static str,
    text: &str,
    longest: usize,
    ok: bool,
) -> Result<(), Error> {
    let fail = |reason: String| Err(Error::Text { attribute, reason });
    if !text.is_ascii() || text.chars().any(|c| c.is_ascii_control()) {
        return fail("only printable ASCII fits every character set".into());
    }
    if text.len() > longest {
        return fail(format!("{} characters, {longest} fit", text.len()));
    }
    if ok { Ok(()) } else { fail(format!("{text:?} does not have the required form")) }
}

/// Date and time must have the form of DA and TM.
pub(crate) fn check_clock(clock: &Clock) -> Result<(), Error> {
    let digits = |text: &str, n| text.len() == n && text.bytes().all(|b| b.is_ascii_digit());
    check_text("Content Date", &clock.date, 8, digits(&clock.date, 8))?;
    check_text("Content Time", &clock.time, 6, digits(&clock.time, 6))
}

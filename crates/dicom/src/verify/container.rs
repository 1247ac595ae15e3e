//! Rules A: files, forms of values, character sets.

use super::{Checks, Image};
use crate::character_set;
use crate::data_set::{DataSet, Element, Value, dictionary_vr};
use crate::form;
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::collections::BTreeSet;

pub(super) fn check(checks: &mut Checks, images: &[Image], unreadable: &[String]) {
    let mut faults = unreadable.to_vec();
    let bare = images.iter().filter(|i| !i.preamble);
    faults.extend(bare.map(|i| format!("{}: no preamble (PS3.10 7.1)", i.file)));
    if images.is_empty() {
        faults.push("no CT image".into());
    }
    checks.none_of("A1 every file is a DICOM file (PS3.10) with a CT image", &faults);
    if images.is_empty() {
        return;
    }
    checks.none_of(
        "A2 file header and data set agree: CT Image Storage, Explicit VR Little Endian",
        &images.iter().flat_map(header_faults).collect::<Vec<_>>(),
    );
    let mut seen = BTreeSet::new();
    let repeated: Vec<String> = images
        .iter()
        .filter(|i| !seen.insert(i.text(tags::SOP_INSTANCE_UID)))
        .map(|i| format!("{} repeats one", i.file))
        .collect();
    checks.none_of("A3 SOP Instance UIDs are unique", &repeated);
    let mut faults = Vec::new();
    for image in images {
        let utf8 = image.text(tags::SPECIFIC_CHARACTER_SET) == "ISO_IR 192";
        form_faults(&image.set, utf8, &image.file, &mut faults);
    }
    checks.none_of("A4 values have the length and form of their VR (PS3.5 6.2)", &faults);
    check_text(checks, images);
}

fn header_faults(image: &Image) -> Vec<String> {
    let (meta, set) = (&image.meta, &image.set);
    let class = set.text(tags::SOP_CLASS_UID);
    let mut faults = Vec::new();
    let mut fault = |wrong: bool, what: &str| {
        if wrong {
            faults.push(format!("{}: {what}", image.file));
        }
    };
    fault(image.syntax != uids::EXPLICIT_VR_LITTLE_ENDIAN, "another transfer syntax");
    let header_instance = meta.text(tags::MEDIA_STORAGE_SOP_INSTANCE_UID);
    fault(header_instance != set.text(tags::SOP_INSTANCE_UID), "the header names another instance");
    fault(meta.text(tags::MEDIA_STORAGE_SOP_CLASS_UID) != class, "the header names another class");
    fault(class != uids::CT_IMAGE_STORAGE, "the SOP Class is not CT Image Storage");
    fault(set.text(tags::MODALITY) != "CT", "the Modality is not CT");
    faults
}

/// Every value of a data set, sequences included.
fn form_faults(set: &DataSet, utf8: bool, file: &str, found: &mut Vec<String>) {
    for element in set.elements() {
        match &element.value {
            Value::Items(items) => {
                items.iter().for_each(|item| form_faults(item, utf8, file, found));
            }
            Value::Bytes(bytes) => {
                if let Some(fault) = value_fault(element, bytes, utf8) {
                    found.push(format!("{file}: {} {} {fault}", element.tag, element.vr));
                }
            }
            Value::Fragments(_) => found.push(format!("{file}: {} is encapsulated", element.tag)),
        }
    }
}

fn value_fault(element: &Element, bytes: &[u8], utf8: bool) -> Option<String> {
    let vr = element.vr;
    if bytes.len() % 2 == 1 {
        return Some("has an odd length".into());
    }
    let known = dictionary_vr(element.tag);
    let ambiguous = matches!(known, VR::UN | VR::US | VR::SS | VR::OW | VR::OB);
    if known != vr && !ambiguous {
        return Some(format!("should be {known}"));
    }
    let longest = match vr {
        VR::ST => return (bytes.len() > 1024).then(|| "is longer than 1024".into()),
        VR::LT => return (bytes.len() > 10240).then(|| "is longer than 10240".into()),
        // Exported as the source has it, however long: archives find the patient by it.
        _ if element.tag == tags::PATIENT_ID => usize::MAX,
        _ => form::longest(vr)?,
    };
    let text: String = if utf8 {
        String::from_utf8_lossy(bytes).into_owned()
    } else {
        bytes.iter().map(|&b| char::from(b)).collect()
    };
    text.split('\\').find_map(|value| form::fault(vr, value, longest))
}

fn check_text(checks: &mut Checks, images: &[Image]) {
    let rule = "A5 texts fit the Specific Character Set";
    let mut faults = Vec::new();
    for image in images {
        let sets = image.text(tags::SPECIFIC_CHARACTER_SET);
        if !character_set::is_known(&sets) {
            return checks.skip(rule, &format!("{sets} is not known here"));
        }
        text_faults(&image.set, &sets, &image.file, &mut faults);
    }
    checks.none_of(rule, &faults);
}

fn text_faults(set: &DataSet, sets: &str, file: &str, found: &mut Vec<String>) {
    for element in set.elements() {
        match &element.value {
            Value::Items(items) => {
                items.iter().for_each(|item| text_faults(item, sets, file, found));
            }
            Value::Bytes(bytes) => {
                if form::has_letters(element.vr) && !character_set::holds(sets, bytes) {
                    found.push(format!("{file}: {}", element.tag));
                }
            }
            Value::Fragments(_) => {}
        }
    }
}

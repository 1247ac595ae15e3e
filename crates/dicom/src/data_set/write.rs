//! Explicit VR Little Endian (PS3.5 section 7) and the file format around it (PS3.10 section 7).

use super::parse::has_long_length;
use super::{DataSet, Value};
use crate::uid::IMPLEMENTATION_CLASS;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};

/// The data set in Explicit VR Little Endian, sequences with stated lengths.
pub(crate) fn encode(set: &DataSet) -> Vec<u8> {
    let mut out = Vec::with_capacity(set.held());
    put_set(&mut out, set);
    out
}

/// A whole file: preamble, file header with this Implementation Version Name, data set.
pub(crate) fn part10(set: &DataSet, version: &str) -> Vec<u8> {
    let (class, instance) = (set.text(tags::SOP_CLASS_UID), set.text(tags::SOP_INSTANCE_UID));
    let mut out = part10_head(&class, &instance, uids::EXPLICIT_VR_LITTLE_ENDIAN, version);
    out.reserve(set.held());
    put_set(&mut out, set);
    out
}

/// What stands before a data set: preamble, marker and file header (PS3.10 7.1).
pub(crate) fn part10_head(class: &str, instance: &str, syntax: &str, version: &str) -> Vec<u8> {
    let mut meta = DataSet::default();
    meta.put(Tag(2, 1), VR::OB, Value::Bytes(vec![0, 1]));
    meta.put_text(tags::MEDIA_STORAGE_SOP_CLASS_UID, VR::UI, class);
    meta.put_text(tags::MEDIA_STORAGE_SOP_INSTANCE_UID, VR::UI, instance);
    meta.put_text(tags::TRANSFER_SYNTAX_UID, VR::UI, syntax);
    meta.put_text(tags::IMPLEMENTATION_CLASS_UID, VR::UI, IMPLEMENTATION_CLASS);
    meta.put_text(tags::IMPLEMENTATION_VERSION_NAME, VR::SH, version);
    let meta = encode(&meta);
    let mut group_length = DataSet::default();
    let length = (meta.len() as u32).to_le_bytes().to_vec();
    group_length.put(Tag(2, 0), VR::UL, Value::Bytes(length));
    let mut out = vec![0; 128];
    out.extend_from_slice(b"DICM");
    put_set(&mut out, &group_length);
    out.extend_from_slice(&meta);
    out
}

fn put_set(out: &mut Vec<u8>, set: &DataSet) {
    for element in set.elements() {
        match &element.value {
            Value::Bytes(bytes) => {
                put_header(out, element.tag, element.vr, bytes.len() + bytes.len() % 2);
                out.extend_from_slice(bytes);
                if bytes.len() % 2 == 1 {
                    out.push(pad(element.vr));
                }
            }
            Value::Items(items) => {
                let mut inner = Vec::new();
                for item in items {
                    let start = inner.len();
                    put_delimiter(&mut inner, 0xE000, 0);
                    put_set(&mut inner, item);
                    let length = (inner.len() - start - 8) as u32;
                    inner[start + 4..start + 8].copy_from_slice(&length.to_le_bytes());
                }
                put_header(out, element.tag, VR::SQ, inner.len());
                out.extend_from_slice(&inner);
            }
            Value::Fragments(fragments) => {
                put_header(out, element.tag, VR::OB, u32::MAX as usize);
                for fragment in fragments {
                    put_delimiter(out, 0xE000, fragment.len() + fragment.len() % 2);
                    out.extend_from_slice(fragment);
                    out.extend(std::iter::repeat_n(0, fragment.len() % 2));
                }
                put_delimiter(out, 0xE0DD, 0);
            }
        }
    }
}

/// The byte that makes a value's length even (PS3.5 6.2).
pub(super) fn pad(vr: VR) -> u8 {
    if matches!(vr, VR::UI | VR::OB | VR::UN) { 0 } else { b' ' }
}

fn put_header(out: &mut Vec<u8>, tag: Tag, vr: VR, length: usize) {
    out.extend_from_slice(&tag.0.to_le_bytes());
    out.extend_from_slice(&tag.1.to_le_bytes());
    // A text too long for the 16-bit length of its VR travels as UN (PS3.5 6.2.2).
    let vr = if !has_long_length(vr) && length > usize::from(u16::MAX) { VR::UN } else { vr };
    out.extend_from_slice(&vr.to_bytes());
    if has_long_length(vr) {
        out.extend_from_slice(&[0, 0]);
        out.extend_from_slice(&(length as u32).to_le_bytes());
    } else {
        out.extend_from_slice(&(length as u16).to_le_bytes());
    }
}

pub(super) fn put_delimiter(out: &mut Vec<u8>, element: u16, length: usize) {
    out.extend_from_slice(&0xFFFEu16.to_le_bytes());
    out.extend_from_slice(&element.to_le_bytes());
    out.extend_from_slice(&(length as u32).to_le_bytes());
}

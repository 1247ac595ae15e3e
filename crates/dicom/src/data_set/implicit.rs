//! Implicit VR Little Endian (PS3.5 A.1), the default transfer syntax that every archive takes.

use super::parse::UNDEFINED;
use super::write::{pad, put_delimiter};
use super::{DataSet, Value, dictionary_vr};
use crate::whole_file::is_text;
use dicom_core::dictionary::{DataDictionary as _, DataDictionaryEntry as _, VirtualVr};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::StandardDataDictionary;

/// The data set in Implicit VR Little Endian; [`can_be_implicit`] tells whether it keeps its
/// meaning.
///
/// A sequence that the dictionary does not know has no stated length: its delimiters are what tells
/// a reader that it is one (PS3.5 6.2.2).
pub(crate) fn encode_implicit(set: &DataSet) -> Vec<u8> {
    let mut out = Vec::new();
    put_set(&mut out, set);
    out
}

/// Why a data set would lose its meaning without its value representations; nothing when it would
/// not.
///
/// A reader takes the VR of a public element from the dictionary, so it has to be the same there.
/// That of a private element is lost by this syntax, as the standard has it; its bytes stay.
pub(crate) fn can_be_implicit(set: &DataSet) -> Result<(), String> {
    for element in set.elements() {
        let tag = element.tag;
        if matches!(element.value, Value::Fragments(_)) {
            return Err("its pixels are compressed".into());
        }
        if !is_read_as(tag, element.vr) {
            let vr = element.vr.to_string();
            return Err(format!("{tag} is {vr} in it, against the standard's dictionary"));
        }
        if let Value::Items(items) = &element.value {
            items.iter().try_for_each(can_be_implicit)?;
        }
    }
    Ok(())
}

/// Whether a reader that knows the dictionary alone takes a value for what it is.
fn is_read_as(tag: Tag, vr: VR) -> bool {
    let private = tag.0 % 2 == 1;
    let Some(entry) = StandardDataDictionary.by_tag(tag).filter(|_| !private) else { return true };
    match entry.vr() {
        VirtualVr::Exact(known) => {
            let both = |kind: fn(VR) -> bool| kind(vr) && kind(known);
            vr == known || vr == VR::UN || both(is_text) || both(is_raw)
        }
        // One of several, told by Pixel Representation or Bits Allocated; not a sequence or a text.
        _ => matches!(vr, VR::US | VR::SS | VR::UN) || is_raw(vr),
    }
}

fn is_raw(vr: VR) -> bool {
    matches!(vr, VR::OB | VR::OW)
}

fn put_set(out: &mut Vec<u8>, set: &DataSet) {
    for element in set.elements() {
        match &element.value {
            Value::Bytes(bytes) => {
                let odd = bytes.len() % 2;
                put_header(out, element.tag, (bytes.len() + odd) as u32);
                out.extend_from_slice(bytes);
                out.extend(std::iter::repeat_n(pad(element.vr), odd));
            }
            Value::Items(items) if dictionary_vr(element.tag) == VR::SQ => {
                stating_length(out, element.tag, |out| {
                    for item in items {
                        stating_length(out, Tag(0xFFFE, 0xE000), |out| put_set(out, item));
                    }
                });
            }
            Value::Items(items) => {
                put_header(out, element.tag, UNDEFINED);
                for item in items {
                    put_delimiter(out, 0xE000, UNDEFINED as usize);
                    put_set(out, item);
                    put_delimiter(out, 0xE00D, 0);
                }
                put_delimiter(out, 0xE0DD, 0);
            }
            // Excluded by `can_be_implicit`.
            Value::Fragments(_) => {}
        }
    }
}

fn put_header(out: &mut Vec<u8>, tag: Tag, length: u32) {
    out.extend_from_slice(&tag.0.to_le_bytes());
    out.extend_from_slice(&tag.1.to_le_bytes());
    out.extend_from_slice(&length.to_le_bytes());
}

/// What `put` puts, behind a header with its length.
fn stating_length(out: &mut Vec<u8>, tag: Tag, put: impl FnOnce(&mut Vec<u8>)) {
    put_header(out, tag, 0);
    let start = out.len();
    put(out);
    let length = (out.len() - start) as u32;
    out[start - 4..start].copy_from_slice(&length.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_set::{Encoding, Until, parse};
    use dicom_dictionary_std::tags;
    use proptest::prelude::*;

    fn back(set: &DataSet) -> DataSet {
        let bytes = encode_implicit(set);
        let encoding = Encoding { explicit: false, big_endian: false };
        parse(&bytes, bytes.len(), 0, encoding, Until::End).unwrap().set
    }

    /// The tags and bytes, as far down as there are items: what is the same in every syntax.
    fn shape(set: &DataSet) -> String {
        let of = |value: &Value| match value {
            Value::Bytes(bytes) => format!("{bytes:?}"),
            Value::Items(items) => {
                items.iter().map(|item| format!("{{{}}}", shape(item))).collect()
            }
            Value::Fragments(_) => panic!("no fragments"),
        };
        set.elements().iter().map(|e| format!("{} {}\n", e.tag, of(&e.value))).collect()
    }

    fn private(set: &mut DataSet) {
        set.put_text(Tag(0x0029, 0x0010), VR::LO, "SOMEBODY");
        set.put(Tag(0x0029, 0x1001), VR::FD, Value::Bytes(vec![1, 2, 3, 4, 5, 6, 7, 8]));
    }

    #[test]
    fn private_sequences_stay_sequences_and_unknown_bytes_stay_bytes() {
        let mut item = DataSet::default();
        private(&mut item);
        let mut set = DataSet::default();
        private(&mut set);
        set.put_items(Tag(0x0029, 0x1002), vec![item.clone(), DataSet::default()]);
        set.put_items(Tag(0x0029, 0x1003), vec![]);
        set.put_items(tags::REFERENCED_STUDY_SEQUENCE, vec![item, DataSet::default()]);
        set.put_items(tags::REFERENCED_SERIES_SEQUENCE, vec![]);
        set.put(Tag(0x0029, 0x1004), VR::UN, Value::Bytes(vec![0; 70_000]));
        set.put(tags::PIXEL_DATA, VR::OB, Value::Bytes(vec![7; 6]));
        assert_eq!(can_be_implicit(&set), Ok(()));
        assert_eq!(shape(&back(&set)), shape(&set));
    }

    #[test]
    fn a_vr_against_the_dictionary_would_be_lost() {
        let with = |tag, vr| {
            let mut set = DataSet::default();
            set.put(tag, vr, Value::Bytes(vec![0; 8]));
            let mut outer = DataSet::default();
            outer.put_items(tags::REFERENCED_STUDY_SEQUENCE, vec![set]);
            can_be_implicit(&outer)
        };
        assert!(with(tags::SLICE_THICKNESS, VR::FD).unwrap_err().contains("FD"));
        assert!(with(tags::ROWS, VR::SS).is_err());
        assert!(with(tags::SERIES_DESCRIPTION, VR::SQ).is_err());
        assert!(with(tags::PIXEL_PADDING_VALUE, VR::SS).is_ok(), "US or SS");
        assert!(with(tags::PIXEL_DATA, VR::OB).is_ok(), "OB or OW");
        assert!(with(tags::SERIES_DESCRIPTION, VR::UT).is_ok(), "text is text");
        assert!(with(tags::SLICE_THICKNESS, VR::UN).is_ok(), "bytes of the element");
        assert!(with(Tag(0x0029, 0x1001), VR::FD).is_ok(), "private");
    }

    fn sets() -> impl Strategy<Value = DataSet> {
        let tag = prop_oneof![
            Just(tags::SERIES_DESCRIPTION),
            Just(tags::REFERENCED_STUDY_SEQUENCE),
            Just(Tag(0x0029, 0x1001)),
            Just(Tag(0x0029, 0x1002)),
            Just(tags::PIXEL_DATA),
        ];
        let even = |bytes: Vec<u8>| bytes.iter().flat_map(|b| [*b, 0]).collect::<Vec<u8>>();
        let bytes = proptest::collection::vec(any::<u8>(), 0..20).prop_map(even);
        let flat = proptest::collection::vec((tag, bytes), 0..5).prop_map(|all| {
            let mut set = DataSet::default();
            for (tag, bytes) in all {
                if dictionary_vr(tag) != VR::SQ {
                    set.put(tag, VR::UN, Value::Bytes(bytes));
                }
            }
            set
        });
        flat.prop_recursive(4, 40, 3, |inner| {
            let tag =
                prop_oneof![Just(tags::REFERENCED_STUDY_SEQUENCE), Just(Tag(0x0029, 0x1002)),];
            (tag, proptest::collection::vec(inner.clone(), 0..3), inner).prop_map(
                |(tag, items, mut set)| {
                    set.put_items(tag, items);
                    set
                },
            )
        })
    }

    proptest! {
        #[test]
        fn nothing_is_lost_at_any_depth(set in sets()) {
            prop_assert_eq!(shape(&back(&set)), shape(&set));
        }
    }
}

//! A DICOM data set whose values are the bytes of the file.
//!
//! Geometry and identity have to be repeated in an export exactly as they were written, and a check
//! has to see the bytes as they are; so values stay bytes (little endian) until someone asks.

mod file;
mod implicit;
mod parse;
mod syntax;
mod write;

pub(crate) use file::{Container, OpenError};
pub(crate) use implicit::{can_be_implicit, encode_implicit};
pub(crate) use parse::{Encoding, Parsed, Until, dictionary_vr, parse};
pub(crate) use syntax::{PixelCoding, TransferSyntax};
pub(crate) use write::{encode, part10, part10_head};

use dicom_core::{Tag, VR};

/// The elements of a data set or sequence item, ascending by tag, no tag twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DataSet {
    elements: Vec<Element>,
}

/// One data element.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Element {
    pub(crate) tag: Tag,
    pub(crate) vr: VR,
    pub(crate) value: Value,
}

/// The value of an element.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// As in the file, numbers in little endian, padding included.
    Bytes(Vec<u8>),
    /// The items of a sequence.
    Items(Vec<DataSet>),
    /// Encapsulated pixel data: offset table first, then the fragments.
    Fragments(Vec<Vec<u8>>),
}

impl DataSet {
    /// The elements, ascending by tag.
    pub(crate) fn elements(&self) -> &[Element] {
        &self.elements
    }

    /// Bytes of memory that a copy takes, about. Nesting is bounded where a file is walked.
    pub(crate) fn held(&self) -> usize {
        let value = |value: &Value| match value {
            Value::Bytes(bytes) => bytes.len(),
            Value::Items(items) => items.iter().map(|i| size_of::<Self>() + i.held()).sum(),
            Value::Fragments(all) => all.iter().map(|f| size_of::<Vec<u8>>() + f.len()).sum(),
        };
        self.elements.iter().map(|e| size_of::<Element>() + value(&e.value)).sum()
    }

    pub(crate) fn get(&self, tag: Tag) -> Option<&Element> {
        self.elements.binary_search_by_key(&tag, |e| e.tag).ok().map(|at| &self.elements[at])
    }

    /// The bytes of a value; `None` for sequences, fragments and missing elements.
    pub(crate) fn bytes(&self, tag: Tag) -> Option<&[u8]> {
        match &self.get(tag)?.value {
            Value::Bytes(bytes) => Some(bytes),
            _ => None,
        }
    }

    /// The items of a sequence; none when it is missing.
    pub(crate) fn items(&self, tag: Tag) -> &[DataSet] {
        match self.get(tag).map(|e| &e.value) {
            Some(Value::Items(items)) => items,
            _ => &[],
        }
    }

    /// The value as text without padding; empty when missing.
    pub(crate) fn text(&self, tag: Tag) -> String {
        text_of(self.bytes(tag).unwrap_or_default())
    }

    /// The values of a multi-valued text, each without padding; none when missing or empty.
    pub(crate) fn texts(&self, tag: Tag) -> Vec<String> {
        let text = self.text(tag);
        if text.is_empty() {
            Vec::new()
        } else {
            text.split('\\').map(|part| part.trim_matches([' ', '\0']).to_owned()).collect()
        }
    }

    /// The first 16-bit number of a value.
    pub(crate) fn u16(&self, tag: Tag) -> Option<u16> {
        let bytes = self.bytes(tag)?;
        Some(u16::from_le_bytes([*bytes.first()?, *bytes.get(1)?]))
    }

    /// Puts an element, in place of one with the same tag.
    pub(crate) fn put(&mut self, tag: Tag, vr: VR, value: Value) {
        let element = Element { tag, vr, value };
        match self.elements.binary_search_by_key(&tag, |e| e.tag) {
            Ok(at) => self.elements[at] = element,
            Err(at) => self.elements.insert(at, element),
        }
    }

    /// Puts a text, padded to even length (UI with NUL, all else with a space).
    pub(crate) fn put_text(&mut self, tag: Tag, vr: VR, text: &str) {
        let mut bytes = text.as_bytes().to_vec();
        if bytes.len() % 2 == 1 {
            bytes.push(if vr == VR::UI { 0 } else { b' ' });
        }
        self.put(tag, vr, Value::Bytes(bytes));
    }

    /// Puts one 16-bit number.
    pub(crate) fn put_u16(&mut self, tag: Tag, vr: VR, number: u16) {
        self.put(tag, vr, Value::Bytes(number.to_le_bytes().to_vec()));
    }

    /// Puts a sequence.
    pub(crate) fn put_items(&mut self, tag: Tag, items: Vec<DataSet>) {
        self.put(tag, VR::SQ, Value::Items(items));
    }

    /// A copy that lacks an element.
    pub(crate) fn without(&self, tag: Tag) -> Self {
        Self { elements: self.elements.iter().filter(|e| e.tag != tag).cloned().collect() }
    }

    /// Takes an element out.
    pub(crate) fn remove(&mut self, tag: Tag) -> Option<Element> {
        let at = self.elements.binary_search_by_key(&tag, |e| e.tag).ok()?;
        Some(self.elements.remove(at))
    }

    /// A data set of elements in any order; the tag that is there twice on failure.
    fn from_elements(mut elements: Vec<Element>) -> Result<Self, Tag> {
        if !elements.is_sorted_by_key(|e| e.tag) {
            elements.sort_by_key(|e| e.tag);
        }
        match elements.windows(2).find(|pair| pair[0].tag == pair[1].tag) {
            Some(pair) => Err(pair[0].tag),
            None => Ok(Self { elements }),
        }
    }
}

/// Text without padding: UTF-8 where it is that, else one character per byte.
pub(crate) fn text_of(bytes: &[u8]) -> String {
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    };
    text.trim_matches([' ', '\0']).to_owned()
}

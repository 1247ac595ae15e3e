//! Names of labels in a header extension.
//!
//! Facts: TotalSegmentator (`nifti_ext_header.py`) and Connectome Workbench write an extension
//! whose text is a `CaretExtension` in XML; `Label` elements with the attribute `Key` hold the
//! names.

use crate::{Problem, labels::segments::Segment};
use quick_xml::{Reader, events::Event};

/// Bytes of a NIfTI-1 header with the four that announce extensions.
const START: usize = 352;

/// The segments that the bytes ahead of the samples name.
pub(super) fn segments(ahead: &[u8], big_endian: bool) -> Result<Vec<Segment>, Problem> {
    let mut segments = Vec::new();
    for text in extensions(ahead, big_endian) {
        if text.windows(11).any(|w| w == b"<LabelTable") {
            segments.extend(table(text)?);
        }
    }
    Ok(segments)
}

/// The contents of the extensions, as far as their sizes make sense.
pub(super) fn extensions(ahead: &[u8], big_endian: bool) -> Vec<&[u8]> {
    let mut extensions = Vec::new();
    if ahead.get(START - 4).is_none_or(|&flag| flag == 0) {
        return extensions;
    }
    let mut rest = &ahead[START.min(ahead.len())..];
    while let Some((size, _)) = rest.split_first_chunk() {
        let size = if big_endian { i32::from_be_bytes(*size) } else { i32::from_le_bytes(*size) };
        let size = usize::try_from(size).unwrap_or(0);
        let Some(content) = rest.get(8..size) else { break };
        extensions.push(content);
        rest = &rest[size..];
    }
    extensions
}

/// The labels of a table in XML; what follows its end is padding.
fn table(xml: &[u8]) -> Result<Vec<Segment>, Problem> {
    let mut reader = Reader::from_reader(xml);
    let mut segments = Vec::new();
    let mut key: Option<i16> = None;
    let mut name = String::new();
    loop {
        let event = reader
            .read_event()
            .map_err(|e| Problem::Xml { at: reader.error_position(), reason: e.to_string() })?;
        let unreadable = |e: String| Problem::field("LabelTable", e);
        match event {
            Event::Start(e) if e.local_name().as_ref() == b"Label" => {
                name.clear();
                key = None;
                for attribute in e.attributes() {
                    let attribute = attribute.map_err(|e| unreadable(e.to_string()))?;
                    if attribute.key.as_ref() == b"Key" {
                        let text = String::from_utf8_lossy(&attribute.value);
                        let wrong = |_| unreadable(format!("the key `{text}` is not a number"));
                        key = Some(text.trim().parse().map_err(wrong)?);
                    }
                }
            }
            Event::CData(e) => name.push_str(&String::from_utf8_lossy(&e)),
            Event::Text(e) => {
                name.push_str(&e.decode().map_err(|e| unreadable(e.to_string()))?);
            }
            Event::End(e) if e.local_name().as_ref() == b"Label" => {
                // Key 0 is the background.
                if let Some(value) = key.take().filter(|&value| value != 0) {
                    segments.push(Segment::new(name.trim(), None, 0, value));
                }
            }
            Event::End(e) if e.local_name().as_ref() == b"LabelTable" => break,
            Event::Eof => {
                return Err(unreadable("ends before its end".into()));
            }
            _ => {}
        }
    }
    Ok(segments)
}

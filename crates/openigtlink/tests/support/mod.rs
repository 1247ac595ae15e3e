//! The messages of `fixtures/openigtlink`, and reading whole messages.
#![allow(dead_code, reason = "each test file uses a part of it")]

use serde_json::Value;
use supine_openigtlink::{
    Attribute, BodyError, Content, HEADER_BYTES, Header, HeaderError, Message, PointItem,
    QuaternionTool, StatusCode, Tool, crc,
};

/// A line of the file of vectors.
pub(crate) struct Vector {
    pub(crate) id: String,
    pub(crate) source: String,
    pub(crate) version: u64,
    pub(crate) fields: Value,
    pub(crate) bytes: Vec<u8>,
}

impl Vector {
    /// Which one it is, for messages.
    pub(crate) fn name(&self) -> String {
        format!("{} v{} of {}", self.id, self.version, self.source)
    }

    /// Whether it is laid out as no specification has it.
    pub(crate) fn is_malformed(&self) -> bool {
        ["position_pyigtl_152", "polydata_vertices_le"].contains(&self.id.as_str())
    }
}

/// All lines, those without bytes too.
pub(crate) fn all_lines() -> Vec<Vector> {
    include_str!("../../../../fixtures/openigtlink/vectors.jsonl").lines().map(line).collect()
}

/// All messages.
pub(crate) fn vectors() -> Vec<Vector> {
    all_lines().into_iter().filter(|vector| !vector.bytes.is_empty()).collect()
}

fn line(line: &str) -> Vector {
    let mut value: Value = serde_json::from_str(line).expect("a line is JSON");
    let hex = value["hex"].as_str().expect("hex").as_bytes().to_vec();
    let digit = |c: u8| char::from(c).to_digit(16).expect("a hex digit") as u8;
    let bytes: Vec<u8> = hex.chunks(2).map(|two| digit(two[0]) << 4 | digit(two[1])).collect();
    assert_eq!(Some(bytes.len() as u64), value["bytes"].as_u64());
    let text = |key: &str| value[key].as_str().expect("text").to_owned();
    Vector {
        id: text("id"),
        source: text("source"),
        version: value["header_version"].as_u64().expect("a version"),
        bytes,
        fields: value["fields"].take(),
    }
}

/// What can be wrong with a message.
#[derive(Debug)]
pub(crate) enum Wrong {
    Short,
    Header(HeaderError),
    Body(BodyError),
}

impl Wrong {
    /// The STATUS code of the answer and whether the connection stays.
    pub(crate) fn answer(&self) -> (StatusCode, bool) {
        match self {
            Self::Short => panic!("not a message"),
            Self::Header(error) => (error.status_code(), error.keeps()),
            Self::Body(error) => (error.status_code(), error.keeps()),
        }
    }
}

/// Reads a message that has its whole body, and nothing after it.
pub(crate) fn read(bytes: &[u8]) -> Result<Message, Wrong> {
    let (head, body) = bytes.split_first_chunk::<HEADER_BYTES>().ok_or(Wrong::Short)?;
    let header = Header::read(head).map_err(Wrong::Header)?;
    Message::read(&header, body).map_err(Wrong::Body)
}

pub(crate) fn write(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.write(&mut bytes);
    bytes
}

/// A header of any fields before a body, with the right checksum.
pub(crate) fn raw(version: u16, kind: &[u8], body: &[u8]) -> Vec<u8> {
    let mut bytes = version.to_be_bytes().to_vec();
    bytes.extend(kind);
    bytes.resize(14, 0);
    bytes.extend(b"Applicator");
    bytes.resize(HEADER_BYTES, 0);
    bytes.extend(body);
    repair(&mut bytes);
    bytes
}

/// Puts size and checksum of a message right.
pub(crate) fn repair(bytes: &mut [u8]) {
    let Some((head, body)) = bytes.split_first_chunk_mut::<HEADER_BYTES>() else { return };
    head[42..50].copy_from_slice(&(body.len() as u64).to_be_bytes());
    head[50..].copy_from_slice(&crc::of(body).to_be_bytes());
}

/// Memory that a message holds on the heap, bytes.
pub(crate) fn held(message: &Message) -> usize {
    let entries = message.metadata.iter().map(|(key, value)| key.capacity() + value.capacity());
    let metadata = message.metadata.capacity() * size_of::<(String, String)>();
    message.device.capacity() + metadata + entries.sum::<usize>() + of_content(&message.content)
}

fn of_content(content: &Content) -> usize {
    match content {
        Content::Transform(_) | Content::Position(_) => 0,
        Content::Status(status) => status.name.capacity() + status.text.capacity(),
        Content::Points(items) => items.capacity() * size_of::<PointItem>(),
        Content::Text(text) => text.text.capacity(),
        Content::PolyData(data) => {
            let cells = [&data.vertices, &data.lines, &data.polygons, &data.strips];
            let cells: usize = cells.iter().map(|cells| cells.allocated()).sum();
            let values = data.attributes.iter().map(|a| size_of_val(a.values()) + a.name().len());
            let attributes = data.attributes.capacity() * size_of::<Attribute>();
            data.points.capacity() * 12 + cells + attributes + values.sum::<usize>()
        }
        Content::Image(image) => image.data().len(),
        Content::TrackingData(tools) => tools.capacity() * size_of::<Tool>(),
        Content::QuaternionTracking(tools) => tools.capacity() * size_of::<QuaternionTool>(),
        Content::Sensor(sensor) => sensor.values.capacity() * 8,
        Content::Capabilities(names) => {
            names.capacity() * size_of::<String>()
                + names.iter().map(String::capacity).sum::<usize>()
        }
        Content::Query(query) => query.of.capacity(),
        Content::Unknown { kind } => kind.capacity(),
    }
}

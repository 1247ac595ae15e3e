//! What a message says: one module for each type, each with its layout, read and written.

pub(crate) mod capability;
pub(crate) mod image;
pub(crate) mod point;
pub(crate) mod poly_data;
pub(crate) mod position;
pub(crate) mod query;
pub(crate) mod sensor;
pub(crate) mod status;
pub(crate) mod text;
pub(crate) mod tracking;
pub(crate) mod transform;

use crate::error::{BodyError, Refusal};
use crate::name::Name;
use image::Image;
use point::PointItem;
use poly_data::PolyData;
use position::Position;
use query::Query;
use sensor::Sensor;
use status::Status;
use text::Text;
use tracking::{QuaternionTool, Tool};

pub use transform::Rows;

/// What a message says. Lengths in mm, in the frame of the peer, which the wire does not name:
/// peers take all numbers as RAS. Only an image carries a flag.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// TRANSFORM: a pose; rows of the 3 x 4 matrix.
    Transform(Rows),
    /// POSITION: a place, perhaps with a rotation.
    Position(Position),
    /// STATUS: how the sender is, or what it thinks of a message.
    Status(Status),
    /// POINT: named points.
    Points(Vec<PointItem>),
    /// STRING: text.
    Text(Text),
    /// POLYDATA: a surface, or lines, or points.
    PolyData(PolyData),
    /// IMAGE: a volume or a part of it.
    Image(Image),
    /// TDATA: poses of tools, as matrices.
    TrackingData(Vec<Tool>),
    /// QTDATA: poses of tools, as quaternions.
    QuaternionTracking(Vec<QuaternionTool>),
    /// SENSOR: values with one unit.
    Sensor(Sensor),
    /// CAPABILITY: type names that the sender knows.
    Capabilities(Vec<String>),
    /// GET_, STT_, STP_ and RTS_ with a type.
    Query(Query),
    /// Any other type; its body is not kept. Answer STATUS 12.
    Unknown {
        /// The type name.
        kind: String,
    },
}

/// Type names of the contents, without those of queries.
pub(crate) const KINDS: [&str; 11] = [
    "TRANSFORM",
    "POSITION",
    "STATUS",
    "POINT",
    "STRING",
    "POLYDATA",
    "IMAGE",
    "TDATA",
    "QTDATA",
    "SENSOR",
    "CAPABILITY",
];

/// Another name of POSITION, of the specification only.
pub(crate) const POSITION_TOO: &str = "QTRANS";

/// Whether a type name is one that is read.
pub(crate) fn is_known(kind: &str) -> bool {
    KINDS.contains(&kind) || kind == POSITION_TOO || query::parts(kind).is_some()
}

impl Content {
    /// Reads the content of a type.
    pub(crate) fn read(kind: &str, bytes: &[u8]) -> Result<Self, BodyError> {
        Self::known(kind, bytes).map_err(|refusal| refusal.of(kind, bytes.len()))
    }

    fn known(kind: &str, bytes: &[u8]) -> Result<Self, Refusal> {
        Ok(match kind {
            "TRANSFORM" => Self::Transform(transform::read(bytes)?),
            "POSITION" | POSITION_TOO => Self::Position(Position::read(bytes)?),
            "STATUS" => Self::Status(Status::read(bytes)?),
            "POINT" => Self::Points(point::read(bytes)?),
            "STRING" => Self::Text(Text::read(bytes)?),
            "POLYDATA" => Self::PolyData(PolyData::read(bytes)?),
            "IMAGE" => Self::Image(Image::read(bytes)?),
            "TDATA" => Self::TrackingData(tracking::read(bytes)?),
            "QTDATA" => Self::QuaternionTracking(tracking::read_quaternions(bytes)?),
            "SENSOR" => Self::Sensor(Sensor::read(bytes)?),
            "CAPABILITY" => Self::Capabilities(capability::read(bytes)?),
            other => match query::parts(other) {
                Some((prefix, of)) => Self::Query(Query::read(prefix, of, bytes)?),
                None => Self::Unknown { kind: other.to_owned() },
            },
        })
    }

    /// The type name on the wire.
    pub fn kind(&self) -> Name<12> {
        Name::new(match self {
            Self::Transform(_) => "TRANSFORM",
            Self::Position(_) => "POSITION",
            Self::Status(_) => "STATUS",
            Self::Points(_) => "POINT",
            Self::Text(_) => "STRING",
            Self::PolyData(_) => "POLYDATA",
            Self::Image(_) => "IMAGE",
            Self::TrackingData(_) => "TDATA",
            Self::QuaternionTracking(_) => "QTDATA",
            Self::Sensor(_) => "SENSOR",
            Self::Capabilities(_) => "CAPABILITY",
            Self::Query(query) => return query.kind(),
            Self::Unknown { kind } => kind,
        })
    }

    /// About how many bytes [`Content::put`] adds; never fewer than the large ones have.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Points(items) => point::BYTES * items.len(),
            Self::Text(text) => text::HEAD + text.text.len(),
            Self::PolyData(data) => data.bytes(),
            Self::Image(image) => image::HEAD + image.data().len(),
            Self::TrackingData(tools) => tracking::BYTES * tools.len(),
            Self::QuaternionTracking(tools) => tracking::QUATERNION_BYTES * tools.len(),
            Self::Sensor(_) => sensor::MOST_BYTES,
            Self::Capabilities(names) => capability::BYTES * names.len(),
            Self::Status(status) => status::HEAD + status.text.len() + 1,
            Self::Transform(_) | Self::Position(_) | Self::Query(_) | Self::Unknown { .. } => 64,
        }
    }

    /// Adds the content as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        match self {
            Self::Transform(rows) => transform::put(out, rows),
            Self::Position(position) => position.put(out),
            Self::Status(status) => status.put(out),
            Self::Points(items) => items.iter().for_each(|item| item.put(out)),
            Self::Text(text) => text.put(out),
            Self::PolyData(data) => data.put(out),
            Self::Image(image) => image.put(out),
            Self::TrackingData(tools) => tools.iter().for_each(|tool| tool.put(out)),
            Self::QuaternionTracking(tools) => tools.iter().for_each(|tool| tool.put(out)),
            Self::Sensor(sensor) => sensor.put(out),
            Self::Capabilities(names) => capability::put(out, names),
            Self::Query(query) => query.put(out),
            Self::Unknown { .. } => {}
        }
    }
}

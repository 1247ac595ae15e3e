//! The OpenIGTLink protocol: messages to bytes and back. No sockets.
//!
//! A message is a header of 58 bytes and a body. A server reads the header
//! ([`Header::read_within`]), then as many bytes as it announces, then [`Message::read`];
//! [`Message::write`] makes both at once, so that a message goes out in one write. All numbers are
//! big-endian, except voxels, which say so themselves. docs/OPENIGTLINK.md has the layout of every
//! type.
//!
//! What is read is what the peer sent: poses that are not rigid and numbers that are not finite
//! come through, in the peer's frame. No number of a peer is believed before the bytes are there:
//! reading a message allocates at most its body's size and 64 KiB. An error says which STATUS code
//! answers it and whether the connection can be kept.
//!
//! ```
//! use supine_openigtlink::{Content, Header, Message, Stamp, Text};
//!
//! let mut bytes = Vec::new();
//! Message::new("Note", Stamp::NONE, Content::Text(Text::new("ready"))).write(&mut bytes);
//!
//! let (head, body) = bytes.split_first_chunk().ok_or("no header")?;
//! let message = Message::read(&Header::read(head)?, body)?;
//! assert_eq!(message.content, Content::Text(Text::new("ready")));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Source of the layouts: OpenIGTLink protocol, header versions 1 and 2, as the C++ library writes
//! it; `fixtures/openigtlink` holds messages of three peers.

mod answer;
mod content;
pub mod crc;
mod error;
mod header;
mod message;
mod metadata;
mod name;
mod reader;
mod stamp;

pub use content::image::{Endian, Image, ImageFrame, ImageLayout, Scalar};
pub use content::point::PointItem;
pub use content::poly_data::{Attribute, AttributeKind, AttributeOf, Cells, PolyData};
pub use content::position::{Position, Rotation};
pub use content::query::{Outcome, Query, Start, Verb};
pub use content::sensor::{MILLINEWTON, Sensor};
pub use content::status::{Status, StatusCode};
pub use content::text::{ASCII, Text, UTF_8};
pub use content::tracking::{QuaternionTool, Tool, ToolKind};
pub use content::{Content, Rows};
pub use error::{BodyError, HeaderError, LayoutError};
pub use header::{HEADER_BYTES, Header, Limits, Version};
pub use message::Message;
pub use name::Name;
pub use stamp::Stamp;

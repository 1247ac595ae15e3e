//! A whole message.

use crate::content::Content;
use crate::error::BodyError;
use crate::header::{HEADER_BYTES, Header, SIZE_AND_CRC, Version};
use crate::name::Name;
use crate::stamp::Stamp;
use crate::{crc, metadata};

/// A message: who says what, when.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// Version of the header. Send [`Version::Two`] only to a peer that has used it.
    pub version: Version,
    /// Device name. Its first 20 characters are written, one byte each (see [`Name`]).
    pub device: String,
    /// When the content was measured; an answer carries the stamp of what it answers.
    pub stamp: Stamp,
    /// Message number, by the sender's count; 0 in version 1, which has none.
    pub id: u32,
    /// Keys and values; version 1 has none and drops them. At most 500 are written.
    pub metadata: Vec<(String, String)>,
    /// What it says.
    pub content: Content,
}

impl Message {
    /// A message of version 1, without number and metadata.
    pub fn new(device: &str, stamp: Stamp, content: Content) -> Self {
        let device = device.to_owned();
        Self { version: Version::One, device, stamp, id: 0, metadata: Vec::new(), content }
    }

    /// Reads the body that follows a header. Types that are not known become [`Content::Unknown`].
    ///
    /// Allocates at most the body's size and 64 KiB.
    ///
    /// # Errors
    /// First a wrong checksum, then an extended header, metadata or a content that is not laid out
    /// as its type has it. [`BodyError::keeps`] says whether the next message can be read.
    pub fn read(header: &Header, body: &[u8]) -> Result<Self, BodyError> {
        let given = body.len() as u64;
        if given != header.body {
            return Err(BodyError::Length { announced: header.body, given });
        }
        let checksum = crc::of(body);
        if checksum != header.crc {
            return Err(BodyError::Checksum { announced: header.crc, found: checksum });
        }
        let (id, content, metadata) = match header.version {
            Version::One => (0, body, Vec::new()),
            Version::Two => {
                let parts = metadata::read(body)?;
                (parts.id, parts.content, parts.metadata)
            }
        };
        Ok(Self {
            version: header.version,
            device: header.device.clone(),
            stamp: header.stamp,
            id,
            metadata,
            content: Content::read(&header.kind, content)?,
        })
    }

    /// Adds header and body to `out`, to be sent in one write. Voxels are copied once.
    ///
    /// What a field cannot hold is cut: names to their field, a STRING to 65535 bytes, sensor
    /// values to 255, metadata to 500 entries.
    pub fn write(&self, out: &mut Vec<u8>) {
        let start = out.len();
        let around = match self.version {
            Version::One => 0,
            Version::Two => metadata::bytes(&self.metadata),
        };
        out.reserve(HEADER_BYTES + around + self.content.bytes());
        let (kind, device) = (self.content.kind(), Name::new(&self.device));
        Header::put(out, self.version, kind, device, self.stamp);
        match self.version {
            Version::One => self.content.put(out),
            Version::Two => {
                metadata::put_extended(out, self.id, &self.metadata);
                self.content.put(out);
                metadata::put(out, &self.metadata);
            }
        }
        let (header, body) = out[start..].split_at_mut(HEADER_BYTES);
        let (size, check) = header[SIZE_AND_CRC].split_at_mut(8);
        size.copy_from_slice(&(body.len() as u64).to_be_bytes());
        check.copy_from_slice(&crc::of(body).to_be_bytes());
    }
}

//! The 58 bytes before every body.

use crate::content;
use crate::error::HeaderError;
use crate::name::Name;
use crate::stamp::Stamp;

/// Size of the header, bytes.
pub const HEADER_BYTES: usize = 58;

/// Where the header has its body's size and checksum, 8 bytes each.
pub(crate) const SIZE_AND_CRC: std::ops::Range<usize> = 42..58;

/// The version of the header, which is not that of the protocol.
///
/// A sender uses version 2 only after the peer has: readers of protocol 1 and 2 fall out of step
/// with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Version {
    /// Protocol versions 1 and 2: the body is the content.
    #[default]
    One,
    /// Protocol version 3: the body is an extended header, the content and metadata.
    Two,
}

/// What a receiver allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest body, bytes.
    pub body: u64,
}

/// 64 MiB: an image of 512 x 512 x 128 voxels of 2 bytes.
impl Default for Limits {
    fn default() -> Self {
        Self { body: 64 << 20 }
    }
}

/// What the header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// Version of the header.
    pub version: Version,
    /// Type name, 1 to 12 printable ASCII characters; case matters.
    pub kind: String,
    /// Device name, at most 20 characters, one for each byte (see [`Name`]). May be empty.
    pub device: String,
    /// When the content was measured.
    pub stamp: Stamp,
    /// Size of the body that follows, bytes.
    pub body: u64,
    /// CRC-64 of the body.
    pub crc: u64,
}

impl Header {
    /// Reads a header; a body may have 64 MiB.
    ///
    /// # Errors
    /// As [`Header::read_within`].
    pub fn read(bytes: &[u8; HEADER_BYTES]) -> Result<Self, HeaderError> {
        Self::read_within(bytes, &Limits::default())
    }

    /// Reads a header: u16 version, `char[12]` type, `char[20]` device, u64 stamp, u64 size, u64
    /// CRC.
    ///
    /// # Errors
    /// A version that does not exist, a type name that is none, a body above the limit.
    pub fn read_within(bytes: &[u8; HEADER_BYTES], limits: &Limits) -> Result<Self, HeaderError> {
        let version = match u16::from_be_bytes(part(bytes, 0)) {
            1 => Version::One,
            2 => Version::Two,
            found => return Err(HeaderError::Version { found }),
        };
        let kind = Name::<12>::read(&part(bytes, 2));
        if kind.is_empty() || !kind.bytes().iter().all(|byte| (b' '..=b'~').contains(byte)) {
            return Err(HeaderError::Kind { found: kind.bytes().escape_ascii().to_string() });
        }
        let body = u64::from_be_bytes(part(bytes, 42));
        if body > limits.body {
            return Err(HeaderError::TooLarge { announced: body, limit: limits.body });
        }
        Ok(Self {
            version,
            kind: kind.to_string(),
            device: Name::<20>::read(&part(bytes, 14)).to_string(),
            stamp: Stamp(u64::from_be_bytes(part(bytes, 34))),
            body,
            crc: u64::from_be_bytes(part(bytes, 50)),
        })
    }

    /// Whether [`crate::Message::read`] makes something of this type. The body of any other need
    /// not be kept: skip it in pieces and answer STATUS 12.
    pub fn is_known(&self) -> bool {
        content::is_known(&self.kind)
    }

    /// Adds a header without size and checksum, which stand at [`SIZE_AND_CRC`].
    pub(crate) fn put(
        out: &mut Vec<u8>,
        version: Version,
        kind: Name<12>,
        device: Name<20>,
        stamp: Stamp,
    ) {
        let version: u16 = match version {
            Version::One => 1,
            Version::Two => 2,
        };
        out.extend_from_slice(&version.to_be_bytes());
        out.extend_from_slice(kind.field());
        out.extend_from_slice(device.field());
        out.extend_from_slice(&stamp.0.to_be_bytes());
        out.extend_from_slice(&[0; SIZE_AND_CRC.end - SIZE_AND_CRC.start]);
    }
}

/// N bytes of a header from `start` on; beyond its end zeros.
fn part<const N: usize>(bytes: &[u8; HEADER_BYTES], start: usize) -> [u8; N] {
    let mut part = [0; N];
    for (to, from) in part.iter_mut().zip(bytes.iter().skip(start)) {
        *to = *from;
    }
    part
}

//! Messages as bytes, right or wrong in every field.

use crate::support::transform;
use supine_openigtlink::{HEADER_BYTES, Stamp, crc};
use supine_space::Pose;

/// Fields of a message; size and checksum are right unless they are given.
#[derive(Clone)]
pub(crate) struct Raw {
    pub(crate) version: u16,
    pub(crate) kind: Vec<u8>,
    pub(crate) device: Vec<u8>,
    pub(crate) stamp: Stamp,
    pub(crate) size: Option<u64>,
    pub(crate) crc: Option<u64>,
    pub(crate) body: Vec<u8>,
}

impl Raw {
    pub(crate) fn new(kind: &str, body: &[u8]) -> Self {
        Self {
            version: 1,
            kind: kind.into(),
            device: b"Applicator".into(),
            stamp: Stamp::NONE,
            size: None,
            crc: None,
            body: body.into(),
        }
    }

    /// A pose in version 1.
    pub(crate) fn pose(stamp: Stamp, pose: &Pose) -> Self {
        Self { stamp, ..Self::new("TRANSFORM", &body(pose)) }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let field = |text: &[u8], size: usize| {
            let mut field = vec![0; size];
            field[..text.len()].copy_from_slice(text);
            field
        };
        let mut bytes = self.version.to_be_bytes().to_vec();
        bytes.extend(field(&self.kind, 12));
        bytes.extend(field(&self.device, 20));
        bytes.extend(self.stamp.0.to_be_bytes());
        bytes.extend(self.size.unwrap_or(self.body.len() as u64).to_be_bytes());
        bytes.extend(self.crc.unwrap_or_else(|| crc::of(&self.body)).to_be_bytes());
        bytes.extend(&self.body);
        bytes
    }
}

/// The 48 bytes of a pose.
pub(crate) fn body(pose: &Pose) -> Vec<u8> {
    let mut bytes = vec![];
    transform("", Stamp::NONE, pose).write(&mut bytes);
    bytes.split_off(HEADER_BYTES)
}

/// What version 2 puts around a content, with sizes that may lie.
pub(crate) struct Around<'a> {
    pub(crate) extended: u16,
    pub(crate) header_size: Option<u16>,
    pub(crate) values_size: Option<u32>,
    pub(crate) header: &'a [u8],
    pub(crate) values: &'a [u8],
}

impl Default for Around<'_> {
    fn default() -> Self {
        let (header_size, values_size) = (None, None);
        Self { extended: 12, header_size, values_size, header: &[0, 0], values: &[] }
    }
}

impl Around<'_> {
    pub(crate) fn body(&self, content: &[u8]) -> Vec<u8> {
        let header = self.header_size.unwrap_or(self.header.len() as u16);
        let values = self.values_size.unwrap_or(self.values.len() as u32);
        let mut body = self.extended.to_be_bytes().to_vec();
        body.extend(header.to_be_bytes());
        body.extend(values.to_be_bytes());
        body.extend(1_u32.to_be_bytes());
        for part in [content, self.header, self.values] {
            body.extend(part);
        }
        body
    }
}

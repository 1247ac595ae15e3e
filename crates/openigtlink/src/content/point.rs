//! POINT: any number of items of 136 bytes.

use crate::error::Refusal;
use crate::name::Name;
use crate::reader::{Reader, put_f32s};

/// Bytes of an item.
pub(crate) const BYTES: usize = 136;

/// A named point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointItem {
    /// Name, at most 64 characters.
    pub name: Name<64>,
    /// Group, at most 32 characters.
    pub group: Name<32>,
    /// Red, green, blue, opacity.
    pub rgba: [u8; 4],
    /// Place, mm.
    pub position: [f32; 3],
    /// Diameter, mm. The C++ library calls it a radius and writes it unchanged.
    pub diameter: f32,
    /// Device name of the image it belongs to, at most 20 characters.
    pub owner: Name<20>,
}

/// Reads a POINT: for each item char[64], char[32], u8 x 4, f32 x 3, f32, char[20].
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<PointItem>, Refusal> {
    let mut reader = Reader::new(bytes, "a POINT has 136 bytes for each of its points");
    let mut items = Vec::with_capacity(bytes.len() / BYTES);
    while reader.left() > 0 {
        items.push(PointItem {
            name: Name::read(reader.array()?),
            group: Name::read(reader.array()?),
            rgba: *reader.array()?,
            position: reader.f32s()?,
            diameter: reader.f32s::<1>().map(|[diameter]| diameter)?,
            owner: Name::read(reader.array()?),
        });
    }
    Ok(items)
}

impl PointItem {
    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(self.name.field());
        out.extend_from_slice(self.group.field());
        out.extend_from_slice(&self.rgba);
        put_f32s(out, &self.position);
        put_f32s(out, &[self.diameter]);
        out.extend_from_slice(self.owner.field());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_takes_no_more_memory_than_bytes() {
        assert_eq!(size_of::<PointItem>(), BYTES);
    }
}

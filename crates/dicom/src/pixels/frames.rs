//! Which bytes of Pixel Data are one frame (PS3.5 8.2, A.4).

use crate::pixel_format::{Frame, PixelFormat};
use std::borrow::Cow;

impl Frame {
    /// The bytes of a frame that is not compressed.
    pub(super) fn native(self, bytes: &[u8], format: PixelFormat) -> Result<&[u8], String> {
        let length = format.bytes();
        self.index
            .checked_mul(length)
            .and_then(|start| bytes.get(start..)?.get(..length))
            .ok_or_else(|| {
                format!("{} bytes, {} are needed", bytes.len(), self.count.saturating_mul(length))
            })
    }

    /// The bytes of a compressed frame. The first fragment is the basic offset table; a frame may
    /// be cut into several of the others.
    pub(super) fn encapsulated<'a>(
        self,
        fragments: &'a [Vec<u8>],
        extended_offsets: Option<&[u8]>,
    ) -> Result<Cow<'a, [u8]>, String> {
        let Some((basic_offsets, fragments)) = fragments.split_first() else {
            return Err("no offset table".into());
        };
        if self.count == 1 {
            return Ok(joined(fragments));
        }
        if fragments.len() == self.count {
            return Ok(joined(&fragments[self.index..=self.index]));
        }
        let starts = self
            .by_offsets(fragments, extended_offsets.unwrap_or_default(), 8)
            .or_else(|| self.by_offsets(fragments, basic_offsets, 4))
            .or_else(|| self.by_markers(fragments))
            .ok_or_else(|| {
                let (found, frames) = (fragments.len(), self.count);
                format!("{found} fragments cannot be told apart into {frames} frames")
            })?;
        let end = starts.get(self.index + 1).copied().unwrap_or(fragments.len());
        match fragments.get(starts[self.index]..end) {
            Some(own) if !own.is_empty() => Ok(joined(own)),
            _ => Err(format!("frame {} has no fragment", self.index + 1)),
        }
    }

    /// The first fragment of each frame, from a table of `width`-byte offsets (PS3.5 A.4).
    fn by_offsets(self, fragments: &[Vec<u8>], table: &[u8], width: usize) -> Option<Vec<usize>> {
        if table.len() / width != self.count {
            return None;
        }
        let mut place = 0u64;
        let mut places = Vec::with_capacity(fragments.len());
        for fragment in fragments {
            places.push(place);
            // The tag and the length of an item take eight bytes.
            place += fragment.len() as u64 + 8;
        }
        let offset = |bytes: &[u8]| bytes.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b));
        table.chunks_exact(width).map(|o| places.binary_search(&offset(o)).ok()).collect()
    }

    /// The first fragment of each frame, from the markers that begin a JPEG or JPEG 2000 stream.
    fn by_markers(self, fragments: &[Vec<u8>]) -> Option<Vec<usize>> {
        let begins = |n: &usize| {
            fragments[*n].starts_with(&[0xFF, 0xD8]) || fragments[*n].starts_with(&[0xFF, 0x4F])
        };
        let starts: Vec<usize> = (0..fragments.len()).filter(begins).collect();
        (starts.len() == self.count).then_some(starts)
    }
}

fn joined(fragments: &[Vec<u8>]) -> Cow<'_, [u8]> {
    match fragments {
        [only] => Cow::Borrowed(only),
        several => Cow::Owned(several.concat()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(index: usize, fragments: &[Vec<u8>], extended: Option<&[u8]>) -> Option<Vec<u8>> {
        Frame { index, count: 2 }.encapsulated(fragments, extended).ok().map(Cow::into_owned)
    }

    #[test]
    fn frames_are_found_by_offsets_by_markers_or_not_at_all() {
        // Two frames: three fragments of 2 bytes, then one of 4.
        let cut = |table: &[u8], mark: u8| {
            let first = vec![mark, 0xD8];
            vec![table.to_vec(), first, vec![1, 2], vec![3, 4], vec![mark, 0xD8, 5, 6]]
        };
        let (one, two) = (vec![9, 0xD8, 1, 2, 3, 4], vec![9, 0xD8, 5, 6]);
        let basic = cut(&[0, 0, 0, 0, 30, 0, 0, 0], 9);
        assert_eq!(frame(0, &basic, None), Some(one.clone()));
        assert_eq!(frame(1, &basic, None), Some(two.clone()));
        let mut table = [0; 16];
        table[8] = 30;
        assert_eq!(frame(0, &cut(&[], 9), Some(&table)), Some(one));
        assert_eq!(frame(1, &cut(&[], 9), Some(&table)), Some(two));
        assert_eq!(frame(1, &cut(&[], 0xFF), None), Some(vec![0xFF, 0xD8, 5, 6]));
        assert_eq!(frame(0, &cut(&[], 9), None), None, "nothing tells them apart");
        assert_eq!(frame(0, &cut(&[0, 0, 0, 0, 7, 0, 0, 0], 9), None), None, "a lying table");
        assert_eq!(frame(0, &[], None), None);
    }
}

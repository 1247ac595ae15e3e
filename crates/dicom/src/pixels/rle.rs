//! RLE Lossless (PS3.5 Annex G).

use crate::pixel_format::PixelFormat;

/// RLE Lossless of one frame (PS3.5 Annex G): a header of 16 numbers (count of segments, their
/// offsets), then one PackBits segment per byte plane, most significant plane first.
pub(super) fn run_lengths(frame: &[u8], format: PixelFormat) -> Result<Vec<u8>, String> {
    let planes = usize::from(format.bits_allocated / 8);
    let Some(header) = frame.get(..64) else { return Err("the RLE header is cut short".into()) };
    let number = |n: usize| {
        u32::from_le_bytes([header[4 * n], header[4 * n + 1], header[4 * n + 2], header[4 * n + 3]])
            as usize
    };
    if number(0) != planes {
        return Err(format!("{} RLE segments, {planes} are needed", number(0)));
    }
    let mut out = vec![0; format.bytes()];
    for plane in 0..planes {
        let end = if plane + 1 < planes { number(plane + 2) } else { frame.len() };
        let Some(segment) = frame.get(number(plane + 1)..end) else {
            return Err("an RLE segment lies outside the frame".into());
        };
        let place = planes - 1 - plane;
        let filled = unpack(segment, &mut out, place, planes);
        if filled < format.len() {
            return Err(format!("an RLE segment ends after {filled} of {} samples", format.len()));
        }
    }
    Ok(out)
}

/// Unpacks PackBits into every `stride`-th byte from `first`; the number of bytes unpacked.
fn unpack(segment: &[u8], out: &mut [u8], first: usize, stride: usize) -> usize {
    let mut places = out.iter_mut().skip(first).step_by(stride);
    let (mut at, mut filled) = (0, 0);
    while at < segment.len() {
        let control = segment[at] as i8;
        at += 1;
        match control {
            -128 => {}
            0.. => {
                let end = (at + control as usize + 1).min(segment.len());
                for &byte in &segment[at..end] {
                    let Some(place) = places.next() else { return filled };
                    *place = byte;
                    filled += 1;
                }
                at = end;
            }
            _ => {
                let Some(&byte) = segment.get(at) else { return filled };
                at += 1;
                for _ in 0..=control.unsigned_abs() {
                    let Some(place) = places.next() else { return filled };
                    *place = byte;
                    filled += 1;
                }
            }
        }
    }
    filled
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_bits_are_unpacked_into_their_plane() {
        let mut out = [0; 10];
        // Three literal bytes, a no-op, a run of two.
        let filled = unpack(&[2, 1, 2, 3, 0x80, 0xFF, 9], &mut out, 1, 2);
        assert_eq!((filled, out), (5, [0, 1, 0, 2, 0, 3, 0, 9, 0, 9]));
        assert_eq!(unpack(&[5, 1], &mut out, 0, 1), 1, "cut short");
        assert_eq!(unpack(&[0x81], &mut out, 0, 1), 0, "cut short");
    }
}

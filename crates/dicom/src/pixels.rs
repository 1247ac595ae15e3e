//! Stored values of one slice, from every coding that is read.

use crate::data_set::{DataSet, PixelCoding, TransferSyntax, Value};
use crate::error::Error;
use crate::slice::PixelFormat;
use dicom_dictionary_std::tags;

/// The samples of a slice, row by row, as 16-bit patterns that [`PixelFormat::stored`] interprets.
pub(crate) fn samples(
    file: &str,
    data: &DataSet,
    syntax: &TransferSyntax,
    format: PixelFormat,
) -> Result<Vec<u16>, Error> {
    let fail = |reason: String| Error::Pixels { file: file.to_owned(), reason };
    let value = data.get(tags::PIXEL_DATA).map(|e| &e.value);
    let samples = match (syntax.pixel_coding(), value) {
        (_, None) => Err("Pixel Data is missing".to_owned()),
        (PixelCoding::Native, Some(Value::Bytes(bytes))) => match bytes.get(..format.bytes()) {
            Some(bytes) => Ok(native(bytes, format)),
            None => Err(format!("{} bytes, {} are needed", bytes.len(), format.bytes())),
        },
        (PixelCoding::Native, Some(_)) => {
            Err("compressed, though the header says otherwise".into())
        }
        (coding, Some(Value::Fragments(fragments))) => {
            // The first fragment is the offset table; one frame may be cut into several others.
            let frame = fragments.get(1..).unwrap_or_default().concat();
            match coding {
                PixelCoding::Rle => run_lengths(&frame, format).map(|bytes| native(&bytes, format)),
                PixelCoding::Jpeg => contained(|| jpeg(&frame, format)),
                _ => contained(|| jpeg_2000(&frame, format)),
            }
        }
        (_, Some(_)) => Err("not encapsulated, though the header says compressed".into()),
    };
    samples.map_err(fail)
}

/// Decoders are other people's: a panic of theirs is the file's fault, not the program's end.
fn contained<T>(decode: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(decode))
        .unwrap_or_else(|_| Err("the decoder gave up on it".into()))
}

fn native(bytes: &[u8], format: PixelFormat) -> Vec<u16> {
    if format.bits_allocated == 8 {
        bytes.iter().map(|&b| b.into()).collect()
    } else {
        bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
    }
}

/// RLE Lossless of one frame (PS3.5 Annex G): a header of 16 numbers (count of segments, their
/// offsets), then one PackBits segment per byte plane, most significant plane first.
fn run_lengths(frame: &[u8], format: PixelFormat) -> Result<Vec<u8>, String> {
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

fn jpeg(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
    let mut decoder = jpeg_decoder::Decoder::new(frame);
    decoder.read_info().map_err(|e| e.to_string())?;
    let info = decoder.info().ok_or("no JPEG header")?;
    if (info.width, info.height) != (format.columns, format.rows) {
        return Err(format!("the JPEG image is {} x {}", info.height, info.width));
    }
    decoder.set_max_decoding_buffer_size(4 * format.len());
    let bytes = decoder.decode().map_err(|e| e.to_string())?;
    let samples: Vec<u16> = match info.pixel_format {
        jpeg_decoder::PixelFormat::L8 => bytes.iter().map(|&b| b.into()).collect(),
        jpeg_decoder::PixelFormat::L16 => {
            bytes.chunks_exact(2).map(|pair| u16::from_ne_bytes([pair[0], pair[1]])).collect()
        }
        other => return Err(format!("the JPEG image is {other:?}, not one grey channel")),
    };
    if samples.len() == format.len() { Ok(samples) } else { Err("the JPEG image is short".into()) }
}

fn jpeg_2000(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
    let header = Jpeg2000Header::find(frame).ok_or("no JPEG 2000 header")?;
    if header.size != [u32::from(format.columns), u32::from(format.rows)] {
        let [width, height] = header.size;
        return Err(format!("the JPEG 2000 image is {height} x {width}"));
    }
    if header.components != 1 || header.tiles > MAX_TILES {
        let Jpeg2000Header { components, tiles, .. } = header;
        return Err(format!("the JPEG 2000 image has {components} channels and {tiles} tiles"));
    }
    let image = jpeg2k::Image::from_bytes(frame).map_err(|e| e.to_string())?;
    let [component] = image.components() else {
        return Err(format!("the JPEG 2000 image has {} channels", image.num_components()));
    };
    if [component.width(), component.height()] != header.size
        || component.data().len() != format.len()
    {
        return Err("the JPEG 2000 image is short".into());
    }
    if component.precision() > format.bits_allocated.into() {
        return Err(format!("the JPEG 2000 image has {} bits", component.precision()));
    }
    Ok(component.data().iter().map(|&v| v as u16).collect())
}

/// Most tiles of a JPEG 2000 image: each costs the decoder memory before it holds a sample.
const MAX_TILES: u64 = 4096;

/// What the SIZ marker segment says (ISO 15444-1 A.5.1), looked up before any decoding.
struct Jpeg2000Header {
    /// Width and height.
    size: [u32; 2],
    components: u16,
    tiles: u64,
}

impl Jpeg2000Header {
    fn find(frame: &[u8]) -> Option<Self> {
        let at = frame.windows(4).position(|w| w == [0xFF, 0x4F, 0xFF, 0x51])?;
        let header = frame.get(at..at + 42)?;
        let number =
            |n: usize| u32::from_be_bytes([header[n], header[n + 1], header[n + 2], header[n + 3]]);
        let size = [number(8).checked_sub(number(16))?, number(12).checked_sub(number(20))?];
        let tiles_along = |n: usize| u64::from(size[n].div_ceil(number(24 + 4 * n).max(1)));
        Some(Self {
            size,
            components: u16::from_be_bytes([header[40], header[41]]),
            tiles: tiles_along(0) * tiles_along(1),
        })
    }
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

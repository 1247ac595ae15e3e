//! JPEG 2000 (ISO/IEC 15444-1).

use hayro_jpeg2000::{ComponentData, DecodeSettings, DecoderContext, Image};

use crate::pixel_format::PixelFormat;

pub(super) fn jpeg_2000(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
    let stream = codestream(frame).ok_or("no JPEG 2000 header")?;
    let header = Jpeg2000Header::of(stream).ok_or("the JPEG 2000 header is cut off")?;
    if header.size != [u32::from(format.columns), u32::from(format.rows)] {
        let [width, height] = header.size;
        return Err(format!("the JPEG 2000 image is {height} x {width}"));
    }
    if header.components != 1 || header.tiles > MAX_TILES {
        let Jpeg2000Header { components, tiles, .. } = header;
        return Err(format!("the JPEG 2000 image has {components} channels and {tiles} tiles"));
    }
    let settings = DecodeSettings { strict: true, ..DecodeSettings::default() };
    let image = Image::new(stream, &settings).map_err(|e| e.to_string())?;
    let mut context = DecoderContext::default();
    let decoded = image.decode(&mut context).map_err(|e| e.to_string())?;
    let [component] = decoded.components() else {
        return Err(format!("the JPEG 2000 image has {} channels", decoded.components().len()));
    };
    if component.samples().len() != format.len() {
        return Err("the JPEG 2000 image is short".into());
    }
    if u16::from(component.bit_depth()) > format.bits_allocated {
        return Err(format!("the JPEG 2000 image has {} bits", component.bit_depth()));
    }
    Ok(two_s_complement(component, header.signed))
}

/// Most tiles of a JPEG 2000 image: each costs the decoder memory before it holds a sample.
const MAX_TILES: u64 = 4096;

/// What the SIZ marker segment says (ISO 15444-1 A.5.1), looked up before any decoding.
struct Jpeg2000Header {
    /// Width and height.
    size: [u32; 2],
    components: u16,
    tiles: u64,
    signed: bool,
}

impl Jpeg2000Header {
    fn of(stream: &[u8]) -> Option<Self> {
        let header = stream.get(..43)?;
        let number =
            |n: usize| u32::from_be_bytes([header[n], header[n + 1], header[n + 2], header[n + 3]]);
        let size = [number(8).checked_sub(number(16))?, number(12).checked_sub(number(20))?];
        let tiles_along = |n: usize| u64::from(size[n].div_ceil(number(24 + 4 * n).max(1)));
        Some(Self {
            size,
            components: u16::from_be_bytes([header[40], header[41]]),
            tiles: tiles_along(0) * tiles_along(1),
            signed: header[42] & 0x80 != 0,
        })
    }
}

/// From the first marker segment on: a frame is a bare codestream (PS3.5 A.4.4), which some writers
/// wrap into a JP2 file all the same.
fn codestream(frame: &[u8]) -> Option<&[u8]> {
    let at = frame.windows(4).position(|w| w == [0xFF, 0x4F, 0xFF, 0x51])?;
    frame.get(at..)
}

/// The decoder gives signed samples the level shift that unsigned ones have (ISO 15444-1 G.1).
fn two_s_complement(component: &ComponentData, signed: bool) -> Vec<u16> {
    let shift = if signed { 1 << (component.bit_depth() - 1) } else { 0 };
    component.samples().iter().map(|&v| (v.round() as i32 - shift) as u16).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 x 24 samples of 16 bits, lossless, written by OpenJPEG (`tests/data/make.py`).
    const RAMP: &[u8] = include_bytes!("../../tests/data/ramp.j2k");
    const FORMAT: PixelFormat =
        PixelFormat { rows: 24, columns: 40, bits_allocated: 16, bits_stored: 16, signed: false };

    fn ramp() -> Vec<u16> {
        let value = |n: u32| match n {
            0 => 0,
            959 => u16::MAX,
            n => (n % 40 * 1999 + n / 40 * 9973) as u16,
        };
        (0..960).map(value).collect()
    }

    #[test]
    fn sixteen_bits_come_out_as_they_went_in() {
        assert_eq!(jpeg_2000(RAMP, FORMAT), Ok(ramp()));
    }

    #[test]
    fn signed_samples_are_not_shifted() {
        // The codestream of signed samples is that of the same samples plus 32768 but for one bit.
        let mut signed = RAMP.to_vec();
        signed[42] |= 0x80;
        let expected = ramp().iter().map(|v| v ^ 0x8000).collect();
        assert_eq!(jpeg_2000(&signed, PixelFormat { signed: true, ..FORMAT }), Ok(expected));
    }

    #[test]
    fn the_irreversible_wavelet_is_inverted_to_within_its_rounding() {
        let smooth = include_bytes!("../../tests/data/smooth.j2k");
        let samples = jpeg_2000(smooth, FORMAT).unwrap();
        for (n, &found) in samples.iter().enumerate() {
            let written = 1000 + 3 * (n % 40) + 5 * (n / 40);
            assert!(written.abs_diff(found.into()) <= 1, "{n}: {found}, not {written}");
        }
    }

    #[test]
    fn a_stream_that_is_cut_or_of_another_size_is_refused() {
        for cut in [0, 3, 42, 60, 200] {
            assert!(jpeg_2000(&RAMP[..cut], FORMAT).is_err(), "{cut}");
        }
        let message = jpeg_2000(RAMP, PixelFormat { rows: 40, columns: 24, ..FORMAT }).unwrap_err();
        assert_eq!(message, "the JPEG 2000 image is 24 x 40");
        let message = jpeg_2000(RAMP, PixelFormat { bits_allocated: 8, ..FORMAT }).unwrap_err();
        assert_eq!(message, "the JPEG 2000 image has 16 bits");
    }
}

//! JPEG: baseline and lossless; JPEG-LS.

use crate::pixel_format::PixelFormat;

pub(super) fn jpeg(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
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

/// JPEG-LS, lossless and near-lossless (ISO/IEC 14495-1).
pub(super) fn jpeg_ls(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
    // The decoder compares the size in the stream with this one before it allocates.
    let (samples, ..) = jpegls::decode(frame, format.columns.into(), format.rows.into())
        .map_err(|e| e.to_string())?;
    if samples.len() == format.len() {
        Ok(samples)
    } else {
        Err("the JPEG-LS image is short".into())
    }
}

//! Stored values of one frame, from every coding that is read.

mod frames;
mod jpeg;
mod jpeg_2000;
mod rle;

use crate::data_set::{DataSet, PixelCoding, TransferSyntax, Value};
use crate::error::Error;
use crate::pixel_format::{Frame, PixelFormat};
use dicom_dictionary_std::tags;

/// The samples of a frame, row by row, as 16-bit patterns that [`PixelFormat::stored`] interprets.
pub(crate) fn samples(
    file: &str,
    data: &DataSet,
    syntax: &TransferSyntax,
    format: PixelFormat,
    frame: Frame,
) -> Result<Vec<u16>, Error> {
    let value = data.get(tags::PIXEL_DATA).map(|e| &e.value);
    let samples = match (syntax.pixel_coding(), value) {
        (_, None) => Err("Pixel Data is missing".to_owned()),
        (PixelCoding::Native, Some(Value::Bytes(bytes))) => {
            frame.native(bytes, format).map(|bytes| native(bytes, format))
        }
        (PixelCoding::Native, Some(_)) => {
            Err("compressed, though the header says otherwise".into())
        }
        (coding, Some(Value::Fragments(fragments))) => frame
            .encapsulated(fragments, data.bytes(tags::EXTENDED_OFFSET_TABLE))
            .and_then(|frame| decoded(coding, &frame, format)),
        (_, Some(_)) => Err("not encapsulated, though the header says compressed".into()),
    };
    samples.map_err(|reason| Error::Pixels { file: file.to_owned(), reason })
}

/// Decoders are other people's: a panic of theirs is the file's fault, not the program's end.
fn decoded(coding: PixelCoding, frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
    let decode = || match coding {
        PixelCoding::Rle => rle::run_lengths(frame, format).map(|bytes| native(&bytes, format)),
        PixelCoding::Jpeg => jpeg::jpeg(frame, format),
        PixelCoding::JpegLs => jpeg::jpeg_ls(frame, format),
        PixelCoding::Jpeg2000 => jpeg_2000::jpeg_2000(frame, format),
        PixelCoding::Native | PixelCoding::Unknown => Err("not a coding that is read".into()),
    };
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

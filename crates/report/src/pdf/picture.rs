//! Pictures of the report as those of the PDF: both hold rows filtered and deflated in the same
//! way.

use crate::Error;
use crate::encoded::EncodedPicture;

/// Eight bits each of red, green and blue.
#[derive(Debug)]
pub(super) struct Raster {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Rows as a PNG file has them: each behind the number of its filter, deflated.
    pub(super) deflated: Vec<u8>,
}

impl Raster {
    /// # Errors
    /// [`Error::NotPlain`] when the picture is no PNG file of three times eight bits whose rows
    /// follow each other.
    pub(super) fn new(picture: &EncodedPicture) -> Result<Self, Error> {
        let deflated = deflated(&picture.png);
        let deflated = deflated.ok_or_else(|| Error::NotPlain { name: picture.name.clone() })?;
        Ok(Self { width: picture.width, height: picture.height, deflated })
    }
}

/// What the data chunks hold (PNG specification, 5 and 11.2).
fn deflated(png: &[u8]) -> Option<Vec<u8>> {
    /// Bit depth, colour type, compression, filter and interlace method of the header.
    const PLAIN: [u8; 5] = [8, 2, 0, 0, 0];
    let mut rest = png.strip_prefix(b"\x89PNG\r\n\x1a\n")?;
    let (mut plain, mut data) = (false, Vec::new());
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let length = u32::from_be_bytes(*length) as usize;
        let (kind, after) = after.split_first_chunk::<4>()?;
        let (body, after) = after.split_at_checked(length)?;
        match kind {
            b"IHDR" => plain = body.get(8..) == Some(&PLAIN),
            b"IDAT" => data.extend_from_slice(body),
            b"IEND" => return (plain && !data.is_empty()).then_some(data),
            _ => {}
        }
        rest = after.get(4..)?;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Canvas;

    #[test]
    fn a_picture_is_taken_as_it_is_or_not_at_all() {
        let png = Canvas::new(7, 5).png().unwrap();
        let picture = |png: &[u8]| EncodedPicture {
            name: "axial".into(),
            caption: String::new(),
            png: png.to_vec(),
            width: 7,
            height: 5,
        };
        assert!(!Raster::new(&picture(&png)).unwrap().deflated.is_empty());
        let mut grey = png.clone();
        grey[25] = 0;
        for other in [&png[..png.len() - 12], &png[1..], &grey[..], b""] {
            let error = Raster::new(&picture(other)).unwrap_err();
            assert!(error.to_string().contains("axial"), "{error}");
        }
    }
}

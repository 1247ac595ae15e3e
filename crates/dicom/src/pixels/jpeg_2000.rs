//! JPEG 2000 (ISO/IEC 15444-1).

use crate::slice::PixelFormat;

pub(super) fn jpeg_2000(frame: &[u8], format: PixelFormat) -> Result<Vec<u16>, String> {
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

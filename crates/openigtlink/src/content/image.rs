//! IMAGE: 72 bytes that say what and where, then voxels.

use crate::error::{LayoutError, Refusal};
use crate::reader::{Reader, put_f32s, put_u16s};

/// Bytes before the voxels.
pub(crate) const HEAD: usize = 72;

/// The only version of this layout.
const LAYOUT_VERSION: u16 = 1;

/// The type of one value of a voxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// 2: one byte, signed.
    I8,
    /// 3: one byte.
    U8,
    /// 4: two bytes, signed.
    I16,
    /// 5: two bytes.
    U16,
    /// 6: four bytes, signed.
    I32,
    /// 7: four bytes.
    U32,
    /// 10: single precision.
    F32,
    /// 11: double precision.
    F64,
}

impl Scalar {
    /// Every type with its number on the wire and its bytes.
    const ALL: [(Self, u8, u8); 8] = [
        (Self::I8, 2, 1),
        (Self::U8, 3, 1),
        (Self::I16, 4, 2),
        (Self::U16, 5, 2),
        (Self::I32, 6, 4),
        (Self::U32, 7, 4),
        (Self::F32, 10, 4),
        (Self::F64, 11, 8),
    ];

    /// Bytes of a value.
    pub fn bytes(self) -> u8 {
        Self::ALL.iter().find(|(scalar, ..)| *scalar == self).map_or(0, |(.., bytes)| *bytes)
    }

    fn number(self) -> u8 {
        Self::ALL.iter().find(|(scalar, ..)| *scalar == self).map_or(0, |(_, number, _)| *number)
    }

    fn of(number: u8) -> Option<Self> {
        Self::ALL.iter().find(|(_, own, _)| *own == number).map(|(scalar, ..)| *scalar)
    }
}

/// The order of the bytes of a voxel. The rest of the message is big-endian in any case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Endian {
    /// 1
    Big,
    /// 2
    Little,
}

/// The frame that an image says it is in. Some peers read all images as RAS whatever it says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ImageFrame {
    /// 1: x to the patient's right, y anterior, z superior.
    Ras,
    /// 2: x to the patient's left, y posterior, z superior.
    Lps,
}

/// What the voxels of an image mean and where they lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageLayout {
    /// Values of a voxel, 1 or more.
    pub components: u8,
    /// Type of a value.
    pub scalar: Scalar,
    /// Order of the bytes of a value.
    pub endian: Endian,
    /// The frame of `steps` and `centre`.
    pub frame: ImageFrame,
    /// Voxels of the whole volume along i, j, k.
    pub size: [u16; 3],
    /// From one voxel to the next along i, j and k, mm: columns of direction · diag(spacing).
    pub steps: [[f32; 3]; 3],
    /// Centre of the whole volume, mm; see [`ImageLayout::centre_of`].
    pub centre: [f32; 3],
    /// First voxel of the part that is sent.
    pub start: [u16; 3],
    /// Voxels of the part that is sent.
    pub extent: [u16; 3],
}

impl ImageLayout {
    /// Bytes of the voxels that are sent.
    pub fn data_bytes(&self) -> u64 {
        // At most 255 values of 8 bytes in 2^48 voxels: below 2^59.
        let voxels: u64 = self.extent.iter().map(|n| u64::from(*n)).product();
        voxels * u64::from(self.components) * u64::from(self.scalar.bytes())
    }

    /// The centre of a volume whose first voxel's centre lies at `first` (mm):
    /// first + sum over the axes of step (n - 1) / 2.
    pub fn centre_of(first: [f64; 3], steps: &[[f32; 3]; 3], size: [u16; 3]) -> [f32; 3] {
        let mut centre = first;
        add_half(&mut centre, steps, size, 1.0);
        centre.map(|value| value as f32)
    }

    /// The centre of the first voxel of the whole volume, mm: the inverse of
    /// [`ImageLayout::centre_of`].
    pub fn first_voxel(&self) -> [f64; 3] {
        let mut first = self.centre.map(f64::from);
        add_half(&mut first, &self.steps, self.size, -1.0);
        first
    }

    /// What keeps the layout from being sent, if anything.
    fn fault(&self) -> Option<LayoutError> {
        if self.components == 0 {
            return Some(LayoutError::NoComponents);
        }
        (0..3).find_map(|axis| {
            let (start, extent, size) = (self.start[axis], self.extent[axis], self.size[axis]);
            let beyond = u32::from(start) + u32::from(extent) > u32::from(size);
            beyond.then_some(LayoutError::SubVolume { axis, start, extent, size })
        })
    }
}

/// Adds half the diagonal from the first voxel's centre to the last one's, times a sign.
fn add_half(place: &mut [f64; 3], steps: &[[f32; 3]; 3], size: [u16; 3], sign: f64) {
    for (step, n) in steps.iter().zip(size) {
        let half = sign * (f64::from(n.max(1)) - 1.0) / 2.0;
        for (value, along) in place.iter_mut().zip(step) {
            *value += half * f64::from(*along);
        }
    }
}

/// An image: a layout, and as many bytes of voxels as it asks for.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    layout: ImageLayout,
    data: Vec<u8>,
}

impl Image {
    /// An image of voxels, i fastest, in the order of bytes that the layout names.
    ///
    /// # Errors
    /// When the part that is sent reaches out of the volume, a voxel has no value, or `data` is not
    /// as long as [`ImageLayout::data_bytes`].
    pub fn new(layout: ImageLayout, data: Vec<u8>) -> Result<Self, LayoutError> {
        if let Some(fault) = layout.fault() {
            return Err(fault);
        }
        let (given, wanted) = (data.len() as u64, layout.data_bytes());
        if given != wanted {
            return Err(LayoutError::Bytes { given, wanted });
        }
        Ok(Self { layout, data })
    }

    /// What the voxels mean and where they lie.
    pub fn layout(&self) -> &ImageLayout {
        &self.layout
    }

    /// The voxels that are sent, i fastest.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// The voxels' buffer, to be filled again.
    pub fn into_data(self) -> Vec<u8> {
        self.data
    }

    /// Reads an IMAGE: u16 1, u8 components, u8 scalar, u8 endian, u8 frame, u16 x 3 size, f32 x 3
    /// x 3 steps, f32 x 3 centre, u16 x 3 start, u16 x 3 extent, voxels.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let mut reader = Reader::new(
            bytes,
            "an IMAGE has 72 bytes of header (version 1) and voxels as many as its sub-volume has",
        );
        if reader.u16()? != LAYOUT_VERSION {
            return reader.refuse();
        }
        let [components, scalar, endian, frame] = *reader.array()?;
        let endian = match endian {
            1 => Endian::Big,
            2 => Endian::Little,
            _ => return Err(Refusal::Form("the endian of an IMAGE is 1 (big) or 2 (little)")),
        };
        let frame = match frame {
            1 => ImageFrame::Ras,
            2 => ImageFrame::Lps,
            _ => return Err(Refusal::Form("the frame of an IMAGE is 1 (RAS) or 2 (LPS)")),
        };
        let Some(scalar) = Scalar::of(scalar) else {
            return Err(Refusal::Form("the scalar of an IMAGE is 2 to 7, 10 or 11"));
        };
        let layout = ImageLayout {
            components,
            scalar,
            endian,
            frame,
            size: reader.u16s()?,
            steps: [reader.f32s()?, reader.f32s()?, reader.f32s()?],
            centre: reader.f32s()?,
            start: reader.u16s()?,
            extent: reader.u16s()?,
        };
        if layout.fault().is_some() {
            return Err(Refusal::Form(
                "the sub-volume of an IMAGE lies within it and a voxel has 1 component or more",
            ));
        }
        let data = reader.take(layout.data_bytes())?;
        reader.end()?;
        Ok(Self { layout, data: data.to_vec() })
    }

    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let layout = &self.layout;
        let endian = match layout.endian {
            Endian::Big => 1,
            Endian::Little => 2,
        };
        let frame = match layout.frame {
            ImageFrame::Ras => 1,
            ImageFrame::Lps => 2,
        };
        put_u16s(out, &[LAYOUT_VERSION]);
        out.extend_from_slice(&[layout.components, layout.scalar.number(), endian, frame]);
        put_u16s(out, &layout.size);
        put_f32s(out, layout.steps.as_flattened());
        put_f32s(out, &layout.centre);
        put_u16s(out, &layout.start);
        put_u16s(out, &layout.extent);
        out.extend_from_slice(&self.data);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> ImageLayout {
        ImageLayout {
            components: 1,
            scalar: Scalar::I16,
            endian: Endian::Little,
            frame: ImageFrame::Lps,
            size: [3, 2, 2],
            steps: [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]],
            centre: [10.5, 20.5, 31.0],
            start: [0; 3],
            extent: [3, 2, 2],
        }
    }

    #[test]
    fn the_centre_lies_half_way_between_first_and_last_voxel() {
        let layout = layout();
        assert_eq!(layout.first_voxel(), [10.0, 20.0, 30.0]);
        let centre = ImageLayout::centre_of([10.0, 20.0, 30.0], &layout.steps, layout.size);
        assert_eq!(centre, layout.centre);
    }

    #[test]
    fn an_image_that_does_not_fit_its_layout_is_not_made() {
        assert!(Image::new(layout(), vec![0; 24]).is_ok());
        let short = Image::new(layout(), vec![0; 23]);
        assert_eq!(short, Err(LayoutError::Bytes { given: 23, wanted: 24 }));
        let none = ImageLayout { components: 0, ..layout() };
        assert_eq!(Image::new(none, Vec::new()), Err(LayoutError::NoComponents));
        let out = ImageLayout { start: [0, 1, 0], ..layout() };
        let wanted = LayoutError::SubVolume { axis: 1, start: 1, extent: 2, size: 2 };
        assert_eq!(Image::new(out, vec![0; 24]), Err(wanted));
    }

    #[test]
    fn the_largest_image_is_counted_without_overflow() {
        let all = [u16::MAX; 3];
        let largest = ImageLayout {
            components: 255,
            scalar: Scalar::F64,
            size: all,
            extent: all,
            ..layout()
        };
        assert_eq!(u128::from(largest.data_bytes()), 65535_u128.pow(3) * 255 * 8);
    }

    #[test]
    fn every_scalar_has_a_number_and_bytes() {
        for (scalar, number, bytes) in Scalar::ALL {
            assert_eq!((scalar.number(), scalar.bytes()), (number, bytes));
            assert_eq!(Scalar::of(number), Some(scalar));
        }
        assert!([0, 1, 8, 9, 12, 13].into_iter().all(|number| Scalar::of(number).is_none()));
    }
}

//! A dose from its file.

use super::Dose;
use super::planes::{Planes, numbers};
use crate::data_set::{DataSet, PixelCoding, Value};
use crate::error::Error;
use crate::number::parse_is;
use crate::object::Object;
use crate::pixel_format::{Frame, PixelFormat};
use crate::pixels;
use dicom_core::VR;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::Warning;
use supine_volume::Volume;

/// Most voxels of a dose: 1 GiB in memory.
const MAX_VOXELS: u128 = 1 << 28;

/// Reads an RT dose: absorbed dose in Gy on a regular grid in any orientation.
///
/// 16 or 32 bits unsigned, uncompressed, or 16 bits in a compressed form of one fragment per frame.
/// Dose = stored value x Dose Grid Scaling (PS3.3 C.8.8.3.4). Frames come in any order; they are
/// sorted by their offsets.
///
/// # Errors
/// When the file is no sound RT dose, holds no grid, is relative, or its planes are not equally
/// spaced.
pub fn read_dose(path: &Path) -> Result<Dose, Error> {
    let mut object = Object::open(path)?;
    let class = object.set.text(tags::SOP_CLASS_UID);
    if class != uids::RT_DOSE_STORAGE {
        return object.unsupported(format!("not an RT dose: {}", crate::folder::kind(&class)));
    }
    if object.set.get(tags::PIXEL_DATA).is_none() {
        return object.unsupported("an RT dose without a grid (histograms or points only)");
    }
    let mut warnings = Vec::from_iter(object.told_behind());
    absorbed(&object, &mut warnings)?;
    let layout = Layout::new(&object)?;
    let Planes { grid, order } = Planes::new(&object, layout.size())?;
    let [step_gy] = numbers(&object, tags::DOSE_GRID_SCALING, "Dose Grid Scaling")?;
    if step_gy <= 0.0 {
        return object.fail("Dose Grid Scaling", format!("is {step_gy}; it must be above 0"));
    }
    let stored = layout.stored(&mut object)?;
    let plane = layout.rows * layout.columns;
    let mut dose = Vec::with_capacity(stored.len());
    for frame in order {
        let values = &stored[frame * plane..(frame + 1) * plane];
        dose.extend(values.iter().map(|&v| (f64::from(v) * step_gy) as f32));
    }
    if dose.iter().all(|&d| d == 0.0) {
        warnings.push(Warning::new("dose-zero", "the dose is 0 everywhere"));
    }
    let volume = Volume::new(grid, dose)
        .or_else(|e| object.fail("Pixel Data", format!("does not fill the grid: {e}")))?;
    let Object { file, set: header, .. } = object;
    Ok(Dose { file, volume, header, step_gy, warnings })
}

/// The values must be absorbed dose in Gy.
fn absorbed(object: &Object, warnings: &mut Vec<Warning>) -> Result<(), Error> {
    match object.set.text(tags::DOSE_UNITS).as_str() {
        "GY" => {}
        "RELATIVE" => {
            return object.fail(
                "Dose Units",
                "is RELATIVE: shares of a dose that the file does not name; export it in Gy",
            );
        }
        other => return object.fail("Dose Units", format!("is {other:?}; only GY is read")),
    }
    match object.set.text(tags::DOSE_TYPE).as_str() {
        "PHYSICAL" => Ok(()),
        "EFFECTIVE" => {
            let text = "the dose is EFFECTIVE: weighted for its biological effect";
            warnings.push(Warning::new("dose-effective", text));
            Ok(())
        }
        other => object.fail("Dose Type", format!("is {other:?}, not PHYSICAL or EFFECTIVE")),
    }
}

/// Size and bits of the stored values.
struct Layout {
    columns: usize,
    rows: usize,
    frames: usize,
    bits_allocated: u16,
    bits_stored: u16,
}

impl Layout {
    fn new(object: &Object) -> Result<Self, Error> {
        let set = &object.set;
        let side = |tag| usize::from(set.u16(tag).unwrap_or(0));
        let (rows, columns) = (side(tags::ROWS), side(tags::COLUMNS));
        let frames = parse_is(&set.text(tags::NUMBER_OF_FRAMES)).unwrap_or(1);
        let frames = usize::try_from(frames).unwrap_or(0);
        if rows < 2 || columns < 2 {
            return object.fail("Rows x Columns", format!("is {rows} x {columns}; 2 x 2 or more"));
        }
        if frames < 2 {
            let reason = format!("is {frames}; a dose to be carried has 2 planes or more");
            return object.fail("Number of Frames", reason);
        }
        let voxels = rows as u128 * columns as u128 * frames as u128;
        if voxels > MAX_VOXELS {
            let reason = format!("is {frames}: {voxels} voxels, at most {MAX_VOXELS} are read");
            return object.fail("Number of Frames", reason);
        }
        let number = |tag| set.u16(tag).unwrap_or(0);
        let bits_allocated = number(tags::BITS_ALLOCATED);
        let bits_stored = number(tags::BITS_STORED);
        let sound = matches!(bits_allocated, 16 | 32)
            && (1..=bits_allocated).contains(&bits_stored)
            && number(tags::HIGH_BIT) == bits_stored - 1;
        if !sound {
            let reason = format!("{bits_allocated} and Bits Stored {bits_stored} are not read");
            return object.fail("Bits Allocated", reason);
        }
        if number(tags::PIXEL_REPRESENTATION) != 0 {
            return object.fail("Pixel Representation", "says signed: a dose is not negative");
        }
        if number(tags::SAMPLES_PER_PIXEL) != 1
            || set.text(tags::PHOTOMETRIC_INTERPRETATION) != "MONOCHROME2"
        {
            return object.fail("Photometric Interpretation", "is not MONOCHROME2 with 1 sample");
        }
        Ok(Self { columns, rows, frames, bits_allocated, bits_stored })
    }

    fn size(&self) -> [usize; 3] {
        [self.columns, self.rows, self.frames]
    }

    /// The stored values, frame by frame; takes the pixels out of the object.
    fn stored(&self, object: &mut Object) -> Result<Vec<u32>, Error> {
        let coding = object.syntax.pixel_coding();
        match object.set.remove(tags::PIXEL_DATA).map(|e| e.value) {
            Some(Value::Bytes(bytes)) if coding == PixelCoding::Native => {
                self.native(object, &bytes)
            }
            Some(Value::Fragments(fragments)) if coding != PixelCoding::Native => {
                self.compressed(object, fragments)
            }
            _ => object.fail("Pixel Data", "is not coded as the transfer syntax says"),
        }
    }

    fn native(&self, object: &Object, bytes: &[u8]) -> Result<Vec<u32>, Error> {
        let width = usize::from(self.bits_allocated / 8);
        let [columns, rows, frames] = self.size();
        let needed = columns * rows * frames * width;
        if bytes.len() < needed || bytes.len() > needed + 1 {
            let reason = format!(
                "has {} bytes, {frames} frames of {rows} x {columns} need {needed}",
                bytes.len()
            );
            return object.fail("Pixel Data", reason);
        }
        // What stands above Bits Stored is no part of the value.
        let mask = u32::MAX >> (32 - self.bits_stored);
        let value = |b: &[u8]| match *b {
            [a, b, c, d] => u32::from_le_bytes([a, b, c, d]),
            [a, b] => u32::from(u16::from_le_bytes([a, b])),
            _ => 0,
        };
        Ok(bytes[..needed].chunks_exact(width).map(|b| value(b) & mask).collect())
    }

    /// One fragment per frame, each decoded as a slice of a CT is.
    fn compressed(&self, object: &Object, fragments: Vec<Vec<u8>>) -> Result<Vec<u32>, Error> {
        let name = object.syntax.name();
        let known = object.syntax.pixel_coding() != PixelCoding::Unknown;
        if !known || self.bits_allocated != 16 || fragments.len() != self.frames + 1 {
            return object.unsupported(format!(
                "an RT dose of {} bits in the compressed form {name} ({}) with {} fragments, which \
                 is not read; store it uncompressed",
                self.bits_allocated,
                object.syntax.uid(),
                fragments.len().saturating_sub(1)
            ));
        }
        let format = PixelFormat {
            rows: self.rows as u16,
            columns: self.columns as u16,
            bits_allocated: self.bits_allocated,
            bits_stored: self.bits_stored,
            signed: false,
        };
        let mut stored = Vec::with_capacity(self.rows * self.columns * self.frames);
        for fragment in fragments.into_iter().skip(1) {
            let mut frame = DataSet::default();
            let value = Value::Fragments(vec![Vec::new(), fragment]);
            frame.put(tags::PIXEL_DATA, VR::OB, value);
            let samples =
                pixels::samples(&object.file, &frame, &object.syntax, format, Frame::ONLY)?;
            stored.extend(samples.iter().map(|&s| format.pattern(s) as u32));
        }
        Ok(stored)
    }
}

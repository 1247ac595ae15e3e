//! DICOM segmentations (PS3.3 A.51) in and out.

mod carried;
mod codes;
mod colour;
mod frames;
mod marked;
mod read_back;
mod write;

pub use carried::write_carried_segmentation;
pub use codes::Meaning;
pub use write::{SegmentationInfo, SegmentationParams, write_segmentation};

use crate::character_set::readable_in;
use crate::data_set::{DataSet, PixelCoding, Value};
use crate::error::Error;
use crate::number::parse_is;
use crate::object::Object;
use dicom_dictionary_std::{tags, uids};
use frames::{Frame, Shape, group};
use std::path::Path;
use supine_space::{Grid, Warning};
use supine_volume::Volume;

/// One segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Segment Number, by which frames name it.
    pub number: u16,
    /// Segment Label.
    pub name: String,
    /// What its type code says, when it is one that matters here.
    pub meaning: Option<Meaning>,
}

/// A segmentation on the grid of a CT. The voxels stay packed as in the file until they are asked.
/// It names the patient: not for logs, hence only the segments in its `Debug`.
pub struct Segmentation {
    pub(crate) file: String,
    /// All but the pixels.
    pub(crate) header: DataSet,
    pub(crate) segments: Vec<Segment>,
    warnings: Vec<Warning>,
    grid: Grid,
    shape: Shape,
    frames: Vec<Frame>,
    coding: Coding,
    bytes: Vec<u8>,
}

/// How a pixel says that it belongs to a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Coding {
    /// One bit, the first pixel in the lowest (PS3.5 8.1.1).
    Bits,
    /// A share of 255 or less of this maximum.
    Share(u16),
    /// The segment's number, in bytes of this width.
    Number(usize),
}

impl std::fmt::Debug for Segmentation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Segmentation({} segments)", self.segments.len())
    }
}

impl Segmentation {
    /// The segments, in the order of the file.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Bytes of its pixels as they are held.
    pub fn held_bytes(&self) -> usize {
        self.bytes.len()
    }

    /// What a user must know before trusting it.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The voxels of a segment, on the grid of the CT; none where it has no frame.
    pub fn mask(&self, number: u16) -> Volume<bool> {
        let mut mask = Volume::from_fn(self.grid.clone(), |_| false);
        let Shape { rows, columns } = self.shape;
        for (n, frame) in self.frames.iter().enumerate() {
            if frame.segment.is_some_and(|s| s != number) {
                continue;
            }
            for row in 0..rows {
                let first = (n * rows + row) * columns;
                for column in 0..columns {
                    if self.holds(first + column, number) {
                        mask.data_mut()[frame.voxel(row, column)] = true;
                    }
                }
            }
        }
        mask
    }

    /// Whether a pixel of a frame of the segment belongs to it.
    #[inline]
    fn holds(&self, pixel: usize, number: u16) -> bool {
        match self.coding {
            Coding::Bits => self.bytes[pixel / 8] >> (pixel % 8) & 1 == 1,
            Coding::Share(all) => 2 * u16::from(self.bytes[pixel]) >= all,
            Coding::Number(1) => u16::from(self.bytes[pixel]) == number,
            Coding::Number(_) => {
                u16::from_le_bytes([self.bytes[2 * pixel], self.bytes[2 * pixel + 1]]) == number
            }
        }
    }
}

/// Reads a segmentation that lies on the voxels of a CT.
///
/// Types BINARY, LABELMAP and FRACTIONAL (cut at half of its maximum, with a warning), as they are
/// stored without compression. Frames may be in any order, and cover a part of the CT or turn its
/// axes, as long as every pixel is a voxel within 0.01 mm. `frame_of_reference` is that of the CT;
/// a CT that did not come as DICOM has none, and then it is not compared.
///
/// # Errors
/// When the file is no sound segmentation, belongs to another frame of reference, or its pixels are
/// no voxels of the grid.
pub fn read_segmentation(
    path: &Path,
    grid: &Grid,
    frame_of_reference: Option<&str>,
) -> Result<Segmentation, Error> {
    let mut object = Object::open(path)?;
    let class = object.set.text(tags::SOP_CLASS_UID);
    if class != uids::SEGMENTATION_STORAGE && class != uids::LABEL_MAP_SEGMENTATION_STORAGE {
        return object.unsupported(format!("not a segmentation: {}", crate::folder::kind(&class)));
    }
    if object.syntax.pixel_coding() != PixelCoding::Native {
        return object.unsupported(format!(
            "a segmentation in the compressed form {}; store it uncompressed",
            object.syntax.name()
        ));
    }
    let frame = object.set.text(tags::FRAME_OF_REFERENCE_UID);
    same_frame_of_reference(&object.file, &frame, frame_of_reference)?;
    let mut warnings = Vec::from_iter(object.told_behind());
    if frame_of_reference.is_none() {
        warnings.push(not_compared());
    }
    let coding = coding(&object, &mut warnings)?;
    let mut segments = segments(&object)?;
    if let Coding::Number(_) = coding {
        // The number of what is no segment (PS3.3 C.8.20.2.3.4).
        segments.retain(|s| s.number != 0);
    }
    let shape = shape(&object)?;
    let bytes = match object.set.remove(tags::PIXEL_DATA).map(|e| e.value) {
        Some(Value::Bytes(bytes)) => bytes,
        _ => return object.fail("Pixel Data", "is missing"),
    };
    let frames = frames(&object, grid, shape, coding, &segments)?;
    let pixels = (frames.len() as u128) * (shape.rows as u128) * (shape.columns as u128);
    let needed = match coding {
        Coding::Bits => pixels.div_ceil(8),
        Coding::Share(_) => pixels,
        Coding::Number(width) => pixels * width as u128,
    };
    if (bytes.len() as u128) < needed {
        let reason = format!("has {} bytes, {} frames need {needed}", bytes.len(), frames.len());
        return object.fail("Pixel Data", reason);
    }
    let Object { file, set: mut header, .. } = object;
    header.remove(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE);
    let grid = grid.clone();
    Ok(Segmentation { file, header, segments, warnings, grid, shape, frames, coding, bytes })
}

/// Said when the CT names no frame of reference.
pub(crate) fn not_compared() -> Warning {
    let text = "the CT did not come as DICOM and names no frame of reference: only the positions say \
                that the labels belong to it";
    Warning::new("frame-of-reference-not-compared", text)
}

/// Regions of another frame of reference lie somewhere else, even when the numbers fit.
pub(crate) fn same_frame_of_reference(
    file: &str,
    found: &str,
    wanted: Option<&str>,
) -> Result<(), Error> {
    match wanted {
        Some(wanted) if wanted != found => Err(Error::attribute(
            file,
            "Frame of Reference UID",
            "is not that of the CT: it was drawn on another scan; register it to this CT first",
        )),
        _ => Ok(()),
    }
}

/// Frame of Reference UID of an object; empty when it has none. For who has to compare it before
/// the object is read onto a grid.
///
/// # Errors
/// When the file is no sound DICOM file.
pub fn frame_of_reference(path: &Path) -> Result<String, Error> {
    Ok(Object::open(path)?.set.text(tags::FRAME_OF_REFERENCE_UID))
}

fn segments(object: &Object) -> Result<Vec<Segment>, Error> {
    let sets = object.set.text(tags::SPECIFIC_CHARACTER_SET);
    let mut segments: Vec<Segment> = Vec::new();
    for item in object.set.items(tags::SEGMENT_SEQUENCE) {
        let Some(number) = item.u16(tags::SEGMENT_NUMBER) else {
            return object.fail("Segment Number", "is missing");
        };
        if segments.iter().any(|s| s.number == number) {
            return object.fail("Segment Number", format!("{number} is there twice"));
        }
        let name = readable_in(&sets, item, tags::SEGMENT_LABEL);
        segments.push(Segment { number, name, meaning: codes::meaning(item) });
    }
    if segments.is_empty() {
        return object.fail("Segment Sequence", "holds no segment");
    }
    Ok(segments)
}

fn coding(object: &Object, warnings: &mut Vec<Warning>) -> Result<Coding, Error> {
    let kind = object.set.text(tags::SEGMENTATION_TYPE);
    let bits = object.set.u16(tags::BITS_ALLOCATED).unwrap_or(0);
    match (kind.as_str(), bits) {
        ("BINARY", 1) => Ok(Coding::Bits),
        ("FRACTIONAL", 8) => {
            let Some(all) = object.set.u16(tags::MAXIMUM_FRACTIONAL_VALUE).filter(|m| *m > 0)
            else {
                return object.fail("Maximum Fractional Value", "is missing or 0");
            };
            let text =
                "the segmentation is fractional; voxels of half the maximum or more are taken";
            warnings.push(Warning::new("segmentation-fractional", text));
            Ok(Coding::Share(all))
        }
        ("LABELMAP", 8 | 16) => Ok(Coding::Number(usize::from(bits / 8))),
        _ => object.unsupported(format!(
            "a segmentation of type {kind:?} with {bits} bits per pixel; BINARY (1), FRACTIONAL \
             (8) and LABELMAP (8, 16) are read"
        )),
    }
}

fn shape(object: &Object) -> Result<Shape, Error> {
    let size = |tag| object.set.u16(tag).map(usize::from).filter(|n| *n > 0);
    match (size(tags::ROWS), size(tags::COLUMNS)) {
        (Some(rows), Some(columns)) => Ok(Shape { rows, columns }),
        _ => object.fail("Rows or Columns", "is missing or 0"),
    }
}

/// Every frame in its place.
fn frames(
    object: &Object,
    grid: &Grid,
    shape: Shape,
    coding: Coding,
    segments: &[Segment],
) -> Result<Vec<Frame>, Error> {
    let items = object.set.items(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE);
    let stated = parse_is(&object.set.text(tags::NUMBER_OF_FRAMES));
    if stated != i64::try_from(items.len()).ok() {
        let reason = format!("is not {}, the number of frames that are described", items.len());
        return object.fail("Number of Frames", reason);
    }
    let none = DataSet::default();
    let shared = object.set.items(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE).first().unwrap_or(&none);
    let mut frames = Vec::new();
    for (n, own) in items.iter().enumerate() {
        let segment = match coding {
            Coding::Number(_) => None,
            _ => {
                let named = group(own, shared, tags::SEGMENT_IDENTIFICATION_SEQUENCE)
                    .and_then(|g| g.u16(tags::REFERENCED_SEGMENT_NUMBER));
                let known = named.filter(|n| segments.iter().any(|s| s.number == *n));
                if known.is_none() {
                    let reason = format!("of frame {} names no segment that is there", n + 1);
                    return object.fail("Referenced Segment Number", reason);
                }
                known
            }
        };
        match Frame::place(grid, shape, segment, own, shared) {
            Ok(frame) => frames.push(frame),
            Err(reason) => {
                let reason = format!("frame {} {reason}", n + 1);
                return Err(Error::OtherVoxels { file: object.file.clone(), reason });
            }
        }
    }
    Ok(frames)
}

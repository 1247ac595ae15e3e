//! Labels as a segmentation object of the CT they were made on.

use super::marked::Marked;
use super::{codes, colour, read_back};
use crate::clock::Clock;
use crate::data_set::{DataSet, Value, encode, part10};
use crate::deformed::{MANUFACTURER, MODEL};
use crate::derived::{
    PATIENT_AND_STUDY, REQUIRED_OF_ALL, check_clock, check_text, code, copy, image_reference,
    instance_reference, put_lossy, put_missing,
};
use crate::error::Error;
use crate::geometry::{grid_of, same_grid};
use crate::number::format_ds;
use crate::series::{self, Place};
use crate::source::Source;
use crate::{uid, whole_file};
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};
use sha2::{Digest as _, Sha256};
use std::path::Path;
use supine_space::Grid;
use supine_volume::{LabelMap, label};

/// What a segmentation says about itself.
#[derive(Clone, Debug)]
pub struct SegmentationParams {
    /// Series Description, 64 characters at most.
    pub series_description: String,
    /// Whether no user had a part in the labels: Segment Algorithm Type AUTOMATIC, else
    /// SEMIAUTOMATIC.
    pub automatic: bool,
    /// Segment Algorithm Name, 64 characters at most.
    pub algorithm: String,
    /// Date and time written everywhere "now" is meant.
    pub clock: Clock,
    /// How many segmentations were written beside the CT before: decides the Series Number of a
    /// carried one.
    pub before: usize,
    /// Version of this software, 64 characters at most.
    pub software_version: String,
}

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct SegmentationInfo {
    /// The new Series Instance UID.
    pub series_uid: String,
    /// The new SOP Instance UID.
    pub instance_uid: String,
    /// Names of the segments.
    pub segments: Vec<String>,
    /// Frames written.
    pub frames: usize,
}

/// Number, name and colour (sRGB) of a label.
pub(super) type Label = (u8, &'static str, [u8; 3]);

/// One frame: the slice it lies on and its segment, counted from 0.
#[derive(Clone, Copy)]
struct Frame {
    segment: usize,
    slice: usize,
}

/// Writes labels as one segmentation object (PS3.3 A.51, type BINARY) into the file `path`.
///
/// The labels must lie on the grid of the source. A label is a segment, with the names and colours
/// of [`supine_volume::label::ALL`] and SNOMED CT codes; a slice where it has no voxel has no
/// frame. Patient, study, geometry strings and frame of reference are the source's, and every frame
/// names the slice it was made from. UIDs are 2.25 from the hash of all that is written. The file
/// appears only when it was read back equal.
///
/// # Errors
/// When the labels do not fit the source, hold a label without name or none at all, a text does not
/// fit its attribute, the file cannot be written or does not read back. Nothing is left then.
pub fn write_segmentation(
    labels: &LabelMap,
    source: &Source,
    params: &SegmentationParams,
    path: &Path,
) -> Result<SegmentationInfo, Error> {
    check(params)?;
    same_grid(labels.grid(), &grid_of(source)?)?;
    let segments = present(labels)?;
    let mut set = common(source, params);
    put_segments(&mut set, params, &segments);
    let names = segments.iter().map(|(_, name, _)| (*name).to_owned()).collect();
    let holds = |segment: usize, voxel: usize| labels.data()[voxel] == segments[segment].0;
    let marked = Marked { grid: labels.grid(), carried: None, names, holds: &holds };
    marked.write(set, source, params, path)
}

impl Marked<'_> {
    /// Puts the voxels beside the segments that `set` describes, and writes the object.
    pub(super) fn write(
        self,
        mut set: DataSet,
        source: &Source,
        params: &SegmentationParams,
        path: &Path,
    ) -> Result<SegmentationInfo, Error> {
        let frames = frames(&self);
        put_shared(&mut set, source, self.grid);
        put_frames(&mut set, source, &frames);
        put_pixels(&mut set, &self, &frames);
        put_references(&mut set, source);
        // The hash covers all but the UIDs that are made from it.
        let hash: [u8; 32] = Sha256::digest(encode(&set)).into();
        let series_uid = uid::from_content("segmentation series", &hash);
        let instance_uid = uid::from_content("segmentation", &hash);
        set.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &series_uid);
        set.put_text(tags::SOP_INSTANCE_UID, VR::UI, &instance_uid);
        let number = match self.carried {
            Some(before) => Place::Segmentation(before).beside(source),
            None => Place::Labels.alone(&hash, source),
        };
        set.put_text(tags::SERIES_NUMBER, VR::IS, &number.to_string());
        put_dimensions(&mut set, &uid::from_content("segmentation dimensions", &hash));
        let version: String = params.software_version.chars().take(9).collect();
        let bytes = part10(&set, &format!("SUPINE_{version}"));
        whole_file::write(path, &bytes, |written| {
            read_back::check(written, &set, &self, &source.frame_of_reference_uid())
        })?;
        Ok(SegmentationInfo {
            series_uid,
            instance_uid,
            segments: self.names,
            frames: frames.len(),
        })
    }
}

pub(super) fn check(params: &SegmentationParams) -> Result<(), Error> {
    let one = |text: &str| !text.is_empty() && !text.contains('\\');
    let SegmentationParams { series_description, algorithm, software_version, .. } = params;
    check_text("Series Description", series_description, 64, one(series_description))?;
    check_text("Segment Algorithm Name", algorithm, 64, one(algorithm))?;
    check_text("Software Versions", software_version, 64, one(software_version))?;
    check_clock(&params.clock)
}

/// The labels that are there, ascending.
fn present(labels: &LabelMap) -> Result<Vec<Label>, Error> {
    let mut seen = [false; 256];
    labels.data().iter().for_each(|&l| seen[usize::from(l)] = true);
    seen[usize::from(label::OUTSIDE)] = false;
    let known = |n: usize| label::ALL.iter().find(|(l, ..)| usize::from(*l) == n).copied();
    let numbers = (0..seen.len()).filter(|&n| seen[n]);
    let segments: Option<Vec<Label>> = numbers.map(known).collect();
    let refused = |reason: &str| Error::Text { attribute: "Segment Label", reason: reason.into() };
    match segments {
        Some(segments) if !segments.is_empty() => Ok(segments),
        Some(_) => Err(refused("the label map holds no label")),
        None => Err(refused("a label of the map has no name")),
    }
}

/// The frames: by segment, then along the normal; slices without a voxel of a segment have none.
fn frames(marked: &Marked<'_>) -> Vec<Frame> {
    let [ni, nj, nk] = marked.grid.size();
    let mut frames = Vec::new();
    for segment in 0..marked.names.len() {
        let any = |k: &usize| (k * ni * nj..(k + 1) * ni * nj).any(|n| (marked.holds)(segment, n));
        frames.extend((0..nk).filter(any).map(|slice| Frame { segment, slice }));
    }
    frames
}

/// Patient, study, series, equipment and what the object is.
pub(super) fn common(source: &Source, params: &SegmentationParams) -> DataSet {
    let first = &source.slices[0].header;
    let mut set = DataSet::default();
    for &tag in PATIENT_AND_STUDY {
        copy(&mut set, tag, first);
    }
    copy(&mut set, tags::FRAME_OF_REFERENCE_UID, first);
    copy(&mut set, tags::POSITION_REFERENCE_INDICATOR, first);
    put_missing(&mut set, REQUIRED_OF_ALL);
    let Clock { date, time } = &params.clock;
    let description = series::described(&params.series_description, source);
    for (tag, vr, text) in [
        (tags::SOP_CLASS_UID, VR::UI, uids::SEGMENTATION_STORAGE),
        (tags::MODALITY, VR::CS, "SEG"),
        (tags::INSTANCE_CREATION_DATE, VR::DA, date),
        (tags::SERIES_DATE, VR::DA, date),
        (tags::CONTENT_DATE, VR::DA, date),
        (tags::INSTANCE_CREATION_TIME, VR::TM, time),
        (tags::SERIES_TIME, VR::TM, time),
        (tags::CONTENT_TIME, VR::TM, time),
        (tags::SERIES_DESCRIPTION, VR::LO, &description),
        (tags::INSTANCE_NUMBER, VR::IS, "1"),
        // The labels cover the chest, an unpaired part: it has no laterality.
        (tags::BODY_PART_EXAMINED, VR::CS, "CHEST"),
        (tags::MANUFACTURER, VR::LO, MANUFACTURER),
        (tags::MANUFACTURER_MODEL_NAME, VR::LO, MODEL),
        (tags::DEVICE_SERIAL_NUMBER, VR::LO, "0"),
        (tags::SOFTWARE_VERSIONS, VR::LO, &params.software_version),
        (tags::IMAGE_TYPE, VR::CS, "DERIVED\\PRIMARY"),
        (tags::CONTENT_LABEL, VR::CS, "LABELS"),
        (tags::CONTENT_DESCRIPTION, VR::LO, &params.series_description),
        (tags::CONTENT_CREATOR_NAME, VR::PN, ""),
        (tags::SEGMENTATION_TYPE, VR::CS, "BINARY"),
        (tags::SEGMENTS_OVERLAP, VR::CS, "NO"),
    ] {
        set.put_text(tag, vr, text);
    }
    put_lossy(&mut set, source);
    set
}

fn put_segments(set: &mut DataSet, params: &SegmentationParams, segments: &[Label]) {
    let items = segments.iter().enumerate().map(|(n, (number, name, rgb))| {
        let mut item = DataSet::default();
        item.put_u16(tags::SEGMENT_NUMBER, VR::US, n as u16 + 1);
        item.put_text(tags::SEGMENT_LABEL, VR::LO, name);
        let kind = if params.automatic { "AUTOMATIC" } else { "SEMIAUTOMATIC" };
        item.put_text(tags::SEGMENT_ALGORITHM_TYPE, VR::CS, kind);
        item.put_text(tags::SEGMENT_ALGORITHM_NAME, VR::LO, &params.algorithm);
        let lab = colour::cielab(*rgb).iter().flat_map(|v| v.to_le_bytes()).collect();
        item.put(tags::RECOMMENDED_DISPLAY_CIE_LAB_VALUE, VR::US, Value::Bytes(lab));
        codes::put(&mut item, *number);
        item
    });
    let items = items.collect();
    set.put_items(tags::SEGMENT_SEQUENCE, items);
}

/// What all frames share: spacing and orientation, in the source's own strings.
fn put_shared(set: &mut DataSet, source: &Source, grid: &Grid) {
    let first = &source.slices[0].header;
    let step = format_ds(grid.spacing().z);
    let mut measures = DataSet::default();
    measures.put_text(tags::SLICE_THICKNESS, VR::DS, &step);
    copy(&mut measures, tags::SLICE_THICKNESS, first);
    measures.put_text(tags::SPACING_BETWEEN_SLICES, VR::DS, &step);
    copy(&mut measures, tags::PIXEL_SPACING, first);
    let mut orientation = DataSet::default();
    copy(&mut orientation, tags::IMAGE_ORIENTATION_PATIENT, first);
    let mut shared = DataSet::default();
    shared.put_items(tags::PIXEL_MEASURES_SEQUENCE, vec![measures]);
    shared.put_items(tags::PLANE_ORIENTATION_SEQUENCE, vec![orientation]);
    set.put_items(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE, vec![shared]);
}

/// What each frame has of its own: segment, place, dimension indices and source image.
fn put_frames(set: &mut DataSet, source: &Source, frames: &[Frame]) {
    let mut slices: Vec<usize> = frames.iter().map(|f| f.slice).collect();
    slices.sort_unstable();
    slices.dedup();
    let item = |frame: &Frame| {
        let slice = &source.slices[frame.slice];
        let number = frame.segment as u16 + 1;
        let mut content = DataSet::default();
        // Both indices count from 1; that of the place among the places that have a frame.
        let place = slices.partition_point(|&s| s < frame.slice) as u32 + 1;
        let indices = [u32::from(number), place].iter().flat_map(|n| n.to_le_bytes()).collect();
        content.put(tags::DIMENSION_INDEX_VALUES, VR::UL, Value::Bytes(indices));
        let mut position = DataSet::default();
        copy(&mut position, tags::IMAGE_POSITION_PATIENT, &slice.header);
        let mut segment = DataSet::default();
        segment.put_u16(tags::REFERENCED_SEGMENT_NUMBER, VR::US, number);
        let mut image = image_reference(slice);
        image.put_text(tags::SPATIAL_LOCATIONS_PRESERVED, VR::CS, "YES");
        let purpose = code("DCM", "121322", "Source image for image processing operation");
        image.put_items(tags::PURPOSE_OF_REFERENCE_CODE_SEQUENCE, vec![purpose]);
        let mut derivation = DataSet::default();
        let segmented = code("DCM", "113076", "Segmentation");
        derivation.put_items(tags::DERIVATION_CODE_SEQUENCE, vec![segmented]);
        derivation.put_items(tags::SOURCE_IMAGE_SEQUENCE, vec![image]);
        let mut groups = DataSet::default();
        groups.put_items(tags::FRAME_CONTENT_SEQUENCE, vec![content]);
        groups.put_items(tags::PLANE_POSITION_SEQUENCE, vec![position]);
        groups.put_items(tags::SEGMENT_IDENTIFICATION_SEQUENCE, vec![segment]);
        groups.put_items(tags::DERIVATION_IMAGE_SEQUENCE, vec![derivation]);
        groups
    };
    set.put_text(tags::NUMBER_OF_FRAMES, VR::IS, &frames.len().to_string());
    set.put_items(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE, frames.iter().map(item).collect());
}

/// The frames are indexed by segment, then by place (PS3.3 C.7.6.17).
fn put_dimensions(set: &mut DataSet, organisation: &str) {
    let dimension = |pointer: Tag, group: Tag, label: &str| {
        let at = |tag: Tag| Value::Bytes([tag.0.to_le_bytes(), tag.1.to_le_bytes()].concat());
        let mut item = DataSet::default();
        item.put_text(tags::DIMENSION_ORGANIZATION_UID, VR::UI, organisation);
        item.put(tags::DIMENSION_INDEX_POINTER, VR::AT, at(pointer));
        item.put(tags::FUNCTIONAL_GROUP_POINTER, VR::AT, at(group));
        item.put_text(tags::DIMENSION_DESCRIPTION_LABEL, VR::LO, label);
        item
    };
    let mut organised = DataSet::default();
    organised.put_text(tags::DIMENSION_ORGANIZATION_UID, VR::UI, organisation);
    set.put_items(tags::DIMENSION_ORGANIZATION_SEQUENCE, vec![organised]);
    let segment = dimension(
        tags::REFERENCED_SEGMENT_NUMBER,
        tags::SEGMENT_IDENTIFICATION_SEQUENCE,
        "Segment Number",
    );
    let place =
        dimension(tags::IMAGE_POSITION_PATIENT, tags::PLANE_POSITION_SEQUENCE, "Image Position");
    set.put_items(tags::DIMENSION_INDEX_SEQUENCE, vec![segment, place]);
}

/// One bit per pixel, the first in the lowest bit, frames one after the other without padding
/// (PS3.5 8.1.1 and 8.2).
fn put_pixels(set: &mut DataSet, marked: &Marked<'_>, frames: &[Frame]) {
    let [columns, rows, _] = marked.grid.size();
    let mut bytes = vec![0u8; (frames.len() * rows * columns).div_ceil(8)];
    for (n, frame) in frames.iter().enumerate() {
        let (from, first) = (frame.slice * rows * columns, n * rows * columns);
        let holds = |pixel: &usize| (marked.holds)(frame.segment, from + pixel);
        for pixel in (0..rows * columns).filter(holds) {
            let bit = first + pixel;
            bytes[bit / 8] |= 1 << (bit % 8);
        }
    }
    for (tag, number) in [
        (tags::SAMPLES_PER_PIXEL, 1),
        (tags::ROWS, rows as u16),
        (tags::COLUMNS, columns as u16),
        (tags::BITS_ALLOCATED, 1),
        (tags::BITS_STORED, 1),
        (tags::HIGH_BIT, 0),
        (tags::PIXEL_REPRESENTATION, 0),
    ] {
        set.put_u16(tag, VR::US, number);
    }
    set.put_text(tags::PHOTOMETRIC_INTERPRETATION, VR::CS, "MONOCHROME2");
    set.put(tags::PIXEL_DATA, VR::OB, Value::Bytes(bytes));
}

/// Common Instance Reference: every slice of the source (PS3.3 C.12.2).
fn put_references(set: &mut DataSet, source: &Source) {
    let mut series = DataSet::default();
    series.put_text(tags::SERIES_INSTANCE_UID, VR::UI, &source.series_uid());
    let mut images: Vec<DataSet> =
        source.slices.iter().map(|s| instance_reference(&s.header)).collect();
    // Frames of one file are one instance.
    images.dedup();
    series.put_items(tags::REFERENCED_INSTANCE_SEQUENCE, images);
    set.put_items(tags::REFERENCED_SERIES_SEQUENCE, vec![series]);
}

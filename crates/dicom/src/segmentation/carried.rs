//! Segments that were carried along, as a segmentation of the exported CT.

use super::marked::Marked;
use super::write::{check, common};
use super::{Segmentation, SegmentationInfo, SegmentationParams};
use crate::character_set::readable_in;
use crate::companion::{characters, plain, same_patient};
use crate::data_set::DataSet;
use crate::derived::{code, copy};
use crate::error::Error;
use crate::geometry::{grid_of, same_grid};
use crate::source::Source;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::tags;
use std::path::Path;
use supine_space::Warning;
use supine_volume::Volume;

/// What says which segment it is.
const NAMED: &[Tag] = &[
    tags::SEGMENT_LABEL,
    tags::SEGMENT_DESCRIPTION,
    tags::SEGMENTED_PROPERTY_CATEGORY_CODE_SEQUENCE,
    tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE,
    tags::ANATOMIC_REGION_SEQUENCE,
    tags::RECOMMENDED_DISPLAY_CIE_LAB_VALUE,
];

/// Writes the segments of a segmentation after deformation into the file `path`, as one of the
/// exported CT.
///
/// `masks` are the voxels of the segments of `from`, in its order, on the grid of `ct`. Names,
/// codes and colours are kept; segments are numbered from 1, may overlap, and one without a voxel
/// has no frame. Otherwise as [`super::write_segmentation`].
///
/// # Errors
/// When the segments are of another patient than the CT or hold no voxel at all, the masks do not
/// fit the CT, a text does not fit its attribute, or the file cannot be written or does not read
/// back. Nothing is left then.
pub fn write_carried_segmentation(
    masks: &[Volume<bool>],
    from: &Segmentation,
    ct: &Source,
    params: &SegmentationParams,
    path: &Path,
) -> Result<(SegmentationInfo, Vec<Warning>), Error> {
    check(params)?;
    same_patient(&from.file, &from.header, ct)?;
    let grid = grid_of(ct)?;
    for mask in masks {
        same_grid(mask.grid(), &grid)?;
    }
    let refused =
        |reason: &str| Error::Text { attribute: "Segment Sequence", reason: reason.into() };
    if masks.len() != from.segments.len() {
        return Err(refused("there is not one mask for each segment"));
    }
    if masks.iter().all(|m| m.data().iter().all(|held| !held)) {
        return Err(refused("no segment holds a voxel"));
    }
    let mut warnings = Vec::new();
    let mut set = common(ct, params);
    set.put_text(tags::SEGMENTS_OVERLAP, VR::CS, "UNDEFINED");
    let names = [tags::SEGMENT_SEQUENCE];
    let ascii_only = characters(&mut set, &from.header, &names, &mut warnings);
    let mut items: Vec<DataSet> = from
        .segments
        .iter()
        .enumerate()
        .map(|(n, segment)| item(n, segment.number, from, params))
        .collect();
    if ascii_only {
        items.iter_mut().for_each(plain);
    }
    let sets = set.text(tags::SPECIFIC_CHARACTER_SET);
    let name = |item: &DataSet| readable_in(&sets, item, tags::SEGMENT_LABEL);
    let names = items.iter().map(name).collect();
    set.put_items(tags::SEGMENT_SEQUENCE, items);
    let holds = |segment: usize, voxel: usize| masks[segment].data()[voxel];
    let marked = Marked { grid: &grid, carried: Some(params.before), names, holds: &holds };
    let info = marked.write(set, ct, params, path)?;
    Ok((info, warnings))
}

/// A segment, the `n`-th from 0, that has this number in `from`.
fn item(n: usize, number: u16, from: &Segmentation, params: &SegmentationParams) -> DataSet {
    let mut item = DataSet::default();
    let own = from.header.items(tags::SEGMENT_SEQUENCE).iter();
    let own = own.filter(|i| i.u16(tags::SEGMENT_NUMBER) == Some(number)).take(1);
    own.for_each(|own| NAMED.iter().for_each(|&tag| copy(&mut item, tag, own)));
    item.put_u16(tags::SEGMENT_NUMBER, VR::US, n as u16 + 1);
    let tissue = || vec![code("SCT", "85756007", "Tissue")];
    for tag in [
        tags::SEGMENTED_PROPERTY_CATEGORY_CODE_SEQUENCE,
        tags::SEGMENTED_PROPERTY_TYPE_CODE_SEQUENCE,
    ] {
        if item.items(tag).is_empty() {
            item.put_items(tag, tissue());
        }
    }
    if item.get(tags::SEGMENT_LABEL).is_none() {
        item.put_text(tags::SEGMENT_LABEL, VR::LO, &format!("Segment {number}"));
    }
    let kind = if params.automatic { "AUTOMATIC" } else { "SEMIAUTOMATIC" };
    item.put_text(tags::SEGMENT_ALGORITHM_TYPE, VR::CS, kind);
    item.put_text(tags::SEGMENT_ALGORITHM_NAME, VR::LO, &params.algorithm);
    item
}

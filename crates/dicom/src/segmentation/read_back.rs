//! A segmentation appears under its name only when it reads back as it was meant.

use super::marked::Marked;
use super::read_segmentation;
use crate::data_set::DataSet;
use dicom_dictionary_std::tags;
use dicom_object::open_file;
use std::path::Path;

/// Another reader (dicom-object) must see the same identity and pixels, and ours the same labels.
pub(super) fn check(
    path: &Path,
    meant: &DataSet,
    marked: &Marked<'_>,
    frame_of_reference: &str,
) -> Result<(), String> {
    let object = open_file(path).map_err(|e| e.to_string())?;
    for tag in [tags::SOP_INSTANCE_UID, tags::SERIES_INSTANCE_UID, tags::FRAME_OF_REFERENCE_UID] {
        let element = object.element(tag).map_err(|e| e.to_string())?;
        let text = element.to_str().map_err(|e| e.to_string())?;
        if text.trim_matches([' ', '\0']) != meant.text(tag) {
            return Err(format!("{tag} differs"));
        }
    }
    let pixels = object.element(tags::PIXEL_DATA).map_err(|e| e.to_string())?;
    let pixels = pixels.to_bytes().map_err(|e| e.to_string())?;
    let wanted = meant.bytes(tags::PIXEL_DATA).unwrap_or_default();
    if !pixels.starts_with(wanted) || pixels.len() > wanted.len() + 1 {
        return Err("the pixels differ".into());
    }
    let read = read_segmentation(path, marked.grid, Some(frame_of_reference))
        .map_err(|e| e.to_string())?;
    if read.segments().len() != marked.names.len() {
        return Err("a segment is missing".into());
    }
    for (n, (name, segment)) in marked.names.iter().zip(read.segments()).enumerate() {
        let mask = read.mask(segment.number);
        let differs = |(voxel, m): (usize, &bool)| (marked.holds)(n, voxel) != *m;
        if segment.name != *name || mask.data().iter().enumerate().any(differs) {
            return Err(format!("the segment {name:?} differs"));
        }
    }
    Ok(())
}

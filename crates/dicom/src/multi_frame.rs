//! Enhanced (multi-frame) CT as the single images that the rest of this crate knows.
//!
//! What differs from frame to frame stands in functional groups (PS3.3 C.7.6.16), under the same
//! names as in a CT Image but for a few. Each frame gets a header of its own with the elements of
//! its groups lifted to where a CT Image has them, so that every check of a slice holds for a frame
//! too.

use crate::data_set::{DataSet, Element};
use crate::error::Error;
use crate::number::parse_is;
use dicom_core::{Tag, VR};
use dicom_dictionary_std::{tags, uids};

/// The groups whose elements a CT Image has in its header.
const LIFTED: [Tag; 11] = [
    tags::PIXEL_MEASURES_SEQUENCE,
    tags::PLANE_POSITION_SEQUENCE,
    tags::PLANE_ORIENTATION_SEQUENCE,
    tags::FRAME_CONTENT_SEQUENCE,
    tags::PIXEL_VALUE_TRANSFORMATION_SEQUENCE,
    tags::CT_IMAGE_FRAME_TYPE_SEQUENCE,
    tags::FRAME_VOILUT_SEQUENCE,
    tags::CTX_RAY_DETAILS_SEQUENCE,
    tags::CT_RECONSTRUCTION_SEQUENCE,
    tags::UNASSIGNED_SHARED_CONVERTED_ATTRIBUTES_SEQUENCE,
    tags::UNASSIGNED_PER_FRAME_CONVERTED_ATTRIBUTES_SEQUENCE,
];

/// Numbers that are binary here and text in a CT Image.
const TEXT_THERE: [(Tag, Tag); 2] = [
    (tags::FRAME_ACQUISITION_NUMBER, tags::ACQUISITION_NUMBER),
    (tags::TEMPORAL_POSITION_INDEX, tags::TEMPORAL_POSITION_IDENTIFIER),
];

/// Most frames of a file.
const MAX_FRAMES: usize = 20_000;
/// Most bytes of the headers of all frames: what the frames share is held once for each of them.
const MAX_HEADERS_BYTES: usize = 256 << 20;

/// Whether images of a class are read, and hold several frames each.
pub(crate) fn is_multi_frame(class: &str) -> bool {
    class == uids::ENHANCED_CT_IMAGE_STORAGE
        || class == uids::LEGACY_CONVERTED_ENHANCED_CT_IMAGE_STORAGE
}

/// The header of each frame, in the order of their pixels.
///
/// # Errors
/// When Number of Frames and the functional groups do not go together, or what the frames share is
/// too long to be held for each of them.
pub(crate) fn headers(file: &str, set: &DataSet) -> Result<Vec<DataSet>, Error> {
    let frames = set.text(tags::NUMBER_OF_FRAMES);
    let count = parse_is(&frames).and_then(|n| usize::try_from(n).ok()).unwrap_or(0);
    if !(1..=MAX_FRAMES).contains(&count) {
        let reason = format!("is {frames:?}, not a number from 1 to {MAX_FRAMES}");
        return Err(Error::attribute(file, "Number of Frames", reason));
    }
    let groups = set.items(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE);
    if groups.len() != count {
        let reason = format!("has {} items for {count} frames", groups.len());
        return Err(Error::attribute(file, "Per-Frame Functional Groups Sequence", reason));
    }
    let mut common = set.clone();
    for tag in [
        tags::NUMBER_OF_FRAMES,
        tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE,
        tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE,
        tags::PIXEL_DATA,
        tags::EXTENDED_OFFSET_TABLE,
        tags::EXTENDED_OFFSET_TABLE_LENGTHS,
    ] {
        common.remove(tag);
    }
    for group in set.items(tags::SHARED_FUNCTIONAL_GROUPS_SEQUENCE) {
        lift(group, &mut common);
    }
    let held = common.held().saturating_mul(count);
    if held > MAX_HEADERS_BYTES {
        let reason = format!("is {count}, with {} bytes that all of them share", held / count);
        return Err(Error::attribute(file, "Number of Frames", reason));
    }
    let header = |(n, group): (usize, &DataSet)| {
        let mut header = common.clone();
        lift(group, &mut header);
        header.put_text(tags::INSTANCE_NUMBER, VR::IS, &(n + 1).to_string());
        header
    };
    Ok(groups.iter().enumerate().map(header).collect())
}

/// Puts the elements of the groups into a header.
fn lift(groups: &DataSet, header: &mut DataSet) {
    for macro_sequence in LIFTED {
        let Some(group) = groups.items(macro_sequence).first() else { continue };
        for Element { tag, vr, value } in group.elements() {
            header.put(*tag, *vr, value.clone());
        }
        // What a CT Image calls Image Type.
        if let Some(Element { vr, value, .. }) = group.get(tags::FRAME_TYPE) {
            header.put(tags::IMAGE_TYPE, *vr, value.clone());
        }
        for (theirs, ours) in TEXT_THERE {
            if let Some(number) = group.u16(theirs) {
                header.put_text(ours, VR::IS, &number.to_string());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_set::Value;

    /// `count` frames that say nothing, and a private element of so many bytes that all of them
    /// share.
    fn frames(count: usize, shared: usize) -> Result<Vec<DataSet>, Error> {
        let mut set = DataSet::default();
        set.put_text(tags::NUMBER_OF_FRAMES, VR::IS, &count.to_string());
        let groups = vec![DataSet::default(); count];
        set.put_items(tags::PER_FRAME_FUNCTIONAL_GROUPS_SEQUENCE, groups);
        set.put(Tag(9, 0x1001), VR::OB, Value::Bytes(vec![0; shared]));
        headers("a", &set)
    }

    #[test]
    fn what_all_frames_share_may_not_multiply_without_bound() {
        assert_eq!(frames(100, 1000).unwrap().len(), 100);
        let message = frames(1000, 1 << 20).unwrap_err().to_string();
        assert!(message.contains("Number of Frames is 1000, with 10"), "{message}");
    }
}

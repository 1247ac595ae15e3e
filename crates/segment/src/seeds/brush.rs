//! Strokes of a brush as voxels.

use super::refusal::{SKIN_MM, refused};
use crate::Error;
use crate::body::flag;
use crate::scan::Scan;
use std::collections::BTreeMap;
use supine_volume::{SeedKind, Stroke};

/// What strokes say of voxels, by their offsets: a later stroke counts where it covers one before.
/// A brush is broad: what it covers beside the patient, or where its tissue cannot be, is not
/// meant.
///
/// # Errors
/// When nothing that a stroke covers can be meant.
pub(super) fn brushed(
    scan: Scan<'_>,
    strokes: &[Stroke],
) -> Result<BTreeMap<usize, SeedKind>, Error> {
    let mut told = BTreeMap::new();
    for stroke in strokes {
        let mut any = false;
        stroke.voxels(scan.ct.grid(), |voxel| match stroke.kind {
            None => drop(told.remove(&voxel)),
            Some(kind) if can_be(scan, kind, voxel) => {
                any = true;
                told.insert(voxel, kind);
            }
            Some(_) => {}
        });
        if let (Some(kind), Some(at), false) = (stroke.kind, stroke.points.first(), any) {
            return Err(refused(
                kind,
                *at,
                "covers nothing of the patient that it can mean".into(),
            ));
        }
    }
    Ok(told)
}

/// Whether a voxel can be of a kind: lung and air are no soft tissue, the skin is no chest wall.
fn can_be(scan: Scan<'_>, kind: SeedKind, voxel: usize) -> bool {
    let flags = scan.body.flags[voxel];
    let is_body = flags & flag::BODY != 0;
    match kind {
        SeedKind::Exclude => true,
        SeedKind::SoftTissue => is_body && flags & flag::LUNG == 0,
        SeedKind::ChestWall => is_body && scan.body.depth_mm(voxel) >= SKIN_MM,
    }
}

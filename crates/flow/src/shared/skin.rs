//! The skin of the CT, and the breasts on it.

use crate::Error;
use crate::nodes::{Imported, Segmented};
use std::sync::Arc;
use supine_register::Skin;
use supine_segment::Breast;
use supine_space::{Progress, Side, Sphere};
use supine_volume::{SignedDistance, label};

/// HU between air and skin.
const SKIN_HU: f64 = -400.0;

/// The skin between the voxels: as segmented, or where labels were supplied by the CT along their
/// border.
pub(crate) fn skin_distance(
    input: &Imported,
    segmented: &Segmented,
    progress: Progress<'_>,
) -> Result<Arc<SignedDistance>, Error> {
    if let Some(surfaces) = segmented.surfaces(progress)? {
        return Ok(Arc::new(surfaces.skin.clone()));
    }
    let (labels, ct) = (&segmented.labels, &input.ct);
    let inside = |n: usize| labels.data()[n] != label::OUTSIDE;
    let share = |n: usize, m: usize| {
        let [a, b] = [n, m].map(|n| f64::from(ct.data()[n]));
        if a > SKIN_HU && b < SKIN_HU { ((a - SKIN_HU) / (a - b)) as f32 } else { 0.5 }
    };
    Ok(Arc::new(SignedDistance::new(labels.grid(), SignedDistance::WIDEST_MM, inside, share)))
}

/// The sphere of the other breast; without one in the labels the region's own, mirrored.
pub(crate) fn other_breast(
    left: bool,
    segmented: &Segmented,
    skin: &Skin,
    region: Sphere,
) -> Option<Sphere> {
    let x = skin.points().iter().map(|p| p.x);
    let (low, high) = x.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let mut centre = region.centre();
    centre.x = low + high - centre.x;
    // Elsewhere on that side a raised arm may stand higher than the breast.
    let side = if left { Side::Right } else { Side::Left };
    let breast = Breast::find(&segmented.labels, side, Some(centre));
    if let Ok((sphere, _)) = breast.and_then(|breast| breast.region(&segmented.labels, None)) {
        return Some(sphere);
    }
    Sphere::new(centre, region.radius()).ok()
}

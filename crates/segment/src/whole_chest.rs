//! Whether both sides of the chest are in the CT: a field that ends beside the lung cuts the chest itself.

use crate::Error;
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::quality_check::QualityCheck;
use rayon::prelude::*;
use supine_space::Side;
use supine_volume::Field;

/// The field ends so near to the lung where it cuts the chest, mm: there is no room for a wall. Measured: more than 20 in
/// four real CTs, two of which cut the flanks.
const BESIDE_MM: f64 = 10.0;
/// Share of the slices with lung that refuses. Measured on four real CTs: 0.0; on halves of them cut at the middle 0.30 to 1.0,
/// but 0.02 where the end cuts off so little of the other lung that it does not count as lung.
const REFUSES: f64 = 0.2;

/// What was measured.
///
/// # Errors
/// [`Error::HalfChest`].
pub(crate) fn check(frame: &Frame, body: &Body, field: &Field) -> Result<QualityCheck, Error> {
    let near = field.near_end(BESIDE_MM);
    let slices: Vec<Option<(usize, f32)>> =
        (0..frame.size[2]).into_par_iter().map(|k| beside(frame, body, &near, k)).collect();
    let all = slices.iter().flatten().count();
    let cut = slices.iter().flatten().filter(|(touching, _)| *touching > 0).count();
    let share = cut as f64 / all.max(1) as f64;
    if share > REFUSES {
        let to_left: f32 = slices.iter().flatten().map(|(_, to_left)| to_left).sum();
        let side = if to_left > 0.0 { Side::Left } else { Side::Right };
        return Err(Error::HalfChest { side, percent: 100.0 * share });
    }
    let what = "field that ends beside the lung, share of the slices";
    Ok(QualityCheck::at_most(what, 100.0 * share, "%").refuses(100.0 * REFUSES))
}

/// How many of a slice's voxels of lung are near the end of the field, and how far these lie to the left of the others
/// in sum, mm; `None` without lung.
fn beside(frame: &Frame, body: &Body, near: &[bool], k: usize) -> Option<(usize, f32)> {
    let flags = body.flags_slice(frame, k);
    let lung =
        || (0..flags.len()).filter(|&n| flags[n] & flag::LUNG != 0 && flags[n] & flag::BODY != 0);
    let left = |n: usize| {
        let [x, y] = frame.position(n);
        x * frame.left[0] + y * frame.left[1]
    };
    let all = lung().count();
    let middle = lung().map(left).sum::<f32>() / all as f32;
    let touching = || lung().filter(|&n| near[n]);
    (all > 0).then(|| (touching().count(), touching().map(|n| left(n) - middle).sum()))
}

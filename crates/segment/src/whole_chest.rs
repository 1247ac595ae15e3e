//! Whether both sides of the chest are in the CT: a field that ends beside the lung cuts the chest
//! itself, and so does an end of the body that is as flat as a cut.

use crate::Error;
use crate::body::{Body, flag};
use crate::frame::Frame;
use rayon::prelude::*;
use std::ops::RangeInclusive;
use supine_record::QualityCheck;
use supine_space::Side;
use supine_volume::{Field, median};

/// The field ends so near to the lung where it cuts the chest, mm: there is no room for a wall.
/// Measured: more than 20 in four real CTs, two of which cut the flanks.
const BESIDE_MM: f64 = 10.0;
/// Share of the slices with lung that refuses. Measured on four real CTs: 0.0; on halves of them
/// cut at the middle 0.30 to 1.0, but 0.02 where the end cuts off so little of the other lung that
/// it does not count as lung.
const REFUSES: f64 = 0.2;
/// So does a body that ends, over this share of its depth, in one column of pixels. Measured on
/// four real CTs and four synthetic patients: 0.27 at most, where the field cuts a flank; 0.89 and
/// more on their halves, cropped or filled with air.
const FLAT: f64 = 0.7;
/// A cut may end this far off the body's outermost column, mm: the body's edges are rounded.
/// Chosen, not measured.
const CUT_MM: f32 = 4.0;

/// The first and last of a row of pixels; `None` of none.
type Span = Option<(usize, usize)>;

/// What was measured.
///
/// # Errors
/// [`Error::HalfChest`].
pub(crate) fn check(frame: &Frame, body: &Body, field: &Field) -> Result<[QualityCheck; 2], Error> {
    let flat = flat_side(frame, |n| body.flags[n] & flag::BODY != 0)?;
    Ok([flat, beside_lung(frame, body, field)?])
}

/// Whether the body ends at a side as flat as where it is cut: in most slices its outermost column,
/// the same in all of them, is nearly as deep as it. Flanks that the field cuts are less deep.
/// Lungs need not be found: a cut opens them to the outside.
///
/// # Errors
/// [`Error::HalfChest`].
pub(crate) fn flat_side(
    frame: &Frame,
    is_body: impl Fn(usize) -> bool + Sync,
) -> Result<QualityCheck, Error> {
    let shares = flatness(frame, is_body);
    for (share, side) in shares.into_iter().zip([Side::Right, Side::Left]) {
        if share > FLAT {
            let why =
                format!("the body ends in a flat cut over {:.0} % of its depth", 100.0 * share);
            return Err(Error::HalfChest { side, why });
        }
    }
    let what = "body that ends as flat as a cut, share of its depth";
    let [right, left] = shares.map(|share| 100.0 * share);
    Ok(QualityCheck::at_most(what, right.max(left), "%").refuses(100.0 * FLAT))
}

/// At the right and the left: depth of the body's outermost columns as a share of the body's, the
/// median over its slices.
fn flatness(frame: &Frame, is_body: impl Fn(usize) -> bool + Sync) -> [f64; 2] {
    // The side runs along the columns of the image or along its rows.
    let across = usize::from(frame.left[1].abs() > frame.left[0].abs());
    let slice = |k: usize| depths(frame, across, |n| is_body(k * frame.plane() + n));
    let slices: Vec<Vec<Span>> = (0..frame.size[2]).into_par_iter().map(slice).collect();
    let count = frame.size[across];
    let is_used = |&column: &usize| slices.iter().any(|columns| columns[column].is_some());
    let (Some(first), Some(last)) = ((0..count).find(is_used), (0..count).rfind(is_used)) else {
        return [0.0; 2];
    };
    let columns = (CUT_MM / frame.spacing[across]) as usize;
    let share = |end: RangeInclusive<usize>| {
        let whole = slices.iter().filter(|columns| depth(columns) > 0);
        let share =
            |columns: &Vec<Span>| depth(&columns[end.clone()]) as f32 / depth(columns) as f32;
        median(&mut whole.map(share).collect::<Vec<f32>>()).map_or(0.0, f64::from)
    };
    let low = share(first..=(first + columns).min(last));
    let high = share(last.saturating_sub(columns).max(first)..=last);
    if frame.left[across] > 0.0 { [low, high] } else { [high, low] }
}

/// First and last depth of a slice's body in each column.
fn depths(frame: &Frame, across: usize, is_body: impl Fn(usize) -> bool) -> Vec<Span> {
    let ni = frame.size[0];
    let mut columns = vec![None; frame.size[across]];
    for n in (0..frame.plane()).filter(|&n| is_body(n)) {
        let at = [n % ni, n / ni];
        let depth = at[1 - across];
        columns[at[across]] = joined(columns[at[across]], Some((depth, depth)));
    }
    columns
}

/// The span of both.
fn joined(a: Span, b: Span) -> Span {
    match (a, b) {
        (Some(a), Some(b)) => Some((a.0.min(b.0), a.1.max(b.1))),
        _ => a.or(b),
    }
}

/// Pixels from the first to the last of all columns.
fn depth(columns: &[Span]) -> usize {
    columns.iter().copied().fold(None, joined).map_or(0, |(first, last)| last + 1 - first)
}

/// Whether the field ends beside the lung.
///
/// # Errors
/// [`Error::HalfChest`].
fn beside_lung(frame: &Frame, body: &Body, field: &Field) -> Result<QualityCheck, Error> {
    let near = field.near_end(BESIDE_MM);
    let slices: Vec<Option<(usize, f32)>> =
        (0..frame.size[2]).into_par_iter().map(|k| beside(frame, body, &near, k)).collect();
    let all = slices.iter().flatten().count();
    let cut = slices.iter().flatten().filter(|(touching, _)| *touching > 0).count();
    let share = cut as f64 / all.max(1) as f64;
    if share > REFUSES {
        let to_left: f32 = slices.iter().flatten().map(|(_, to_left)| to_left).sum();
        let side = if to_left > 0.0 { Side::Left } else { Side::Right };
        let percent = 100.0 * share;
        let why =
            format!("the field ends within 10 mm of the lung in {percent:.0} % of the slices");
        return Err(Error::HalfChest { side, why });
    }
    let what = "field that ends beside the lung, share of the slices";
    Ok(QualityCheck::at_most(what, 100.0 * share, "%").refuses(100.0 * REFUSES))
}

/// How many of a slice's voxels of lung are near the end of the field, and how far these lie to the
/// left of the others in sum, mm; `None` without lung.
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

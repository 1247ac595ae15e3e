//! The shell below the ribs: carried on at its last distance under the skin.

use crate::body::flag;
use crate::plane::bilinear;
use crate::radial_map::{RADII, RAYS, RadialMap, Rays, START_MM};
use crate::scan::Scan;
use supine_volume::median;

// Chosen, not measured: without ribs there is no truth to measure against (docs/SEGMENTATION.md,
// Traps).
/// Bone deeper than this below the expected shell is not a rib (spine, contrast in a kidney), mm.
const TOO_DEEP_MM: f32 = 12.0;
/// The distance under the skin follows the ribs with this length, mm.
const FOLLOW_MM: f32 = 5.0;
/// A ray without a rib within these distances has none: mm along the body, rays to the side.
const NEAR_MM: f32 = 12.0;
const NEAR_RAYS: usize = 15 * RAYS / 360;
/// Distance from skin to ribs where nothing is known, mm.
const USUAL_GAP_MM: f32 = 20.0;
/// The shell at the start is that of the ribs within this distance along the body, mm.
const START_NEAR_MM: f32 = 15.0;
/// A slice lies below the ribs when this share of its front rays has none.
const BARE_SHARE: f32 = 0.6;

/// The expected radius follows the skin this far inside and outside the last rib, mm: skin recedes
/// below a breast, where the ribs do not.
const INSIDE_MM: f32 = 15.0;
const OUTSIDE_MM: f32 = 10.0;
/// Whether there are ribs is asked only where the lungs have shrunk to this share of their widest
/// slice.
const LUNG_SHARE: f32 = 0.4;

/// The expected radius on rays that have no rib near them, from the lower third of the lungs
/// towards the feet; NaN where ribs decide.
pub(crate) fn expected(scan: Scan<'_>, shell: &RadialMap, on_bone: &RadialMap) -> RadialMap {
    let slices = shell.slices();
    let order = lower_slices(scan);
    let (mut ribs, mut goals) =
        (RadialMap::new(slices, f32::NAN), RadialMap::new(slices, f32::NAN));
    let spacing = scan.frame.spacing[2];
    let rate = 1.0 - (-spacing / FOLLOW_MM).exp();
    let Some(&start) = order.first() else { return goals };
    let skin = RadialMap::from_fn(slices, |k, p| skin(scan, k, p));
    let near = (START_NEAR_MM / spacing) as usize;
    let window = start.saturating_sub(near)..(start + near + 1).min(slices);
    let at_start = |fallback: f32, value: &(dyn Fn(usize, usize) -> f32 + Sync)| {
        RadialMap::from_fn(1, |_, p| {
            let rib = |&k: &usize| on_bone.at(k, p) > 0.0;
            let mut seen: Vec<f32> = window.clone().filter(rib).map(|k| value(k, p)).collect();
            median(&mut seen).unwrap_or(f32::NAN)
        })
        .filled(spacing, fallback)
    };
    let mut gap = at_start(USUAL_GAP_MM, &|k, p| skin.at(k, p) - shell.at(k, p));
    let mut last = at_start(shell.at(start, 0), &|k, p| shell.at(k, p));
    for &k in &order {
        for p in 0..RAYS {
            let (radius, rib) = (shell.at(k, p), last.at(0, p));
            let under_skin = skin.at(k, p) - gap.at(0, p);
            goals.values[k * RAYS + p] = under_skin.clamp(rib - INSIDE_MM, rib + OUTSIDE_MM);
            if on_bone.at(k, p) > 0.0 && radius > under_skin.min(rib) - TOO_DEEP_MM {
                ribs.values[k * RAYS + p] = 1.0;
                gap.values[p] += rate * (under_skin - radius);
                last.values[p] += rate * (radius - rib);
            }
        }
        gap = gap.median(0, 3);
        last = last.median(0, 3);
    }
    let near = ribs.median((NEAR_MM / spacing) as usize, NEAR_RAYS);
    for n in 0..goals.values.len() {
        let rejected = on_bone.values[n] > 0.0 && ribs.values[n].is_nan();
        // The spine is always there to hold the back.
        let back = scan.rays.to_back[n % RAYS] > 0.5;
        if back || !(near.values[n].is_nan() || rejected) {
            goals.values[n] = f32::NAN;
        }
    }
    goals
}

/// The slices below the ribs.
pub(crate) fn ribless(expected: &RadialMap, rays: &Rays) -> Vec<bool> {
    let front: Vec<usize> = (0..RAYS).filter(|&p| rays.to_back[p] < 0.2).collect();
    (0..expected.slices())
        .map(|k| {
            let bare = front.iter().filter(|&&p| !expected.at(k, p).is_nan()).count();
            bare as f32 > BARE_SHARE * front.len() as f32
        })
        .collect()
}

/// The slices from the lower part of the lungs to the feet, in this order.
fn lower_slices(scan: Scan<'_>) -> Vec<usize> {
    let slices = scan.frame.size[2];
    let lung: Vec<f32> = (0..slices)
        .map(|k| {
            let flags = scan.body.flags_slice(scan.frame, k);
            flags.iter().filter(|&f| f & flag::LUNG != 0).count() as f32
        })
        .collect();
    let widest = (0..slices).fold(0, |best, k| if lung[k] > lung[best] { k } else { best });
    let small = |k: &usize| lung[*k] < LUNG_SHARE * lung[widest];
    if scan.frame.towards_head {
        (0..widest).rev().skip_while(|k| !small(k)).collect()
    } else {
        (widest + 1..slices).skip_while(|k| !small(k)).collect()
    }
}

/// Radius of the skin on a ray, mm.
fn skin(scan: Scan<'_>, k: usize, p: usize) -> f32 {
    let depth = scan.body.depth_slice(scan.frame, k);
    let inside = |r: f32| {
        let at = scan.rays.pixel(k, p, r);
        bilinear(depth, scan.frame.size[0], at, f32::from).is_some_and(|d| d > 0.5)
    };
    let mut radii = (0..RADII + 60).rev().map(|i| START_MM + i as f32);
    radii.find(|&r| inside(r)).unwrap_or(START_MM)
}

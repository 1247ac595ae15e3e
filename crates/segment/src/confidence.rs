//! How far the boundary of the chest wall may be wrong, ray by ray.
//!
//! Measured on contours read from six real CTs, on the surfaces found there and on others that were
//! made wrong on purpose (by weights of the search that no CT supports): the share of rays around
//! without an edge, and how little the ray itself looks like the end of muscle
//! ([`crate::shape_mismatch`]), add to a doubt. A place is as doubtful as what lies beside it, for
//! where the surface leaves the right edge it takes some way along the slice, and more so beside a
//! step of the surface (free borders of muscle, clefts). Compared on these six: with what lies
//! beside, the same share of right places called uncertain holds 88 of 100 that are more than 2 mm
//! off, and 67 without; what else was tried along the rays (other edges near, dense tissue farther
//! out, fat farther in, steps across slices) told no more.

use crate::body::flag;
use crate::frame::Frame;
use crate::plane::near;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::Constraints;
use crate::shell::Shell;
use crate::wall::Wall;
use rayon::prelude::*;
use supine_volume::{LabelMap, Volume, label};

// Constants that are not called measured were chosen.
/// Facts are taken from the rays around: mm along the body, rays to each side.
const AROUND_MM: f32 = 5.0;
const AROUND_RAYS: usize = 4;
/// Beside a place doubt falls by so much per mm along the slice, and no farther away than this it
/// counts, mm.
const PER_MM_BESIDE: f32 = 0.06;
const BESIDE_MM: f32 = 10.0;
/// A surface that turns towards its rays there by more than this (mm of radius per mm along it),
/// and by up to one more, adds this much per unit.
const STEEP: f32 = 0.6;
const BY_STEEP: f32 = 0.3;
/// Error that 19 of 20 rays do not exceed, mm, by their doubt. Unclear parts of the contours count
/// eight times as much as clear ones, for most places with little doubt are clear, and an unclear
/// one among them is no less wrong.
const BY_DOUBT: [(f32, f32); 11] = [
    (0.1, 0.5),
    (0.3, 0.65),
    (0.5, 1.0),
    (0.7, 1.6),
    (0.9, 2.1),
    (1.1, 2.6),
    (1.3, 2.9),
    (1.6, 3.3),
    (2.0, 4.2),
    (2.5, 6.0),
    (3.2, 12.0),
];
/// Where muscle was added beyond the surface, or taken off, its border has an edge of its own.
/// Measured on the borders of six CTs that lie more than 3 mm away: 0.4 to 2.6 in 19 of 20.
const ADDED_MM: f32 = 2.0;
/// Where there are no ribs the surface is carried on: no data say how well, mm.
const CARRIED_ON_MM: f32 = 10.0;
/// Seeds on both sides that leave the surface no more than this, mm, make it sure.
const BETWEEN_MM: f32 = 2.5;
/// Error that 19 of 20 rays do not exceed, mm, by the distance along the surface (mm) from where
/// seeds on both sides hold it: measured for 9 of 10 at 30 000 places without an edge, on contours
/// of two real CTs and on synthetic patients, with pairs set on the true boundary at random; a
/// fifth more. Beyond the last distance seeds say nothing.
const BY_SEEDS: [(f32, f32); 5] =
    [(0.0, 1.0), (9.0, 3.1), (12.0, 5.0), (16.0, 8.1), (16.1, MAX_MM)];
const SEEDS_REACH_MM: f32 = 16.0;
/// Within this distance of a pair of seeds the boundary is not uncertain, mm: [`BY_SEEDS`] at
/// [`crate::UNCERTAIN_MM`].
pub(crate) const SURE_AROUND_MM: f64 = 6.0;
/// The voxels this near to the boundary along their ray carry its error, mm.
const BAND_MM: f32 = 3.0;
/// Larger errors are not told apart, mm: what eight bits hold in tenths.
const MAX_MM: f32 = 25.5;
/// Units of the map per mm.
pub const PER_MM: f32 = 10.0;

/// The error of the boundary that 19 of 20 rays do not exceed, mm, per ray.
pub(crate) fn error(
    scan: Scan<'_>,
    Shell { radius: shell, ribless, .. }: &Shell,
    wall: &Wall,
    seeds: &Constraints,
) -> RadialMap {
    let height = &wall.height;
    let around = ((AROUND_MM / scan.frame.spacing[2]).round() as usize).max(1);
    let mean = |v: &mut [f32]| v.iter().sum::<f32>() / v.len() as f32;
    let edges = wall.edge.window(around, AROUND_RAYS, mean);
    let doubt = beside(&shell.plus(height), |n| 1.0 - edges.values[n] + wall.misfit.values[n]);
    let held: Vec<bool> = (0..height.values.len())
        .map(|n| seeds.bound(n).room(height.values[n]) <= BETWEEN_MM)
        .collect();
    let from_seeds = held.contains(&true).then(|| from_seeds(scan, &shell.plus(height), &held));
    RadialMap::from_fn(height.slices(), |k, p| {
        let n = k * RAYS + p;
        let carried_on = if ribless[k] { CARRIED_ON_MM } else { 0.0 };
        let seen = along(&BY_DOUBT, doubt.values[n]).max(carried_on);
        from_seeds.as_ref().map_or(seen, |far| seen.min(along(&BY_SEEDS, far[n])))
    })
}

/// The doubt of each ray with what lies beside it, from that of the rays alone; `radius` is that of
/// the surface, mm.
fn beside(radius: &RadialMap, own: impl Fn(usize) -> f32 + Sync) -> RadialMap {
    RadialMap::from_fn(radius.slices(), |k, p| {
        let arc = radius.arc(k, p);
        let reach = ((BESIDE_MM / arc) as usize).min(RAYS / 2 - 1);
        let ring = |steps: usize| (p + RAYS + steps - reach) % RAYS;
        let (mut most, mut steepest) = (0.0f32, 0.0f32);
        for steps in 0..2 * reach + 1 {
            let (q, away) = (ring(steps), arc * steps.abs_diff(reach) as f32);
            let (a, b) = (radius.at(k, (q + RAYS - 1) % RAYS), radius.at(k, (q + 1) % RAYS));
            most = most.max(own(k * RAYS + q) - PER_MM_BESIDE * away);
            steepest = steepest.max((a - b).abs() / (2.0 * radius.arc(k, q)));
        }
        most + BY_STEEP * (steepest - STEEP).clamp(0.0, 1.0)
    })
}

/// The value of a table at x, linear between its rows.
fn along(table: &[(f32, f32)], x: f32) -> f32 {
    let above = table.iter().position(|e| e.0 >= x).unwrap_or(table.len() - 1).max(1);
    let ((a, low), (b, high)) = (table[above - 1], table[above]);
    low + (high - low) * ((x - a) / (b - a)).clamp(0.0, 1.0)
}

/// Distance to the nearest ray that seeds hold, between the places where the rays leave the chest
/// wall, mm; infinite beyond [`SEEDS_REACH_MM`].
fn from_seeds(scan: Scan<'_>, wall: &RadialMap, held: &[bool]) -> Vec<f32> {
    let slice_mm = scan.frame.spacing[2];
    let place = |k: usize, p: usize| {
        let ([x, y], d, r) = (scan.rays.axis[k], scan.rays.directions[p], wall.at(k, p));
        [x + r * d[0], y + r * d[1], k as f32 * slice_mm]
    };
    let mut out = vec![f32::INFINITY; held.len()];
    let slices = (SEEDS_REACH_MM / slice_mm) as usize;
    for n in (0..held.len()).filter(|&n| held[n]) {
        let (k0, p0) = (n / RAYS, n % RAYS);
        let from = place(k0, p0);
        for k in k0.saturating_sub(slices)..(k0 + slices + 1).min(wall.slices()) {
            // Steps of the surface and a shorter radius leave room for twice as many rays.
            let turn = ((2.0 * SEEDS_REACH_MM / wall.arc(k, p0)) as usize).min(RAYS / 2 - 1);
            for p in (0..2 * turn + 1).map(|step| (p0 + RAYS + step - turn) % RAYS) {
                let to = place(k, p);
                let far = (0..3).map(|a| (to[a] - from[a]).powi(2)).sum::<f32>().sqrt();
                if far <= SEEDS_REACH_MM {
                    out[k * RAYS + p] = out[k * RAYS + p].min(far);
                }
            }
        }
    }
    out
}

/// The error in tenths of mm (255: 25.5 mm or more) on the voxels of the patient near the
/// boundary of the labels; 0 elsewhere.
pub(crate) fn map(
    scan: Scan<'_>,
    outline: &RadialMap,
    error: &RadialMap,
    labels: &LabelMap,
) -> Volume<u8> {
    let Scan { ct, frame, body, rays } = scan;
    // At least the voxels on both sides, however large they are.
    let band = BAND_MM.max(1.5 * frame.pixel());
    let tenths = |mm: f32| (mm * PER_MM).round().clamp(1.0, 255.0) as u8;
    let mut out = label::empty(ct.grid());
    out.data_mut().par_chunks_mut(frame.plane()).enumerate().for_each(|(k, out)| {
        let flags = body.flags_slice(frame, k);
        let labels = &labels.data()[k * frame.plane()..(k + 1) * frame.plane()];
        let mut other = false;
        for (n, out) in out.iter_mut().enumerate() {
            if flags[n] & flag::BODY == 0 {
                continue;
            }
            let (r, turn) = rays.polar(k, frame.position(n));
            let p = turn.round() as usize % RAYS;
            let beyond = r - outline.at(k, p);
            if beyond.abs() <= band {
                *out = tenths(error.at(k, p));
            } else {
                other |= (beyond < 0.0) != label::is_chest_wall(labels[n]);
            }
        }
        if other {
            for n in beside_border(labels, frame, band) {
                if out[n] == 0 && flags[n] & flag::BODY != 0 {
                    let (r, turn) = rays.polar(k, frame.position(n));
                    let p = turn.round() as usize % RAYS;
                    let beside = (r - outline.at(k, p)).abs() <= BESIDE_MM;
                    out[n] = tenths(if beside { error.at(k, p).max(ADDED_MM) } else { ADDED_MM });
                }
            }
        }
    });
    out
}

/// The pixels of a slice on both sides of the border of its chest wall with soft tissue, this near
/// to it, mm.
fn beside_border(labels: &[u8], frame: &Frame, band: f32) -> impl Iterator<Item = usize> {
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let near_to = |is: fn(u8) -> bool| {
        let on: Vec<bool> = labels.iter().map(|&l| is(l)).collect();
        near(&on, frame.size[0], spacing, band)
    };
    let (wall, soft) = (near_to(label::is_chest_wall), near_to(label::is_soft_tissue));
    (0..labels.len()).filter(move |&n| wall[n] && soft[n])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_grow_with_the_doubt_and_with_the_way_from_seeds() {
        for table in [&BY_DOUBT[..], &BY_SEEDS] {
            assert!(table.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{table:?}");
        }
        assert_eq!((along(&BY_DOUBT, -0.2), along(&BY_DOUBT, 9.0)), (0.5, 12.0));
        assert!((along(&BY_DOUBT, 0.6) - 1.3).abs() < 1e-6);
        let sure = along(&BY_SEEDS, SURE_AROUND_MM as f32);
        assert!((f64::from(sure) - crate::UNCERTAIN_MM).abs() < 0.15, "{sure}");
        assert!(along(&BY_SEEDS, 17.0) >= MAX_MM && along(&BY_SEEDS, f32::INFINITY) >= MAX_MM);
    }

    #[test]
    fn a_place_is_as_doubtful_as_what_lies_beside_it_and_more_beside_a_step() {
        let of = |radius: &RadialMap| beside(radius, |n| if n == RAYS + 50 { 1.5 } else { 0.2 });
        let flat = RadialMap::new(2, 100.0);
        let (arc, doubt) = (flat.arc(0, 0), of(&flat));
        let want = 1.5 - PER_MM_BESIDE * 3.0 * arc;
        assert!(doubt.at(1, 50) == 1.5 && (doubt.at(1, 53) - want).abs() < 1e-5);
        assert!(doubt.at(1, 60) == 0.2 && doubt.at(0, 50) == 0.2);
        let step = RadialMap::from_fn(2, |_, p| if p < 50 { 110.0 } else { 100.0 });
        let doubt = of(&step);
        assert!((doubt.at(0, 51) - 0.5).abs() < 1e-5 && doubt.at(0, 60) == 0.2);
    }
}

//! How far the boundary of the chest wall may be wrong, ray by ray.
//!
//! Measured on synthetic patients with known tissue (plain, noisy, coarse, blurred), on contours
//! read from a real CT, and on surfaces made wrong on purpose: three facts tell where errors are.
//! A share of rays without an edge around; the way to the next place with edges; and steps of the
//! surface, at which one side is wrong. The margin between the surface and its best rival tells
//! nothing beyond these.

use crate::body::flag;
use crate::plane::squared_distance;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::Constraints;
use crate::shell::Shell;
use crate::wall::Wall;
use rayon::prelude::*;
use supine_volume::{Volume, label, median};

// Constants that are not called measured were chosen.
/// Facts are taken from the rays around: mm along the body, rays to each side.
const AROUND_MM: f32 = 5.0;
const AROUND_RAYS: usize = 4;
/// Error that 9 of 10 rays do not exceed, mm, by the share of rays around that have an edge: as measured (see
/// above).
const BY_EDGES: [(f32, f32); 6] =
    [(0.0, 3.0), (0.3, 3.0), (0.45, 2.0), (0.7, 1.2), (0.87, 0.9), (1.0, 0.7)];
/// A place with this share of edges is known; from there on the error grows, mm per mm.
const KNOWN_SHARE: f32 = 0.7;
const GAP_MM: f32 = 1.0;
const PER_GAP_MM: f32 = 0.4;
/// Steps up to this height are anatomy, mm per 1 degree or 2.5 mm along the body.
const STEP_MM: f32 = 2.5;
const STEP_SLICE_MM: f32 = 2.5;
/// Where there are no ribs the surface is carried on: no data say how well, mm.
const CARRIED_ON_MM: f32 = 10.0;
/// Seeds on both sides that leave the surface no more than this, mm, make it sure.
const BETWEEN_MM: f32 = 2.5;
/// Error that 9 of 10 rays do not exceed, mm, by the distance along the surface (mm) from where seeds on both sides hold it:
/// measured at 30 000 places without an edge, on contours of two real CTs and on synthetic patients, with pairs
/// set on the true boundary at random. Beyond the last distance seeds say nothing.
const BY_SEEDS: [(f32, f32); 5] =
    [(0.0, 0.8), (9.0, 2.6), (12.0, 4.2), (16.0, 6.8), (16.1, MAX_MM)];
const SEEDS_REACH_MM: f32 = 16.0;
/// Within this distance of a pair of seeds the boundary is not uncertain, mm: [`BY_SEEDS`] at [`crate::UNCERTAIN_MM`].
pub(crate) const SURE_AROUND_MM: f64 = 5.5;
/// The voxels this near to the boundary along their ray carry its error, mm.
const BAND_MM: f32 = 3.0;
/// Larger errors are not told apart, mm: what eight bits hold in tenths.
const MAX_MM: f32 = 25.5;
/// Units of the map per mm.
pub const PER_MM: f32 = 10.0;

/// The error of the boundary that 9 of 10 rays do not exceed, mm, per ray.
pub(crate) fn error(
    scan: Scan<'_>,
    Shell { radius: shell, ribless, .. }: &Shell,
    wall: &Wall,
    seeds: &Constraints,
) -> RadialMap {
    let (height, slice_mm) = (&wall.height, scan.frame.spacing[2]);
    let around = |facts: &RadialMap, of: fn(&mut [f32]) -> f32| {
        let dk = ((AROUND_MM / slice_mm).round() as usize).max(1);
        facts.window(dk, AROUND_RAYS, of)
    };
    let held: Vec<bool> = (0..height.values.len())
        .map(|n| seeds.bound(n).room(height.values[n]) <= BETWEEN_MM)
        .collect();
    let edges = around(&wall.edge, |v| v.iter().sum::<f32>() / v.len() as f32);
    let steps = around(&steps(height, slice_mm), |v| v.iter().copied().fold(0.0, f32::max));
    let known: Vec<bool> = edges.values.iter().map(|&share| share >= KNOWN_SHARE).collect();
    let gaps = gaps(&known, shell, height, slice_mm);
    let from_seeds = held.contains(&true).then(|| from_seeds(scan, &shell.plus(height), &held));
    RadialMap::from_fn(height.slices(), |k, p| {
        let n = k * RAYS + p;
        let gap = if known[n] { 0.0 } else { GAP_MM + PER_GAP_MM * gaps[n] };
        let step = steps.values[n].min(2.0 * (steps.values[n] - STEP_MM));
        let carried_on = if ribless[k] { CARRIED_ON_MM } else { 0.0 };
        let seen = along(&BY_EDGES, edges.values[n]).max(gap).max(step).max(carried_on).min(MAX_MM);
        from_seeds.as_ref().map_or(seen, |far| seen.min(along(&BY_SEEDS, far[n])))
    })
}

/// The value of a table at x, linear between its rows.
fn along(table: &[(f32, f32)], x: f32) -> f32 {
    let above = table.iter().position(|e| e.0 >= x).unwrap_or(table.len() - 1).max(1);
    let ((a, low), (b, high)) = (table[above - 1], table[above]);
    low + (high - low) * ((x - a) / (b - a)).clamp(0.0, 1.0)
}

/// Largest step to a neighbour, mm per ray or per 2.5 mm along the body.
fn steps(height: &RadialMap, slice_mm: f32) -> RadialMap {
    let last = height.slices() - 1;
    RadialMap::from_fn(height.slices(), |k, p| {
        let h = height.at(k, p);
        let beside = [(p + 1) % RAYS, (p + RAYS - 1) % RAYS].map(|q| (h - height.at(k, q)).abs());
        let along = [k.saturating_sub(1), (k + 1).min(last)]
            .map(|l| (h - height.at(l, p)).abs() * STEP_SLICE_MM / slice_mm);
        beside.into_iter().chain(along).fold(0.0, f32::max)
    })
}

/// Distance along the surface to the nearest known ray, mm; infinite where it is so far that [`MAX_MM`] is reached.
fn gaps(known: &[bool], shell: &RadialMap, height: &RadialMap, slice_mm: f32) -> Vec<f32> {
    let mut radii: Vec<f32> = shell.values.iter().zip(&height.values).map(|(r, h)| r + h).collect();
    let arc = median(&mut radii).unwrap_or(0.0) * std::f32::consts::TAU / RAYS as f32;
    // Half a turn on both sides closes the ring.
    let wide = 2 * RAYS;
    let at = |n: usize| n / wide * RAYS + (n % wide + RAYS / 2) % RAYS;
    let ring: Vec<bool> = (0..2 * known.len()).map(|n| known[at(n)]).collect();
    let squared = squared_distance(&ring, wide, [arc, slice_mm], MAX_MM / PER_GAP_MM);
    let middle = |n: usize| n / RAYS * wide + n % RAYS + RAYS / 2;
    (0..known.len()).map(|n| squared[middle(n)].sqrt()).collect()
}

/// Distance to the nearest ray that seeds hold, between the places where the rays leave the chest wall, mm; infinite beyond
/// [`SEEDS_REACH_MM`].
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
/// boundary; 0 elsewhere.
pub(crate) fn map(scan: Scan<'_>, outline: &RadialMap, error: &RadialMap) -> Volume<u8> {
    let Scan { ct, frame, body, rays } = scan;
    // At least the voxels on both sides, however large they are.
    let band = BAND_MM.max(1.5 * frame.pixel());
    let mut out = label::empty(ct.grid());
    out.data_mut().par_chunks_mut(frame.plane()).enumerate().for_each(|(k, out)| {
        let flags = body.flags_slice(frame, k);
        for (n, out) in out.iter_mut().enumerate() {
            if flags[n] & flag::BODY == 0 {
                continue;
            }
            let (r, turn) = rays.polar(k, frame.position(n));
            let p = turn.round() as usize % RAYS;
            if (r - outline.at(k, p)).abs() <= band {
                *out = (error.at(k, p) * PER_MM).round().clamp(1.0, 255.0) as u8;
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_tell_the_error_and_nothing_known_is_far_away() {
        let by_edges = |share| along(&BY_EDGES, share);
        assert!((by_edges(1.0) - 0.7).abs() < 1e-6 && (by_edges(0.1) - 3.0).abs() < 1e-6);
        assert!((by_edges(0.575) - 1.6).abs() < 1e-5, "{}", by_edges(0.575));
        let sure = along(&BY_SEEDS, SURE_AROUND_MM as f32);
        assert!((f64::from(sure) - crate::UNCERTAIN_MM).abs() < 0.15, "{sure}");
        assert!(along(&BY_SEEDS, 17.0) >= MAX_MM && along(&BY_SEEDS, f32::INFINITY) >= MAX_MM);
        let (shell, height) = (RadialMap::new(5, 95.0), RadialMap::new(5, 5.0));
        let none = vec![false; 5 * RAYS];
        assert!(gaps(&none, &shell, &height, 5.0).iter().all(|g| g.is_infinite()));
    }

    #[test]
    fn gaps_close_round_the_ring() {
        let (shell, height) = (RadialMap::new(5, 95.0), RadialMap::new(5, 5.0));
        let arc = 100.0 * std::f32::consts::TAU / RAYS as f32;
        for start in [0, 90, 180, 355] {
            let mut known = vec![false; 5 * RAYS];
            known[2 * RAYS + start] = true;
            let gaps = gaps(&known, &shell, &height, 5.0);
            for turn in [7, RAYS - 7] {
                let n = 2 * RAYS + (start + turn) % RAYS;
                assert!((gaps[n] - 7.0 * arc).abs() < 1e-3, "{start} {turn} {}", gaps[n]);
            }
            assert!((gaps[4 * RAYS + start] - 10.0).abs() < 1e-3);
        }
    }

    #[test]
    fn a_step_shows_on_both_of_its_sides() {
        let height = RadialMap::from_fn(4, |_, p| if p < 100 { 5.0 } else { 13.0 });
        let steps = steps(&height, 2.5);
        assert_eq!((steps.at(1, 99), steps.at(1, 100), steps.at(1, 50)), (8.0, 8.0, 0.0));
    }
}

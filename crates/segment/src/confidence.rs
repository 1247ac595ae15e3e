//! How far the boundary of the chest wall may be wrong, ray by ray.
//!
//! Measured on contours read from four real CTs, on the surfaces found there and on others that were made wrong on purpose (by
//! weights of the search that no CT supports): the share of rays around without an edge, and how little the ray itself looks
//! like the end of muscle ([`crate::misfit`]), add to a doubt at which right and wrong surfaces of all four are off alike.

use crate::body::flag;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::Constraints;
use crate::shell::Shell;
use crate::wall::Wall;
use rayon::prelude::*;
use supine_volume::{Volume, label};

// Constants that are not called measured were chosen.
/// Facts are taken from the rays around: mm along the body, rays to each side.
const AROUND_MM: f32 = 5.0;
const AROUND_RAYS: usize = 4;
/// Error that 19 of 20 rays do not exceed, mm, by their doubt: the largest of the four CTs (see above). From 1.8 on most surfaces
/// are wrong; those that are right are off by 4 to 6.
const BY_DOUBT: [(f32, f32); 11] = [
    (0.05, 0.6),
    (0.2, 0.8),
    (0.33, 1.2),
    (0.5, 1.4),
    (0.7, 1.6),
    (0.9, 2.0),
    (1.13, 2.6),
    (1.38, 3.2),
    (1.65, 5.7),
    (2.0, 9.0),
    (3.0, 18.0),
];
/// Where there are no ribs the surface is carried on: no data say how well, mm.
const CARRIED_ON_MM: f32 = 10.0;
/// Seeds on both sides that leave the surface no more than this, mm, make it sure.
const BETWEEN_MM: f32 = 2.5;
/// Error that 19 of 20 rays do not exceed, mm, by the distance along the surface (mm) from where seeds on both sides hold it:
/// measured for 9 of 10 at 30 000 places without an edge, on contours of two real CTs and on synthetic patients, with pairs
/// set on the true boundary at random; a fifth more. Beyond the last distance seeds say nothing.
const BY_SEEDS: [(f32, f32); 5] =
    [(0.0, 1.0), (9.0, 3.1), (12.0, 5.0), (16.0, 8.1), (16.1, MAX_MM)];
const SEEDS_REACH_MM: f32 = 16.0;
/// Within this distance of a pair of seeds the boundary is not uncertain, mm: [`BY_SEEDS`] at [`crate::UNCERTAIN_MM`].
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
    let held: Vec<bool> = (0..height.values.len())
        .map(|n| seeds.bound(n).room(height.values[n]) <= BETWEEN_MM)
        .collect();
    let from_seeds = held.contains(&true).then(|| from_seeds(scan, &shell.plus(height), &held));
    RadialMap::from_fn(height.slices(), |k, p| {
        let n = k * RAYS + p;
        let doubt = 1.0 - edges.values[n] + wall.misfit.values[n];
        let carried_on = if ribless[k] { CARRIED_ON_MM } else { 0.0 };
        let seen = along(&BY_DOUBT, doubt).max(carried_on);
        from_seeds.as_ref().map_or(seen, |far| seen.min(along(&BY_SEEDS, far[n])))
    })
}

/// The value of a table at x, linear between its rows.
fn along(table: &[(f32, f32)], x: f32) -> f32 {
    let above = table.iter().position(|e| e.0 >= x).unwrap_or(table.len() - 1).max(1);
    let ((a, low), (b, high)) = (table[above - 1], table[above]);
    low + (high - low) * ((x - a) / (b - a)).clamp(0.0, 1.0)
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
    fn errors_grow_with_the_doubt_and_with_the_way_from_seeds() {
        for table in [&BY_DOUBT[..], &BY_SEEDS] {
            assert!(table.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1), "{table:?}");
        }
        assert_eq!((along(&BY_DOUBT, -0.2), along(&BY_DOUBT, 9.0)), (0.6, 18.0));
        assert!((along(&BY_DOUBT, 0.6) - 1.5).abs() < 1e-6);
        let sure = along(&BY_SEEDS, SURE_AROUND_MM as f32);
        assert!((f64::from(sure) - crate::UNCERTAIN_MM).abs() < 0.15, "{sure}");
        assert!(along(&BY_SEEDS, 17.0) >= MAX_MM && along(&BY_SEEDS, f32::INFINITY) >= MAX_MM);
    }
}

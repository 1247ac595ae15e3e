//! Homogeneous muscle: what tells it from gland, and where it lies beyond the surface of the wall.

use crate::aggregate::Costs;
use crate::band::{Band, STEP_MM, heights};
use crate::body::flag;
use crate::bones::smoothed_rows;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::paint::Outline;
use crate::plane::{self, bilinear};
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::Constraints;
use rayon::prelude::*;
use supine_volume::{LabelMap, Parts, Run, gaussian_rows, label, slice_kernel};

/// Smoothing that tells homogeneous muscle from gland: in the slice (reference, section 4, step 6) and across,
/// mm.
const SMOOTH_MM: f32 = 2.0;
const SMOOTH_Z_MM: f32 = 1.5;
// What follows was chosen, not measured.
/// Least share of dense tissue (Gaussian weights) that has a mean.
const MIN_SHARE: f32 = 0.05;
/// Share of muscle around a voxel (Gaussian weights) that makes it muscle.
const MOSTLY: f32 = 0.6;
/// Muscle in front of the ribs is thinner than this, mm.
const THICKEST_MM: f32 = 24.0;
/// So far around a blob that is thicker no muscle is believed, mm.
const BLOB_MM: f32 = 12.0;
/// Muscle lies deeper under the skin than this, mm.
const DEPTH_MM: f32 = 4.0;

/// A surface that turns towards its rays more than this (mm of radius per mm along it) ends at the
/// free border of a muscle, or beside one.
const STEEP: f32 = 1.2;
/// Muscle beyond the surface is looked for so near to a steep place: mm along the surface, and
/// along the body.
const NEAR_MM: f32 = 25.0;
const NEAR_Z_MM: f32 = 6.0;
/// It lies no farther outside the surface than this, mm.
const BEYOND_MM: f32 = 25.0;
/// It must be joined to this much muscle under the surface, cm³, no deeper than `UNDER_MM`.
const JOINED_CM3: f64 = 0.5;
const UNDER_MM: f32 = 6.0;
/// A free border is longer along the body than this, mm; gland that touches the wall is not.
const LONG_MM: f32 = 16.0;
/// What the smoothing takes off the outside of a muscle, mm.
const RIM_MM: f32 = 2.5;

/// Mean HU of the dense tissue around (Gaussian weights) in a slice: fat and bone beside a muscle do
/// not count, so it tells muscle from gland up to their borders. NaN where there is none.
fn dense_mean(scan: Scan<'_>, k: usize, levels: Levels) -> Vec<f32> {
    let Scan { ct, frame, body, .. } = scan;
    // Muscle lies in the body: no row beyond it is looked at, but for what the smoothing reaches.
    let rows = body.rows(frame, k);
    let weights = slice_kernel(SMOOTH_Z_MM / frame.spacing[2]);
    let (plane, last) = (frame.plane(), frame.size[2] - 1);
    let (mut sum, mut share) = (vec![0.0f32; plane], vec![0.0f32; plane]);
    // As floats: they are compared and chosen eight at once.
    let dense = levels.dense();
    let (least, most) = (f32::from(dense.start), f32::from(dense.end));
    let ni = frame.size[0];
    // Row by row: a whole slice of sums is not at hand as fast.
    let spacing = [frame.spacing[0], frame.spacing[1]];
    let reach = slice_kernel(SMOOTH_MM / spacing[1]).len();
    let near = rows.start.saturating_sub(reach)..rows.end + reach;
    let both = sum.chunks_exact_mut(ni).zip(share.chunks_exact_mut(ni));
    for (j, (sum, share)) in both.enumerate().filter(|(j, _)| near.contains(j)) {
        for (d, w) in weights.iter().enumerate() {
            let both = [k.saturating_sub(d), (k + d).min(last)];
            for &from in if d == 0 { &both[..1] } else { &both[..] } {
                let source = &ct.data()[from * plane + j * ni..][..ni];
                for ((sum, share), &hu) in sum.iter_mut().zip(&mut *share).zip(source) {
                    let hu = f32::from(hu);
                    let w = if hu >= least && hu < most { *w } else { 0.0 };
                    *sum += w * hu;
                    *share += w;
                }
            }
        }
    }
    gaussian_rows(&mut sum, ni, spacing, SMOOTH_MM, rows.clone());
    gaussian_rows(&mut share, ni, spacing, SMOOTH_MM, rows);
    let mean = |(sum, share): (f32, f32)| if share > MIN_SHARE { sum / share } else { f32::NAN };
    sum.into_iter().zip(share).map(mean).collect()
}

/// What dense tissue is, told by its mean HU around: muscle is 15-20 HU denser than gland; no more than `below` HU under
/// its level (HU) it still is muscle.
pub(crate) struct Dense {
    /// Likeness to homogeneous muscle along the rays, 0..=1; blobs left out.
    pub(crate) muscle: Costs,
    /// Likeness to gland along the rays, 0..=1.
    pub(crate) gland: Costs,
    /// The voxels that lie in homogeneous muscle, blobs included; in order of memory.
    pub(crate) voxels: Vec<Run>,
}

impl Dense {
    pub(crate) fn find(
        scan: Scan<'_>,
        band: &Band,
        shell: &RadialMap,
        levels: Levels,
        below: f32,
    ) -> Self {
        let (frame, n_levels) = (scan.frame, band.levels());
        let mut muscle = Costs::new(frame.size[2], n_levels, |_, _| ());
        let mut gland = Costs::new(frame.size[2], n_levels, |_, _| ());
        let size = RAYS * n_levels;
        let rays = muscle.values.par_chunks_mut(size).zip(gland.values.par_chunks_mut(size));
        let slice = |(k, (muscle, gland)): (usize, (&mut [f32], &mut [f32]))| {
            let image = dense_mean(scan, k, levels);
            scan.along(k, shell, heights(n_levels), muscle, |at| {
                bilinear(&image, frame.size[0], at, |v| v)
            });
            let start = k * size;
            for (n, (muscle, gland)) in muscle.iter_mut().zip(gland).enumerate() {
                let (hu, depth) = (band.hu.values[start + n], band.depth.values[start + n]);
                let mean = *muscle;
                let known = !hu.is_nan() && !mean.is_nan() && depth > DEPTH_MM;
                let dense = if known { levels.likeness(hu) } else { 0.0 };
                *muscle = if known { dense * levels.true_muscle(mean, below) } else { 0.0 };
                *gland = if known { dense * levels.gland(mean, below) } else { 0.0 };
            }
            homogeneous(scan, k, &image, levels, below)
        };
        let voxels: Vec<Vec<Run>> = rays.enumerate().map(slice).collect();
        drop_blobs(scan, shell, &mut muscle);
        Self { muscle, gland, voxels: voxels.concat() }
    }
}

/// The voxels of a slice most of whose surroundings are muscle by their mean: the noise of gland makes it
/// as dense in spots.
fn homogeneous(scan: Scan<'_>, k: usize, mean: &[f32], levels: Levels, below: f32) -> Vec<Run> {
    let (frame, start) = (scan.frame, k * scan.frame.plane());
    let is_muscle = |n: usize| {
        levels.true_muscle(mean[n], below) > 0.5
            && levels.dense().contains(&scan.ct.data()[start + n])
            && scan.body.depth_mm(start + n) > DEPTH_MM
    };
    let mut share: Vec<f32> = (0..mean.len()).map(|n| f32::from(is_muscle(n))).collect();
    let (ni, spacing) = (frame.size[0], [frame.spacing[0], frame.spacing[1]]);
    gaussian_rows(&mut share, ni, spacing, SMOOTH_MM, scan.body.rows(frame, k));
    let row = |row: usize| {
        let voxels = start + row * ni..start + (row + 1) * ni;
        Run::within(voxels, |n| share[n - start] > MOSTLY)
    };
    (0..frame.size[1]).flat_map(row).collect()
}

/// Takes muscle off the rays on and near which it is thicker than any muscle in front of the ribs:
/// gland that takes up contrast is as dense.
fn drop_blobs(scan: Scan<'_>, shell: &RadialMap, muscle: &mut Costs) {
    let slices = shell.slices();
    let blob = RadialMap::from_fn(slices, |k, p| f32::from(is_blob(muscle.ray(k, p))));
    let reach = (BLOB_MM / scan.frame.spacing[2]) as usize;
    let near = blob.widened(reach, |k, p| (BLOB_MM / shell.arc(k, p)) as usize);
    let levels = muscle.levels;
    muscle.values.par_chunks_mut(levels).zip(&near.values).for_each(|(ray, &near)| {
        if near > 0.0 {
            ray.fill(0.0);
        }
    });
}

/// Whether a ray runs through too much muscle at once.
fn is_blob(muscle: &[f32]) -> bool {
    let thickest = (THICKEST_MM / STEP_MM) as usize;
    let mut runs = muscle.chunk_by(|a, b| (*a > 0.5) == (*b > 0.5));
    runs.any(|run| run[0] > 0.5 && run.len() > thickest)
}

/// Gives the muscle beyond the surface its label. One radius per ray cannot follow the free border
/// of a muscle (pectoralis over the armpit, latissimus): near places where the surface is steep,
/// homogeneous muscle that is joined to the muscle under the surface belongs to the wall.
pub(crate) fn add_beyond(
    outline: &Outline<'_>,
    muscle: &[Run],
    levels: Levels,
    shell: &RadialMap,
    seeds: &Constraints,
    labels: &mut LabelMap,
) {
    let scan = outline.scan();
    let (frame, plane) = (scan.frame, scan.frame.plane());
    let near = near_steep(scan, outline.radius());
    // No voxel nearer to the axis or farther from it counts in a slice, mm².
    let extents: Vec<(f32, f32)> = (0..frame.size[2])
        .map(|k| {
            let (nearest, farthest) = outline.extent(k);
            ((nearest - UNDER_MM).max(0.0).powi(2), (farthest + BEYOND_MM).powi(2))
        })
        .collect();
    let beyond = |n: usize| -> Option<f32> {
        let (k, position) = (n / plane, frame.position(n % plane));
        let (nearest, farthest) = extents[k];
        let away = scan.rays.squared_radius(k, position);
        if away < nearest || away > farthest {
            return None;
        }
        let (ray, beyond) = outline.seen(k, position);
        if near.values[ray] == 0.0 {
            return None;
        }
        let free = |h: f32| seeds.bound(ray).cost(h - shell.values[ray]) == 0.0;
        let radius = outline.radius().values[ray] + beyond;
        ((-UNDER_MM..BEYOND_MM).contains(&beyond) && free(radius)).then_some(beyond)
    };
    let near = |run: &Run| Run::within(run.voxels(), |n| beyond(n).is_some());
    let parts = Parts::of_runs(frame.size, muscle.par_iter().flat_map_iter(near).collect());
    let outside = |run: &Run| Run::within(run.voxels(), |n| outline.beyond(n) >= 0.0);
    let outside: Vec<Vec<Run>> = parts.runs.par_iter().map(outside).collect();
    let mut under = vec![0usize; parts.voxels.len()];
    for ((run, part), outside) in parts.iter().zip(&outside) {
        under[part] += run.len - outside.iter().map(|run| run.len).sum::<usize>();
    }
    let joined = |part: usize| under[part] as f64 * frame.voxel_cm3() > JOINED_CM3;
    let outside = parts.part.iter().zip(outside).filter(|(part, _)| joined(**part));
    let core = long(outside.flat_map(|(_, runs)| runs).collect(), frame);
    labels.data_mut().par_chunks_mut(plane).zip(&core).enumerate().for_each(|(k, (out, core))| {
        if core.is_empty() {
            return;
        }
        // The rows that the rim reaches; the pixels are in order.
        let ([ni, nj, _], margin) = (frame.size, (RIM_MM / frame.spacing[1]) as usize + 1);
        let first = (core[0] / ni).saturating_sub(margin);
        let rows = first..(core[core.len() - 1] / ni + margin + 1).min(nj);
        let mut on = vec![false; rows.len() * ni];
        core.iter().for_each(|&n| on[n - first * ni] = true);
        let rim = plane::near(&on, ni, [frame.spacing[0], frame.spacing[1]], RIM_MM);
        let image = smoothed_rows(scan.ct, frame, (k, rows), 0.5 * frame.pixel());
        let flags = scan.body.flags_slice(frame, k);
        for (m, n) in (0..on.len()).map(|m| (m, m + first * ni)) {
            let rim = rim[m] && image[n] > levels.middle();
            let inside = flags[n] & flag::BODY != 0;
            if rim && inside && (on[m] || beyond(k * plane + n).is_some()) {
                out[n] = label::CHEST_WALL;
            }
        }
        // What lies between the muscle added and the rest of the wall is held on all sides.
        let mut wall: Vec<bool> = out.iter().map(|&l| l == label::CHEST_WALL).collect();
        plane::fill_holes(&mut wall, frame.size[0]);
        for (out, wall) in out.iter_mut().zip(wall) {
            if wall && *out == label::SOFT_TISSUE {
                *out = label::CHEST_WALL;
            }
        }
    });
}

/// The parts of some runs that are long enough along the body for a muscle, as pixels per slice.
fn long(runs: Vec<Run>, frame: &Frame) -> Vec<Vec<usize>> {
    let plane = frame.plane();
    let parts = Parts::of_runs(frame.size, runs);
    let mut ends = vec![(usize::MAX, 0); parts.voxels.len()];
    for (run, part) in parts.iter() {
        let k = run.start / plane;
        ends[part] = (k.min(ends[part].0), k.max(ends[part].1));
    }
    let mut pixels = vec![Vec::new(); frame.size[2]];
    for (run, part) in parts.iter() {
        let (first, last) = ends[part];
        if (last + 1 - first) as f32 * frame.spacing[2] > LONG_MM {
            pixels[run.start / plane].extend(run.voxels().map(|n| n % plane));
        }
    }
    pixels
}

/// 1 on the rays near to a place where the surface is steep, in front and at the sides.
fn near_steep(scan: Scan<'_>, radius: &RadialMap) -> RadialMap {
    let steep = RadialMap::from_fn(radius.slices(), |k, p| {
        let (a, b) = (radius.at(k, (p + RAYS - 1) % RAYS), radius.at(k, (p + 1) % RAYS));
        f32::from((a - b).abs() > STEEP * 2.0 * radius.arc(k, p))
    });
    let reach = (NEAR_Z_MM / scan.frame.spacing[2]).round() as usize;
    let mut near = steep.widened(reach, |k, p| (NEAR_MM / radius.arc(k, p)) as usize);
    for (n, near) in near.values.iter_mut().enumerate() {
        if scan.rays.to_back[n % RAYS] > 0.5 {
            *near = 0.0;
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_no_blob() {
        let mut ray = vec![0.0; 100];
        let thickest = (THICKEST_MM / STEP_MM) as usize;
        ray[10..40].fill(1.0);
        ray[45..45 + thickest].fill(0.8);
        assert!(!is_blob(&ray));
        ray[45 + thickest] = 0.8;
        assert!(is_blob(&ray));
    }
}

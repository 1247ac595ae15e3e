//! Homogeneous muscle: what tells it from gland.

use crate::aggregate::Costs;
use crate::band::{Band, STEP_MM, heights};
use crate::levels::Levels;
use crate::plane::bilinear;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use rayon::prelude::*;
use supine_volume::{Run, gaussian_rows, slice_kernel};

/// Smoothing that tells homogeneous muscle from gland: in the slice (docs/SEGMENTATION.md, step 6)
/// and across, mm.
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
pub(crate) const DEPTH_MM: f32 = 4.0;

/// Mean HU of the dense tissue around (Gaussian weights) in a slice: fat and bone beside a muscle
/// do not count, so it tells muscle from gland up to their borders. NaN where there is none.
pub(crate) fn dense_mean(scan: Scan<'_>, k: usize, levels: Levels) -> Vec<f32> {
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

/// What dense tissue is, told by its mean HU around: muscle is 15-20 HU denser than gland; no more
/// than `below` HU under its level (HU) it still is muscle.
pub(crate) struct Dense {
    /// Likeness to homogeneous muscle along the rays, 0..=1; blobs left out.
    pub(crate) muscle: Costs,
    /// Likeness to gland along the rays, in 255ths: a byte each, for all are kept.
    pub(crate) gland: Vec<u8>,
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
        let size = RAYS * n_levels;
        let mut gland = vec![0; frame.size[2] * size];
        let rays = muscle.values.par_chunks_mut(size).zip(gland.par_chunks_mut(size));
        let slice = |(k, (muscle, gland)): (usize, (&mut [f32], &mut [u8]))| {
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
                let share = if known { dense * levels.gland(mean, below) } else { 0.0 };
                *gland = (255.0 * share).round() as u8;
            }
            homogeneous(scan, k, &image, levels, below)
        };
        let voxels: Vec<Vec<Run>> = rays.enumerate().map(slice).collect();
        drop_blobs(scan, shell, &mut muscle);
        Self { muscle, gland, voxels: voxels.concat() }
    }
}

/// The voxels of a slice most of whose surroundings are muscle by their mean: the noise of gland
/// makes it as dense in spots.
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

/// What the search found of muscle.
#[derive(Clone, Copy)]
pub(crate) struct Found<'a> {
    /// The voxels of homogeneous muscle.
    pub(crate) muscle: &'a [Run],
    /// HU along the rays.
    pub(crate) hu: &'a Costs,
    pub(crate) levels: Levels,
    /// How far below its level the mean of muscle may lie, HU.
    pub(crate) below: f32,
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

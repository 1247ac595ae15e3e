//! Homogeneous muscle: what tells it from gland, and where it lies beyond the surface of the wall.

use crate::aggregate::Costs;
use crate::body::flag;
use crate::bones::smoothed;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::paint::Outline;
use crate::parts::Parts;
use crate::plane::{self, bilinear, kernel, smooth};
use crate::scan::Scan;
use crate::seeds::Constraints;
use crate::sheet::{RAYS, Sheet};
use crate::wall::{Band, LOWEST_MM, STEP_MM};
use rayon::prelude::*;
use supine_volume::{Ct, LabelMap, label};

/// Smoothing that tells homogeneous muscle from gland: in the slice and across, mm.
const SMOOTH_MM: f32 = 2.0;
const SMOOTH_Z_MM: f32 = 1.5;
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
/// What the smoothing takes off the outside of a muscle, mm.
const RIM_MM: f32 = 2.5;

/// A slice smoothed in all directions.
fn smoothed_3d(ct: &Ct, frame: &Frame, k: usize) -> Vec<f32> {
    let weights = kernel(SMOOTH_Z_MM / frame.spacing[2]);
    let (plane, last) = (frame.plane(), frame.size[2] - 1);
    let mut image = vec![0.0f32; plane];
    for (d, w) in weights.iter().enumerate() {
        let both = [k.saturating_sub(d), (k + d).min(last)];
        for &from in if d == 0 { &both[..1] } else { &both[..] } {
            let source = &ct.data()[from * plane..(from + 1) * plane];
            for (v, &s) in image.iter_mut().zip(source) {
                *v += w * f32::from(s.clamp(-1024, 3071));
            }
        }
    }
    smooth(&mut image, frame.size[0], [frame.spacing[0], frame.spacing[1]], SMOOTH_MM);
    image
}

/// Share of homogeneous muscle along the rays, by a stronger smoothing: gland is 15-20 HU less
/// dense on average. And the voxels that are muscle, blobs included.
pub(crate) fn true_muscle(
    scan: Scan<'_>,
    (band, shell): (&Band, &Sheet),
    levels: Levels,
) -> (Costs, Vec<bool>) {
    let (frame, plane, n_levels) = (scan.frame, scan.frame.plane(), band.levels());
    let mut along = Costs::new(frame.size[2], n_levels, |_, _| ());
    let mut voxels = vec![false; plane * frame.size[2]];
    let slices = along.values.par_chunks_mut(RAYS * n_levels).zip(voxels.par_chunks_mut(plane));
    slices.enumerate().for_each(|(k, (out, voxels))| {
        let image = smoothed_3d(scan.ct, frame, k);
        for (n, (v, &hu)) in voxels.iter_mut().zip(&image).enumerate() {
            *v = levels.true_muscle(hu) > 0.5 && scan.body.depth_mm(k * plane + n) > DEPTH_MM;
        }
        scan.along(k, shell, (LOWEST_MM, STEP_MM), out, |at| {
            bilinear(&image, frame.size[0], at, |v| v)
        });
        for (p, out) in out.chunks_exact_mut(n_levels).enumerate() {
            let (hu, depth) = (band.hu.ray(k, p), band.depth.ray(k, p));
            for (n, v) in out.iter_mut().enumerate() {
                let known = !hu[n].is_nan() && depth[n] > DEPTH_MM;
                *v = if known { levels.true_muscle(*v) } else { 0.0 };
            }
        }
    });
    drop_blobs(scan, shell, &mut along);
    (along, voxels)
}

/// Takes muscle off the rays on and near which it is thicker than any muscle in front of the ribs:
/// gland that takes up contrast is as dense.
fn drop_blobs(scan: Scan<'_>, shell: &Sheet, muscle: &mut Costs) {
    let slices = shell.slices();
    let blob = Sheet::from_fn(slices, |k, p| f32::from(is_blob(muscle.ray(k, p))));
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
    (muscle, levels): (&[bool], Levels),
    (shell, seeds): (&Sheet, &Constraints),
    labels: &mut LabelMap,
) {
    let scan = outline.scan();
    let (frame, plane) = (scan.frame, scan.frame.plane());
    let near = near_steep(scan, outline.radius());
    let beyond = |n: usize| -> Option<f32> {
        let ray = outline.ray(n);
        if near.values[ray] == 0.0 {
            return None;
        }
        let beyond = outline.beyond(n);
        let free = |h: f32| seeds.bound(ray).cost(h - shell.values[ray]) == 0.0;
        let radius = outline.radius().values[ray] + beyond;
        ((-UNDER_MM..BEYOND_MM).contains(&beyond) && free(radius)).then_some(beyond)
    };
    let parts = Parts::new(frame.size, |n| muscle[n] && beyond(n).is_some());
    let mut under = vec![0usize; parts.voxels.len()];
    for (run, part) in parts.iter() {
        under[part] += run.voxels().filter(|&n| outline.beyond(n) < 0.0).count();
    }
    let mut core = vec![Vec::new(); frame.size[2]];
    for (run, part) in parts.iter() {
        if under[part] as f64 * frame.voxel_cm3() > JOINED_CM3 {
            let outside = run.voxels().filter(|&n| outline.beyond(n) >= 0.0);
            core[run.start / plane].extend(outside.map(|n| n % plane));
        }
    }
    labels.data_mut().par_chunks_mut(plane).zip(&core).enumerate().for_each(|(k, (out, core))| {
        if core.is_empty() {
            return;
        }
        let mut on = vec![false; plane];
        core.iter().for_each(|&n| on[n] = true);
        let spacing = [frame.spacing[0], frame.spacing[1]];
        let rim = plane::near(&on, frame.size[0], spacing, RIM_MM);
        let image = smoothed(scan.ct, frame, k, 0.5 * frame.pixel());
        for n in 0..plane {
            let rim = rim[n] && image[n] > levels.middle();
            let inside = scan.body.flags_slice(frame, k)[n] & flag::BODY != 0;
            if rim && inside && (on[n] || beyond(k * plane + n).is_some()) {
                out[n] = label::CHEST_WALL;
            }
        }
    });
}

/// 1 on the rays near to a place where the surface is steep, in front and at the sides.
fn near_steep(scan: Scan<'_>, radius: &Sheet) -> Sheet {
    let steep = Sheet::from_fn(radius.slices(), |k, p| {
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

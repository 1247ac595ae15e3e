//! Bones and costal cartilage, and the axis of the thorax.

use crate::Error;
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::levels::{Levels, fat_mode};
use crate::smoothing::{SMOOTH_MM, smoothed_rows};
use rayon::prelude::*;
use supine_space::Progress;
use supine_volume::{Ct, Parts, Run, median, ranked};

/// Bone lies deeper under the skin than this, mm (the same).
const BONE_DEPTH_MM: f32 = 5.0;
/// Costal cartilage lies above this share of the way from fat to muscle: it has 70 to 200 HU where
/// fat has -105 and muscle 50. Measured on four real CTs, one of them at other voltages and with
/// noise: at 1.1 muscle counts in noise, at 1.3 the free border of a muscle is lost.
const CARTILAGE: f32 = 1.2;
/// Least volume of a bone, cm³ (the same).
const BONE_CM3: f64 = 1.5;
/// The thorax reaches from side to side and from front to back over this middle of the bones:
/// single voxels beyond do not count (docs/SEGMENTATION.md, step 2).
const OUTERMOST: [f32; 2] = [0.01, 0.99];
/// Its axis lies at this share of the way from front to back (the same).
const TO_BACK: f32 = 0.55;
/// Least area of bone in a slice that tells where the thorax is, mm². Chosen, not measured.
const BONE_AREA_MM2: f32 = 80.0;
/// Slices with bone that are needed (docs/SEGMENTATION.md, How doubt is found: proposed there, not
/// measured).
const BONE_SLICES: usize = 6;

/// Marks bones and cartilage in the flags of the body.
pub(crate) fn mark_bones(
    ct: &Ct,
    frame: &Frame,
    (bone_hu, levels): (f32, Levels),
    body: &mut Body,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let levels = [bone_hu, levels.at(CARTILAGE).min(bone_hu)];
    let dense: Vec<[Vec<Run>; 2]> = (0..frame.size[2])
        .into_par_iter()
        .map(|k| {
            let image = smoothed_rows(ct, frame, (k, body.rows(frame, k)), SMOOTH_MM);
            levels.map(|level| above(frame, body, k, &image, level))
        })
        .collect();
    progress.at(0.6)?;
    let runs = |n: usize| dense.iter().flat_map(|slice| slice[n].iter().cloned()).collect();
    let bones = Parts::of_runs(frame.size, runs(0));
    for (run, part) in bones.iter() {
        if bones.voxels[part] as f64 * frame.voxel_cm3() > BONE_CM3 {
            run.voxels().for_each(|n| body.flags[n] |= flag::BONE);
        }
    }
    progress.at(0.8)?;
    let parts = Parts::of_runs(frame.size, runs(1));
    let mut joined = vec![false; parts.voxels.len()];
    for (run, part) in parts.iter() {
        joined[part] |= run.voxels().any(|n| body.flags[n] & flag::BONE != 0);
    }
    for (run, _) in parts.iter().filter(|(_, part)| joined[*part]) {
        let flags = body.flags[run.voxels()].iter_mut();
        flags.filter(|f| **f & flag::BONE == 0).for_each(|f| *f |= flag::CARTILAGE);
    }
    Ok(progress.at(1.0)?)
}

/// The voxels of a slice above a level, under the skin.
fn above(frame: &Frame, body: &Body, k: usize, image: &[f32], level: f32) -> Vec<Run> {
    let (start, ni) = (k * frame.plane(), frame.size[0]);
    let on = |n: usize| image[n - start] > level && body.depth_mm(n) > BONE_DEPTH_MM;
    let row = |n: usize| Run::within(start + n..start + n + ni, on);
    (0..frame.plane()).step_by(ni).flat_map(row).collect()
}

/// Mode of the fat of the patient, HU.
pub(crate) fn fat_of(ct: &Ct, body: &Body) -> f32 {
    fat_mode(ct.data(), |n| body.flags[n] & flag::BODY != 0)
}

/// Centre of the thorax in each slice (position within the slice, mm): a straight line through the
/// middle of the bones from side to side, at 55 % of their extent towards the back.
pub(crate) fn axis(frame: &Frame, body: &Body) -> Result<Vec<[f32; 2]>, Error> {
    let centres: Vec<(f32, [f32; 2])> = (0..frame.size[2])
        .into_par_iter()
        .filter_map(|k| Some((k as f32, bone_centre(frame, body.flags_slice(frame, k))?)))
        .collect();
    if centres.len() < BONE_SLICES {
        return Err(Error::NoRibs { slices: centres.len(), needed: BONE_SLICES });
    }
    let line = |c: usize| theil_sen(&centres.iter().map(|(k, p)| (*k, p[c])).collect::<Vec<_>>());
    let ((l0, l1), (b0, b1)) = (line(0), line(1));
    Ok((0..frame.size[2])
        .map(|k| {
            let (l, b) = (l0 + l1 * k as f32, b0 + b1 * k as f32);
            [0, 1].map(|c| l * frame.left[c] + b * frame.back[c])
        })
        .collect())
}

/// (left, back) coordinates of the middle of the bones in a slice.
fn bone_centre(frame: &Frame, flags: &[u8]) -> Option<[f32; 2]> {
    let (mut left, mut back) = (Vec::new(), Vec::new());
    for n in (0..flags.len()).filter(|&n| flags[n] & flag::BONE != 0) {
        let [x, y] = frame.position(n);
        left.push(x * frame.left[0] + y * frame.left[1]);
        back.push(x * frame.back[0] + y * frame.back[1]);
    }
    if (left.len() as f32) * frame.pixel().powi(2) < BONE_AREA_MM2 {
        return None;
    }
    let ends = |values: &mut [f32]| -> Option<[f32; 2]> {
        let last = (values.len() - 1) as f32;
        let [low, high] = OUTERMOST.map(|share| ranked(values, (last * share) as usize));
        Some([low?, high?])
    };
    let ([left, right], [front, back]) = (ends(&mut left)?, ends(&mut back)?);
    Some([0.5 * (left + right), (1.0 - TO_BACK) * front + TO_BACK * back])
}

/// Offset and slope of the line through (x, y) by the median of all slopes (Theil and Sen).
fn theil_sen(points: &[(f32, f32)]) -> (f32, f32) {
    let mut slopes: Vec<f32> = points
        .iter()
        .enumerate()
        .flat_map(|(n, p)| points[n + 1..].iter().map(move |q| (q.1 - p.1) / (q.0 - p.0)))
        .collect();
    let slope = median(&mut slopes).unwrap_or(0.0);
    let mut offsets: Vec<f32> = points.iter().map(|p| p.1 - slope * p.0).collect();
    (median(&mut offsets).unwrap_or(0.0), slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_survives_outliers() {
        let mut points: Vec<(f32, f32)> =
            (0..30).map(|k| (k as f32, 3.0 + 0.5 * k as f32)).collect();
        for p in points.iter_mut().take(8) {
            p.1 += 40.0;
        }
        let (offset, slope) = theil_sen(&points);
        assert!((offset - 3.0).abs() < 0.2 && (slope - 0.5).abs() < 0.02, "{offset} {slope}");
    }
}

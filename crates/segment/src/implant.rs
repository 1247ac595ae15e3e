//! Breast implants: large, homogeneous and in front of the rib cage.
//!
//! Silicone is denser than muscle and saline nearly as dense: both would draw the chest wall over
//! themselves. What follows sees them as fat, so that the wall ends behind them.

use crate::body::{Body, flag};
use crate::bones::fat_of;
use crate::frame::Frame;
use crate::lung_hull::{Hull, to_back};
use crate::plane::near;
use crate::smoothing::{SMOOTH_MM as BONE_SMOOTH_MM, smoothed, smoothed_rows};
use rayon::prelude::*;
use std::sync::Arc;
use supine_volume::{Ct, Parts, Run};

// Chosen, not measured: tried on implants of 105 and 5 HU in the phantom of the tests; no CT of a
// patient with implants was there to measure on (docs/SEGMENTATION.md, Traps).
/// Noise and the texture of gland are smoothed away in the slice before levels are compared, mm.
const SMOOTH_MM: f32 = 2.5;
/// Saline and silicone, HU; muscle, gland and fat lie between and below.
const RANGES_HU: [(f32, f32); 2] = [(-15.0, 22.0), (78.0, 260.0)];
/// Half the thickness within the slice, mm: no muscle in front is as thick.
const HALF_MM: f32 = 9.0;
/// Greatest standard deviation of the smoothed values in the core, HU.
const DEVIATION_HU: f64 = 8.0;
/// Least volume of the core, ml.
const CORE_ML: f64 = 3.0;
/// Volume of an implant, ml.
const MIN_ML: f64 = 60.0;
const MAX_ML: f64 = 1200.0;
/// Most of it lies outside the convex hull of the lungs in its slice, and no deeper under the skin.
const OUTSIDE_SHARE: f64 = 0.9;
const DEPTH_MM: f32 = 25.0;
/// Slices with less than this share of the widest hull lie below the breasts.
const HULL_SHARE: f32 = 0.6;
/// Muscle, HU, from which silicone and saline are told half-way.
const MUSCLE_HU: f32 = 55.0;
/// Lighter smoothing when the core is grown, mm.
const GROW_SMOOTH_MM: f32 = 1.5;
/// Half the width of the ways by which it grows, mm, and how much brighter it may be, HU.
const WAY_MM: f32 = 2.5;
const BRIGHTER_HU: f32 = 60.0;
/// Width of the blurred rim, mm, and the level and smoothing that tell fat beside it.
pub(crate) const RIM_MM: f32 = 3.0;
pub(crate) const FATTY_HU: f32 = -40.0;

/// The CT in which the implants are filled with this patient's fat; their volume and voxels go
/// into the body.
pub(crate) fn as_fat(ct: Arc<Ct>, frame: &Frame, body: &mut Body) -> Arc<Ct> {
    let hulls = hulls(frame, body);
    let chest = Chest { ct: &ct, frame, body, hulls: &hulls };
    let slices = chest.slices();
    let mut implants = Vec::new();
    let mut volume = 0.0;
    for range in 0..RANGES_HU.len() {
        volume += chest.find(&slices, range, &mut implants);
    }
    body.implant_ml = volume;
    if body.implant_ml == 0.0 {
        return ct;
    }
    filled(ct, body, implants.into_iter(), std::iter::empty())
}

/// The CT with this patient's fat in the voxels of implants, which are marked, and in those that
/// are blurred by them.
pub(crate) fn filled(
    mut ct: Arc<Ct>,
    body: &mut Body,
    implants: impl Iterator<Item = usize>,
    blurred: impl Iterator<Item = usize>,
) -> Arc<Ct> {
    let fat = fat_of(&ct, body) as i16;
    let values = Arc::make_mut(&mut ct).data_mut();
    blurred.for_each(|n| values[n] = fat);
    for n in implants {
        values[n] = fat;
        body.flags[n] |= flag::IMPLANT;
    }
    ct
}

/// Where implants are looked for.
struct Chest<'a> {
    ct: &'a Ct,
    frame: &'a Frame,
    body: &'a Body,
    hulls: &'a [Option<Hull>],
}

impl Chest<'_> {
    /// The pixels of all slices whose surroundings lie within the ranges.
    fn slices(&self) -> Vec<Cores> {
        (0..self.hulls.len())
            .into_par_iter()
            .map(|k| match &self.hulls[k] {
                Some(hull) => self.cores(k, hull),
                None => Cores::default(),
            })
            .collect()
    }

    /// Collects the voxels of the implants of a range of HU; gives their volume, ml.
    fn find(&self, slices: &[Cores], range: usize, implants: &mut Vec<usize>) -> f64 {
        let plane = self.frame.plane();
        let on = |k: usize, n: usize| slices[k].within.get(n).is_some_and(|&w| w >> range & 1 == 1);
        let parts = Parts::of_slices(self.frame.size, on);
        let mut facts = vec![Facts::default(); parts.voxels.len()];
        let mut hu = slices.iter().flat_map(|s| s.hu[range].iter().copied());
        for (run, part) in parts.iter() {
            let hull = self.hulls[run.start / plane].as_ref();
            for (n, hu) in run.voxels().zip(&mut hu) {
                let in_hull = hull.is_some_and(|h| h.inside[n % plane]);
                facts[part].add(hu, self.body.depth_mm(n), in_hull);
            }
        }
        let mut volume = 0.0;
        let core_voxels = CORE_ML / self.frame.voxel_cm3();
        let candidates = facts.iter().enumerate().filter(|(_, f)| f.is_implant(core_voxels));
        for (part, facts) in candidates {
            let grown = self.grow(&parts, part, facts.mean() as f32);
            let ml = grown.len() as f64 * self.frame.voxel_cm3();
            if (MIN_ML..MAX_ML).contains(&ml) {
                volume += ml;
                implants.extend(grown);
            }
        }
        volume
    }

    /// The pixels in front whose surroundings lie all within a range.
    fn cores(&self, k: usize, hull: &Hull) -> Cores {
        let (plane, frame) = (self.frame.plane(), self.frame);
        let rows = (k, self.body.rows(frame, k));
        let smooth = smoothed_rows(self.ct, frame, rows, SMOOTH_MM);
        let flags = self.body.flags_slice(frame, k);
        let front: Vec<bool> = (0..plane)
            .map(|n| flags[n] & flag::BODY != 0 && to_back(frame, n) < hull.middle)
            .collect();
        let mut cores = Cores { within: vec![0; plane], ..Cores::default() };
        for (range, (low, high)) in RANGES_HU.into_iter().enumerate() {
            let off: Vec<bool> =
                (0..plane).map(|n| !(front[n] && (low..=high).contains(&smooth[n]))).collect();
            let core = inner(&off, frame, HALF_MM);
            for n in (0..plane).filter(|&n| core[n]) {
                cores.within[n] |= 1 << range;
                cores.hu[range].push(smooth[n]);
            }
        }
        cores
    }

    /// The voxels joined to a core on its side of the half-way levels to muscle and fat, by ways
    /// at least twice `WAY_MM` wide.
    fn grow(&self, cores: &Parts, core: usize, mean: f32) -> Vec<usize> {
        let frame = self.frame;
        let (plane, spacing) = (frame.plane(), [frame.spacing[0], frame.spacing[1]]);
        let half = 0.5 * (mean - MUSCLE_HU).abs();
        let (low, high) = if mean > MUSCLE_HU {
            (mean - half, mean + BRIGHTER_HU)
        } else {
            (mean - half, mean + half)
        };
        let ways: Vec<Vec<bool>> = (0..frame.size[2])
            .into_par_iter()
            .map(|k| {
                let Some(hull) = &self.hulls[k] else { return Vec::new() };
                let smooth = smoothed(self.ct, frame, k, GROW_SMOOTH_MM);
                let flags = self.body.flags_slice(frame, k);
                let on = |n: usize| {
                    let tissue = flags[n] & flag::BODY != 0 && !hull.inside[n];
                    tissue && to_back(frame, n) < hull.middle && (low..=high).contains(&smooth[n])
                };
                let off: Vec<bool> = (0..plane).map(|n| !on(n)).collect();
                inner(&off, frame, WAY_MM)
            })
            .collect();
        let wide = Parts::of_slices(frame.size, |k, n| ways[k].get(n) == Some(&true));
        let mut joined = vec![false; wide.voxels.len()];
        let own: std::collections::HashSet<usize> =
            cores.iter().filter(|(_, p)| *p == core).flat_map(|(r, _)| r.voxels()).collect();
        for (run, part) in wide.iter() {
            joined[part] |= run.voxels().any(|n| own.contains(&n));
        }
        let mut inner = vec![Vec::new(); frame.size[2]];
        for (run, _) in wide.iter().filter(|(_, p)| joined[*p]) {
            inner[run.start / plane].push(run);
        }
        let around = |(k, runs): (usize, Vec<Run>)| {
            let mut on = vec![false; plane];
            runs.iter().flat_map(|r| r.voxels()).for_each(|n| on[n - k * plane] = true);
            let fat: Vec<bool> = smoothed(self.ct, frame, k, BONE_SMOOTH_MM)
                .into_iter()
                .map(|v| v < FATTY_HU)
                .collect();
            // The blurred rim of silicone is no sheet of muscle; that of saline does not look like
            // one.
            let dense = mean > MUSCLE_HU;
            let reach = |mm: f32| near(&on, frame.size[0], spacing, mm);
            let inside = reach(WAY_MM + if dense { frame.pixel() } else { 0.0 });
            let rim = if dense { reach(WAY_MM + RIM_MM) } else { vec![false; plane] };
            let at_fat = near(&fat, frame.size[0], spacing, RIM_MM);
            (0..plane)
                .filter(|&n| inside[n] || rim[n] && at_fat[n])
                .map(|n| k * plane + n)
                .collect::<Vec<_>>()
        };
        inner
            .into_par_iter()
            .enumerate()
            .filter(|(_, runs)| !runs.is_empty())
            .flat_map_iter(around)
            .collect()
    }
}

/// The pixels of a slice farther than `reach` (mm) from all that are off.
fn inner(off: &[bool], frame: &Frame, reach: f32) -> Vec<bool> {
    let spacing = [frame.spacing[0], frame.spacing[1]];
    near(off, frame.size[0], spacing, reach).into_iter().map(|near| !near).collect()
}

/// The cores in a slice, by range.
#[derive(Default)]
struct Cores {
    /// A bit per range; empty where no implants are looked for.
    within: Vec<u8>,
    /// Smoothed values of the pixels of each range in their order, HU.
    hu: [Vec<f32>; RANGES_HU.len()],
}

/// Sums over a core.
#[derive(Clone, Default)]
struct Facts {
    voxels: f64,
    sum: f64,
    squares: f64,
    shallow: f64,
    in_hull: f64,
}

impl Facts {
    fn add(&mut self, hu: f32, depth: f32, in_hull: bool) {
        let hu = f64::from(hu);
        self.voxels += 1.0;
        self.sum += hu;
        self.squares += hu * hu;
        self.shallow += f64::from(u8::from(depth < DEPTH_MM));
        self.in_hull += f64::from(u8::from(in_hull));
    }

    fn mean(&self) -> f64 {
        self.sum / self.voxels
    }

    fn is_implant(&self, min_voxels: f64) -> bool {
        let variance = self.squares / self.voxels - self.mean().powi(2);
        self.voxels > min_voxels
            && variance < DEVIATION_HU.powi(2)
            && self.shallow > 0.0
            && self.in_hull < (1.0 - OUTSIDE_SHARE) * self.voxels
    }
}

/// The hulls of the slices at the level of the breasts.
fn hulls(frame: &Frame, body: &Body) -> Vec<Option<Hull>> {
    let mut hulls: Vec<Option<Hull>> = (0..frame.size[2])
        .into_par_iter()
        .map(|k| Hull::new(frame, body.flags_slice(frame, k)))
        .collect();
    let widest = hulls.iter().flatten().map(|h| h.area).max().unwrap_or(0) as f32;
    for hull in &mut hulls {
        if hull.as_ref().is_some_and(|h| (h.area as f32) < HULL_SHARE * widest) {
            *hull = None;
        }
    }
    hulls
}

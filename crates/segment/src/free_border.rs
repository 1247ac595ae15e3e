//! Muscle beyond the surface of the wall: free borders, which one radius per ray cannot follow.

use crate::band::{LOWEST_MM, STEP_MM};
use crate::frame::Frame;
use crate::muscle::{DEPTH_MM, Found};
use crate::paint::Outline;
use crate::plane::{fill_holes, keep_joined, near};
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::Constraints;
use crate::slice_tissue::{SliceTissue, tissue};
use rayon::prelude::*;
use supine_volume::{LabelMap, Parts, Run, label};

// Constants that name no measurement were chosen.
/// A surface that turns towards its rays more than this (mm of radius per mm along it) ends at the
/// free border of a muscle, or beside one.
const STEEP: f32 = 1.2;
/// Muscle beyond the surface is looked for so near to a steep place: mm along the surface, and
/// along the body.
const NEAR_MM: f32 = 25.0;
const NEAR_Z_MM: f32 = 6.0;
/// It lies no farther outside the surface than this, mm, and no farther than `CLOSE_MM` when the
/// fat between them is left out: gland lies on the wall, a free border over the fat of the armpit.
/// Beyond the step at a border the surface lies deep: there muscle that is no farther than
/// `CLOSE_MM` from the surface beside it counts up to `FARTHEST_MM`. Measured: a thick pectoralis
/// of breast-flt001 is cut by 5 mm without.
const BEYOND_MM: f32 = 45.0;
const CLOSE_MM: f32 = 25.0;
const FARTHEST_MM: f32 = 60.0;
/// It must be joined to this much muscle under the surface, cm³, no deeper than `UNDER_MM`.
const JOINED_CM3: f64 = 0.5;
const UNDER_MM: f32 = 6.0;
/// A free border is longer along the body than this, mm; gland that touches the wall is not.
const LONG_MM: f32 = 16.0;
/// What the smoothing takes off a muscle: of its flat sides, mm, and of a border that thins out to
/// an edge, mm along the tissue. Measured: edges of the pectoralis on two real CTs were cut by 6 to
/// 10; one less than 2 mm thick by 7 when its mean had to be that of muscle.
const RIM_MM: f32 = 2.5;
const TIP_MM: f32 = 10.0;
/// Most of its very edge lies over so much fat, mm. Chosen, not measured.
const OVER_FAT_MM: f32 = 2.0;
/// It is longer along the body than this, mm; a strand of gland that touches the wall is not.
/// Chosen, not measured.
const TIP_LONG_MM: f32 = 12.0;

/// Gives the muscle beyond the surface its label. One radius per ray cannot follow the free border
/// of a muscle (pectoralis over the armpit, latissimus): near places where the surface is steep,
/// homogeneous muscle that is joined to the muscle under the surface belongs to the wall.
pub(crate) fn add_beyond(
    outline: &Outline<'_>,
    (found, tissue): (&Found<'_>, &SliceTissue),
    shell: &RadialMap,
    seeds: &Constraints,
    labels: &mut LabelMap,
) {
    let border = Border::new(outline, (found, tissue), shell, seeds);
    let frame = border.scan.frame;
    let near = |run: &Run| Run::within(run.voxels(), |n| border.beyond(n).is_some());
    let parts = Parts::of_runs(frame.size, found.muscle.par_iter().flat_map_iter(near).collect());
    let outside = |run: &Run| Run::within(run.voxels(), |n| outline.beyond(n) >= 0.0);
    let outside: Vec<Vec<Run>> = parts.runs.par_iter().map(outside).collect();
    let mut under = vec![0usize; parts.voxels.len()];
    for ((run, part), outside) in parts.iter().zip(&outside) {
        under[part] += run.len - outside.iter().map(|run| run.len).sum::<usize>();
    }
    let joined = |part: usize| under[part] as f64 * frame.voxel_cm3() > JOINED_CM3;
    let outside = parts.part.iter().zip(outside).filter(|(part, _)| joined(**part));
    let core = long(outside.flat_map(|(_, runs)| runs).collect(), frame);
    let plane = frame.plane();
    let slices = labels.data_mut().par_chunks_mut(plane).zip(&core).enumerate();
    let tips: Vec<Vec<Run>> = slices.map(|(k, (out, core))| border.paint(k, core, out)).collect();
    let tips = Parts::of_runs(frame.size, tips.concat());
    let lengths = lengths(&tips, frame);
    for (run, _) in tips.iter().filter(|(_, part)| lengths[*part] <= TIP_LONG_MM) {
        labels.data_mut()[run.voxels()].fill(label::SOFT_TISSUE);
    }
    labels.data_mut().par_chunks_mut(plane).for_each(|out| fill_wall(out, frame.size[0]));
}

/// The surroundings of steep places of the surface, where muscle may go on beyond it.
struct Border<'a> {
    outline: &'a Outline<'a>,
    scan: Scan<'a>,
    found: &'a Found<'a>,
    tissue: &'a SliceTissue,
    shell: &'a RadialMap,
    seeds: &'a Constraints,
    /// 1 on the rays near to steep places.
    near: RadialMap,
    /// No voxel nearer to the axis or farther from it counts in a slice, mm².
    extents: Vec<(f32, f32)>,
}

impl<'a> Border<'a> {
    fn new(
        outline: &'a Outline<'a>,
        (found, tissue): (&'a Found<'a>, &'a SliceTissue),
        shell: &'a RadialMap,
        seeds: &'a Constraints,
    ) -> Self {
        let scan = outline.scan();
        let near = near_steep(scan, outline.radius());
        let extent = |k: usize| {
            let (nearest, farthest) = outline.extent(k);
            ((nearest - UNDER_MM).max(0.0).powi(2), (farthest + FARTHEST_MM).powi(2))
        };
        let extents = (0..scan.frame.size[2]).map(extent).collect();
        Self { outline, scan, found, tissue, shell, seeds, near, extents }
    }

    /// How far a voxel lies outside the surface, mm, where muscle is looked for.
    fn beyond(&self, n: usize) -> Option<f32> {
        let plane = self.scan.frame.plane();
        let (k, position) = (n / plane, self.scan.frame.position(n % plane));
        let (nearest, farthest) = self.extents[k];
        let away = self.scan.rays.squared_radius(k, position);
        if away < nearest || away > farthest {
            return None;
        }
        let (ray, beyond) = self.outline.seen(k, position);
        if self.near.values[ray] == 0.0 {
            return None;
        }
        let free = self.seeds.bound(ray).cost(self.wall(ray) + beyond) == 0.0;
        let far = |beyond: f32| {
            beyond >= BEYOND_MM || beyond > CLOSE_MM && beyond - self.fat(ray, beyond) > CLOSE_MM
        };
        let within = (-UNDER_MM..FARTHEST_MM).contains(&beyond)
            && (!far(beyond) || self.beside(ray, beyond) <= CLOSE_MM);
        (free && within).then_some(beyond)
    }

    /// How far a voxel so far outside the surface lies from the surface on the rays beside its own,
    /// mm.
    fn beside(&self, ray: usize, beyond: f32) -> f32 {
        let (k, p, radius) = (ray / RAYS, ray % RAYS, self.outline.radius());
        let own = radius.at(k, p).max(1.0);
        let (r, arc) = (own + beyond, radius.arc(k, p) * (own + beyond) / own);
        let away = |steps: usize, p: usize| {
            (r - radius.at(k, p % RAYS)).max(0.0).hypot(arc * steps as f32)
        };
        let rays = 0..(CLOSE_MM / arc) as usize + 1;
        let nearest = rays.map(|d| away(d, p + d).min(away(d, p + RAYS - d)));
        nearest.fold(f32::INFINITY, f32::min)
    }

    /// The pixels of those parts of a slice most of which lie over fat: a border that thins out to
    /// an edge is partial volume of muscle and fat, and not told from gland by its mean; but gland
    /// lies on the wall.
    fn overhanging(&self, k: usize, parts: &Parts) -> Vec<Run> {
        let over_fat = |n: usize| {
            let (ray, beyond) = self.outline.seen(k, self.scan.frame.position(n));
            beyond > 0.0 && self.fat(ray, beyond) > OVER_FAT_MM
        };
        let mut over = vec![0usize; parts.voxels.len()];
        for (run, part) in parts.iter() {
            over[part] += run.voxels().filter(|&n| over_fat(n)).count();
        }
        let most = |part: usize| 2 * over[part] >= parts.voxels[part];
        parts.iter().filter(|(_, part)| most(*part)).map(|(run, _)| run).collect()
    }

    /// Height of the wall over the shell on a ray, mm.
    fn wall(&self, ray: usize) -> f32 {
        self.outline.radius().values[ray] - self.shell.values[ray]
    }

    /// Fat on a ray within so far from the wall on, mm.
    fn fat(&self, ray: usize, beyond: f32) -> f32 {
        let wall = self.wall(ray);
        let hu = self.found.hu.ray(ray / RAYS, ray % RAYS);
        let level = |h: f32| (((h - LOWEST_MM) / STEP_MM).max(0.0) as usize).min(hu.len());
        let between = &hu[level(wall)..level(wall + beyond)];
        // What is not known is no fat.
        let fat = between
            .iter()
            .map(|&v| if v.is_nan() { 0.0 } else { 1.0 - self.found.levels.likeness(v) });
        STEP_MM * fat.sum::<f32>()
    }

    /// Labels the muscle of a slice: what was found (`core`, pixels), its flat sides, and borders
    /// that thin out to an edge; gives the voxels of the very edges.
    fn paint(&self, k: usize, core: &[usize], out: &mut [u8]) -> Vec<Run> {
        let frame = self.scan.frame;
        let (plane, ni) = (frame.plane(), frame.size[0]);
        let rays = &self.near.values[k * RAYS..(k + 1) * RAYS];
        if core.is_empty() && !rays.contains(&1.0) {
            return Vec::new();
        }
        let spacing = [frame.spacing[0], frame.spacing[1]];
        let mut on = vec![false; plane];
        core.iter().for_each(|&n| on[n] = true);
        let tissue = self.tissue.of(self.scan, k);
        let is = |n: usize, bit: u8| tissue[n] & bit != 0;
        let dense: Vec<bool> = (0..plane)
            .map(|n| !is(n, tissue::SOFT) && (on[n] || self.beyond(k * plane + n).is_some()))
            .collect();
        let sides = near(&on, ni, spacing, RIM_MM);
        let free = |n: usize| out[n] == label::CHEST_WALL && dense[n];
        let from: Vec<bool> = (0..plane).map(|n| on[n] || free(n)).collect();
        let muscle = |n: usize| is(n, tissue::THIN) && is(n, tissue::MUSCLE);
        let deep = |n: usize| self.scan.body.depth_mm(k * plane + n) > DEPTH_MM;
        let mut edge: Vec<bool> =
            (0..plane).map(|n| dense[n] && (from[n] || deep(n) && muscle(n))).collect();
        let thinner = |n: usize| is(n, tissue::THINNER) && is(n, tissue::DENSE_AROUND);
        let tip = |n: usize| dense[n] && !edge[n] && deep(n) && thinner(n);
        let tips = self.overhanging(k, &Parts::new([ni, plane / ni, 1], tip));
        tips.iter().for_each(|run| edge[run.voxels()].fill(true));
        keep_joined(&mut edge, &from, ni, spacing, TIP_MM);
        for n in (0..plane).filter(|&n| dense[n] && (sides[n] || edge[n])) {
            out[n] = label::CHEST_WALL;
        }
        let kept = tips.iter().flat_map(|run| Run::within(run.voxels(), |n| edge[n]));
        kept.map(|run| Run { start: k * plane + run.start, ..run }).collect()
    }
}

/// What lies between muscle that was added and the rest of the wall is held on all sides.
fn fill_wall(out: &mut [u8], ni: usize) {
    let mut wall: Vec<bool> = out.iter().map(|&l| l == label::CHEST_WALL).collect();
    fill_holes(&mut wall, ni);
    for (out, wall) in out.iter_mut().zip(wall) {
        if wall && *out == label::SOFT_TISSUE {
            *out = label::CHEST_WALL;
        }
    }
}

/// The parts of some runs that are long enough along the body for a muscle, as pixels per slice.
fn long(runs: Vec<Run>, frame: &Frame) -> Vec<Vec<usize>> {
    let plane = frame.plane();
    let parts = Parts::of_runs(frame.size, runs);
    let lengths = lengths(&parts, frame);
    let mut pixels = vec![Vec::new(); frame.size[2]];
    for (run, _) in parts.iter().filter(|(_, part)| lengths[*part] > LONG_MM) {
        pixels[run.start / plane].extend(run.voxels().map(|n| n % plane));
    }
    pixels
}

/// Length of parts along the body, mm.
fn lengths(parts: &Parts, frame: &Frame) -> Vec<f32> {
    let mut ends = vec![(usize::MAX, 0); parts.voxels.len()];
    for (run, part) in parts.iter() {
        let k = run.start / frame.plane();
        ends[part] = (k.min(ends[part].0), k.max(ends[part].1));
    }
    let slices = ends.into_iter().map(|(first, last)| (last + 1).saturating_sub(first));
    slices.map(|slices| slices as f32 * frame.spacing[2]).collect()
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

//! The outer surface of the chest wall: the cheapest surface outside the rib shell.

use crate::Error;
use crate::aggregate::{Costs, Jump, Jumps, aggregate, cheapest};
use crate::band::{Band, FRONT, LOWEST_MM, STEP_MM, height};
use crate::frame::Frame;
use crate::levels::Levels;
use crate::muscle::Dense;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::{Constraints, Free};
use crate::shell::Shell;
use crate::spikes;
use rayon::prelude::*;
use supine_space::Progress;
use supine_volume::Run;

// Costs and reaches of the reference, section 4, step 6 (set B), unless another source is named. Measured there on
// breast-flt013 and the fixture by one change at a time: 0.5 per mm of fat gives a mean of 0.36
// where 1 gives 0.42 to 0.44 mm; without the reward for edges it is 0.87 mm; without the cost of muscle left outside the
// fixture's largest error is 12 instead of 4.2 mm; jumps at twice the price 0.55 mm.
/// What differs over the ribs and below them.
#[derive(Clone, Copy)]
struct Rule {
    /// Cost per mm of fat enclosed beyond the shell; above the cap counted less.
    fat: f32,
    /// Dense tissue left outside the surface counts within this reach, mm.
    dense_mm: f32,
}

const OVER_RIBS: Rule = Rule { fat: 0.5, dense_mm: 8.0 };
/// Chosen, not measured: there the fat of the belly lies under a thin sheet of muscle, and no gland over it.
const BELOW_RIBS: Rule = Rule { fat: 0.05, dense_mm: 25.0 };
const FAT_CAP_MM: f32 = 8.0;
const FAT_BEYOND_CAP: f32 = 0.3;
/// Fat is counted from this height on, mm.
const FAT_FROM_MM: f32 = -2.0;
/// Cost per mm of dense tissue left just outside the surface.
const DENSE: f32 = 0.6;
/// Cost per mm of muscle left outside, within this reach.
const MUSCLE: f32 = 0.5;
const MUSCLE_MM: f32 = 25.0;
/// Reward for a full edge from muscle to fat, and the width it is measured over, mm.
const EDGE: f32 = 4.0;
const EDGE_MM: f32 = 2.0;
/// Cost per mm of departure from the expected thickness, beyond a slack and up to a cap.
const THICKNESS: f32 = 0.1;
const THICKNESS_SLACK_MM: f32 = 2.0;
const THICKNESS_CAP_MM: f32 = 8.0;
/// Cost per mm of gland enclosed beyond the expected thickness and this slack. Chosen, not measured.
const GLAND: f32 = 0.4;
const GLAND_SLACK_MM: f32 = 4.0;
/// Cost per mm of jump between rays 1 degree apart, and mm allowed.
const JUMP: f32 = 0.6;
const JUMP_MM: f32 = 3.0;
/// Cost of coming closer to the skin than this (mm), and per mm of dense tissue between the surface and
/// the shell outside it: the shell bridges dips, such as that beside the costal arch, where the wall otherwise
/// stood 5 to 8 mm out on a real CT. The costs were chosen, not measured.
const BARRED: f32 = 20.0;
const SKIN_MM: f32 = 2.5;
const INSIDE: f32 = 3.0;
/// Thickness of a fat plane that shows where the wall ends, mm.
const PLANE_MM: f32 = 2.0;
/// The thickness where no plane is seen anywhere, mm. Chosen, not measured.
const USUAL_MM: f32 = 8.0;

/// The surface and what is known of it.
pub(crate) struct Wall {
    /// Height above the shell, mm.
    pub(crate) height: RadialMap,
    /// 1 where the edge from muscle to fat lies within 1 mm of the surface.
    pub(crate) edge: RadialMap,
}

/// The search for the wall: all that it rests on but the seeds.
pub(crate) struct Search {
    /// HU along the rays.
    hu: Costs,
    pub(crate) levels: Levels,
    /// The voxels of homogeneous muscle.
    pub(crate) muscle: Vec<Run>,
    /// Costs of the levels of each ray, but for the expected thickness.
    costs: Costs,
    /// Likeness to gland along the rays in front, over the ribs.
    gland: Costs,
    /// The expected height, mm.
    expected: RadialMap,
    /// The height of the surface without seeds, to the step, mm.
    free: RadialMap,
}

impl Search {
    /// Prepares the search, from `LOWEST_MM` to `reach_mm` outside the shell.
    pub(crate) fn new(
        scan: Scan<'_>,
        Shell { radius: shell, below_ribs, .. }: &Shell,
        reach_mm: f32,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let slices = scan.frame.size[2];
        let band = Band::sample(scan, shell, reach_mm);
        progress.at(0.3)?;
        let levels = Levels::measure(&band, scan.rays)?;
        let Dense { muscle, mut gland, voxels } = Dense::find(scan, &band, shell, levels);
        // There is none at the back, where muscle may be as soft, nor below the ribs.
        let none = |n: usize| scan.rays.to_back[n % RAYS] >= FRONT || below_ribs.values[n] > 0.0;
        let rays = gland.values.par_chunks_mut(band.levels()).enumerate();
        rays.filter(|(n, _)| none(*n)).for_each(|(_, ray)| ray.fill(0.0));
        progress.at(0.5)?;
        let costs = Costs::new(slices, band.levels(), |k, out| {
            for (p, out) in out.chunks_exact_mut(band.levels()).enumerate() {
                let depth = band.depth.ray(k, p);
                let rule = if below_ribs.at(k, p) > 0.0 { BELOW_RIBS } else { OVER_RIBS };
                ray_costs(&likeness(&band, levels, k, p), muscle.ray(k, p), depth, rule, out);
            }
        });
        let plane = RadialMap::from_fn(slices, |k, p| {
            let (likeness, depth) = (likeness(&band, levels, k, p), band.depth.ray(k, p));
            if below_ribs.at(k, p) > 0.0 {
                outermost_muscle(&likeness, depth)
            } else {
                first_fat_plane(&likeness, depth)
            }
        });
        progress.at(0.6)?;
        let expected = plane.filled(scan.frame.spacing[2], USUAL_MM);
        let free = RadialMap::new(slices, 0.0);
        let mut search = Self { hu: band.hu, levels, muscle: voxels, costs, gland, expected, free };
        // A first solution tells which of the fat planes seen are where the wall ends.
        search.free = search.cheapest(scan, &search.with_prior());
        search.expected = confirmed(&search.free, &plane).filled(scan.frame.spacing[2], USUAL_MM);
        progress.at(1.0)?;
        Ok(search)
    }

    /// The cheapest surface, to the step.
    fn cheapest(&self, scan: Scan<'_>, costs: &Costs) -> RadialMap {
        let chosen = cheapest(&aggregate(costs, jumps(scan.frame)));
        RadialMap { values: chosen.into_iter().map(height).collect() }
    }

    /// The highest level searched, mm outside the shell.
    pub(crate) fn reach_mm(&self) -> f32 {
        height(self.hu.levels - 1)
    }

    /// Finds the wall.
    pub(crate) fn solve(
        &self,
        scan: Scan<'_>,
        shell: &RadialMap,
        seeds: &Constraints,
        progress: Progress<'_>,
    ) -> Result<Wall, Error> {
        let mut costs = self.with_prior();
        progress.at(0.1)?;
        self.add_seeds(&mut costs, seeds, shell, scan.frame.spacing[2]);
        progress.at(0.2)?;
        let surface = spikes::lowered(&self.cheapest(scan, &costs), shell, scan);
        progress.at(0.8)?;
        let (height, edge) = refine(&surface, &self.hu, self.levels, scan.frame, seeds);
        progress.at(1.0)?;
        Ok(Wall { height, edge })
    }

    /// The costs with the expected thickness.
    fn with_prior(&self) -> Costs {
        let levels = self.hu.levels;
        Costs::new(self.expected.slices(), levels, |k, out| {
            out.copy_from_slice(&self.costs.values[k * RAYS * levels..(k + 1) * RAYS * levels]);
            for (p, out) in out.chunks_exact_mut(levels).enumerate() {
                let goal = self.expected.at(k, p);
                let gland = self.gland.ray(k, p);
                let mut enclosed = 0.0;
                for (level, cost) in out.iter_mut().enumerate() {
                    let above = height(level) - goal;
                    if above > GLAND_SLACK_MM {
                        enclosed += gland[level] * STEP_MM;
                    }
                    let off = above.abs() - THICKNESS_SLACK_MM;
                    *cost += THICKNESS * off.clamp(0.0, THICKNESS_CAP_MM) + GLAND * enclosed;
                }
            }
        })
    }

    /// Adds what the seeds ask.
    fn add_seeds(&self, costs: &mut Costs, seeds: &Constraints, shell: &RadialMap, slice_mm: f32) {
        let levels = self.hu.levels;
        let level_of = |h: f32| (((h - LOWEST_MM) / STEP_MM).max(0.0) as usize).min(levels - 1);
        let gap = |n: usize, h: f32| {
            let ray = self.costs.ray(n / RAYS, n % RAYS);
            ray[level_of(h)] - ray[level_of(self.free.values[n])]
        };
        let limits = seeds.limits(&Free { surface: &self.free, gap: &gap }, shell, slice_mm);
        costs.values.par_chunks_mut(levels).enumerate().for_each(|(n, ray)| {
            let ([lower, upper], bound) = (limits[n], seeds.bound(n));
            for (level, cost) in ray.iter_mut().enumerate() {
                let h = height(level);
                *cost += lower.price * (lower.height - h).max(0.0)
                    + upper.price * (h - upper.height).max(0.0)
                    + bound.cost(h);
            }
        });
    }
}

fn jumps(frame: &Frame) -> Jumps {
    let (dz, dp) = (frame.spacing[2] / 2.5, 360.0 / RAYS as f32);
    let mm = JUMP_MM / STEP_MM;
    Jumps {
        ray: Jump { cost: JUMP * STEP_MM / dp, reach: (mm * dp).ceil() as usize },
        slice: Jump { cost: 0.56 * JUMP * STEP_MM / dz, reach: ((mm * dz) as usize).max(3) },
    }
}

/// Likeness to muscle, 0 (fat) to 1, along a ray; 1/2 where nothing is known, 0 in the skin.
fn likeness(band: &Band, levels: Levels, k: usize, p: usize) -> Vec<f32> {
    let (hu, depth) = (band.hu.ray(k, p), band.depth.ray(k, p));
    hu.iter()
        .zip(depth)
        .map(|(&v, &d)| {
            if v.is_nan() {
                0.5
            } else if d < SKIN_MM {
                0.0
            } else {
                levels.likeness(v)
            }
        })
        .collect()
}

/// The costs of the levels of a ray, but for the expected thickness.
fn ray_costs(likeness: &[f32], muscle: &[f32], depth: &[f32], rule: Rule, out: &mut [f32]) {
    let n = likeness.len();
    let sums = |values: &[f32]| -> Vec<f32> {
        let mut sum = vec![0.0; n + 1];
        for (i, v) in values.iter().enumerate() {
            sum[i + 1] = sum[i] + v * STEP_MM;
        }
        sum
    };
    let (dense, muscle) = (sums(likeness), sums(muscle));
    let steps = |mm: f32| (mm / STEP_MM) as usize;
    let (near, far, width) = (steps(rule.dense_mm), steps(MUSCLE_MM), steps(EDGE_MM));
    let shell = steps(FAT_FROM_MM - LOWEST_MM);
    let mut fat = 0.0f32;
    for i in 0..n {
        let h = height(i);
        if h >= FAT_FROM_MM {
            fat += (1.0 - likeness[i]) * STEP_MM;
        }
        let here = i + 1;
        let beyond = |sum: &[f32], reach: usize| sum[(here + reach).min(n)] - sum[here];
        let inside = dense[here] - dense[here.saturating_sub(width)];
        let edge = 0.5 * (inside - beyond(&dense, width));
        let enclosed = fat.min(FAT_CAP_MM) + FAT_BEYOND_CAP * (fat - FAT_CAP_MM).max(0.0);
        out[i] = rule.fat * enclosed + DENSE * beyond(&dense, near) + MUSCLE * beyond(&muscle, far)
            - EDGE * edge.max(0.0)
            + INSIDE * (dense[shell.max(i)] - dense[i]);
        // Beyond the field nothing bars; the depth is NaN only there.
        if depth[i] < SKIN_MM {
            out[i] += BARRED;
        }
    }
}

/// Height of the first fat plane outside the shell; NaN where there is none within 30 mm.
fn first_fat_plane(likeness: &[f32], depth: &[f32]) -> f32 {
    let need = (PLANE_MM / STEP_MM) as usize;
    (0..likeness.len() - need)
        .find(|&i| {
            let fat = likeness[i..i + need].iter().all(|&m| m < 0.35);
            height(i) >= 0.5 && depth[i] > SKIN_MM && fat
        })
        .map(height)
        .filter(|&h| h < 30.0)
        .unwrap_or(f32::NAN)
}

/// Height of the outer edge of the first muscle under the skin; NaN where there is none.
fn outermost_muscle(likeness: &[f32], depth: &[f32]) -> f32 {
    let need = (PLANE_MM / STEP_MM) as usize;
    (need..likeness.len())
        .rev()
        .find(|&i| depth[i] > SKIN_MM && likeness[i - need..i].iter().all(|&m| m > 0.65))
        .map_or(f32::NAN, height)
}

/// The surface where it agrees with the fat plane within 2 mm; NaN elsewhere.
fn confirmed(surface: &RadialMap, plane: &RadialMap) -> RadialMap {
    RadialMap::from_fn(surface.slices(), |k, p| {
        let h = surface.at(k, p);
        if (h - plane.at(k, p)).abs() < 2.0 { h } else { f32::NAN }
    })
}

/// Moves the surface to the half-way level between fat and muscle where that lies within 1 mm,
/// drops outliers and smooths lightly; gives the heights and where the level was found.
fn refine(
    surface: &RadialMap,
    hu: &Costs,
    levels: Levels,
    frame: &Frame,
    seeds: &Constraints,
) -> (RadialMap, RadialMap) {
    let slices = surface.slices();
    let crossing = RadialMap::from_fn(slices, |k, p| {
        crossing(hu.ray(k, p), surface.at(k, p), levels.middle())
    });
    let mut height = RadialMap::from_fn(slices, |k, p| {
        let c = crossing.at(k, p);
        if c.is_nan() { surface.at(k, p) } else { c }
    });
    let middle = height.median(1, 2);
    for (h, m) in height.values.iter_mut().zip(&middle.values) {
        if (*h - m).abs() > 2.0 {
            *h = *m;
        }
    }
    let rays_sigma = 0.7 * RAYS as f32 / 360.0;
    let mut height = height.smooth(0.35 * 2.5 / frame.spacing[2], rays_sigma);
    for (n, h) in height.values.iter_mut().enumerate() {
        *h = seeds.bound(n).clamp(*h);
    }
    let edge =
        RadialMap { values: crossing.values.iter().map(|c| f32::from(!c.is_nan())).collect() };
    (height, edge)
}

/// Where the HU falls through the level nearest to height h, within 1 mm; NaN when nowhere.
fn crossing(hu: &[f32], h: f32, level: f32) -> f32 {
    let mut best = f32::NAN;
    for i in 0..hu.len() - 1 {
        if (height(i) - h).abs() > 1.0 + STEP_MM {
            continue;
        }
        let (a, b) = (hu[i], hu[i + 1]);
        if a > level && b <= level {
            let x = height(i) + STEP_MM * (a - level) / (a - b);
            let off = (x - h).abs();
            if off <= 1.0 && (best.is_nan() || off < (best - h).abs()) {
                best = x;
            }
        }
    }
    best
}

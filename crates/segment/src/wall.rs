//! The outer surface of the chest wall: the cheapest surface outside the rib shell.

use crate::aggregate::{Costs, Jump, Jumps, aggregate, cheapest};
use crate::band::{Band, FRONT, LOWEST_MM, STEP_MM, height};
use crate::frame::Frame;
use crate::levels::Levels;
use crate::muscle::{Dense, Found};
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use crate::seeds::{Constraints, Free};
use crate::shape_mismatch::misfit;
use crate::shell::Shell;
use crate::spikes;
use crate::wall_costs::{Ray, Rule, first_fat_plane, likeness, outermost_muscle};
use crate::{Error, Weights};
use rayon::prelude::*;
use supine_space::Progress;
use supine_volume::Run;

// Costs and reaches of docs/SEGMENTATION.md, step 6, unless another source is named.
/// Cost per mm of departure from the expected thickness, beyond a slack and up to a cap. Measured:
/// without it a dense breast is flooded (20 mm on a synthetic patient).
const THICKNESS: f32 = 0.1;
const THICKNESS_SLACK_MM: f32 = 2.0;
const THICKNESS_CAP_MM: f32 = 8.0;
/// Cost per mm of gland enclosed beyond the expected thickness and this slack. Measured: at 0.2 a
/// breast full of gland is flooded.
const GLAND: f32 = 0.3;
const GLAND_SLACK_MM: f32 = 4.0;
/// Largest jump between neighbouring rays, mm. Measured: with 3 the wall cuts the corner between
/// two muscles beside the armpit by 7 mm.
const JUMP_MM: f32 = 7.0;
/// Jumps between slices cost this share.
const ALONG_BODY: f32 = 0.56;
/// The thickness where no plane is seen anywhere, mm. Chosen, not measured.
const USUAL_MM: f32 = 8.0;
/// A place that departs from its neighbours by more is an outlier, mm; the neighbours lie within
/// this distance along the body, mm: breath may move the wall between slices that are farther
/// apart.
const OUTLIER_MM: f32 = 2.0;
const NEIGHBOURS_MM: f32 = 2.6;
/// A surface that lies in fat goes down to an edge of muscle so far under it, mm. Measured on six
/// real CTs: with 2 clear parts are nearer on five (rider0109: 0.56 to 0.47 mm) and nowhere
/// farther; from 2.5 on slips of muscle over fat are lost on chest-cmb01068.
const IN_FAT_MM: f32 = 2.0;

/// The surface and what is known of it.
#[derive(Clone)]
pub(crate) struct Wall {
    /// Height above the shell, mm.
    pub(crate) height: RadialMap,
    /// 1 where the edge from muscle to fat lies within 1 mm of the surface.
    pub(crate) edge: RadialMap,
    /// How little the surface looks like the end of muscle ([`misfit`]).
    pub(crate) misfit: RadialMap,
}

/// The search for the wall: all that it rests on but the seeds.
pub(crate) struct Search {
    /// HU along the rays.
    hu: Costs,
    pub(crate) levels: Levels,
    /// The voxels of homogeneous muscle.
    muscle: Vec<Run>,
    /// Costs of the levels of each ray, but for the expected thickness.
    costs: Costs,
    /// Likeness to gland along the rays in front, over the ribs, in 255ths.
    gland: Vec<u8>,
    /// The expected height, mm.
    expected: RadialMap,
    /// The height of the surface without seeds, to the step, mm.
    free: RadialMap,
    weights: Weights,
}

impl Search {
    /// Prepares the search, from `LOWEST_MM` to `reach_mm` outside the shell.
    pub(crate) fn new(
        scan: Scan<'_>,
        Shell { radius: shell, below_ribs, .. }: &Shell,
        (reach_mm, weights): (f32, Weights),
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let slices = scan.frame.size[2];
        let band = Band::sample(scan, shell, reach_mm);
        progress.at(0.3)?;
        let levels = Levels::measure(&band, scan.rays)?;
        let Dense { muscle, mut gland, voxels } =
            Dense::find(scan, &band, shell, levels, weights.muscle_hu);
        // There is none at the back, where muscle may be as soft, nor below the ribs.
        let none = |n: usize| scan.rays.to_back[n % RAYS] >= FRONT || below_ribs.values[n] > 0.0;
        let rays = gland.par_chunks_mut(band.levels()).enumerate();
        rays.filter(|(n, _)| none(*n)).for_each(|(_, ray)| ray.fill(0));
        progress.at(0.5)?;
        let lung = |k: usize, p: usize| {
            let r = shell.at(k, p);
            let range = [r + LOWEST_MM, r + height(band.levels() - 1)];
            Some(scan.outermost_lung((k, p), range)? - r)
        };
        let costs = Costs::new(slices, band.levels(), |k, out| {
            for (p, out) in out.chunks_exact_mut(band.levels()).enumerate() {
                let ribless = below_ribs.at(k, p) > 0.0;
                let rule = if ribless { Rule::below_ribs() } else { Rule::over_ribs(&weights) };
                let ray = Ray {
                    likeness: &likeness(&band, levels, k, p),
                    muscle: muscle.ray(k, p),
                    depth: band.depth.ray(k, p),
                    lung: lung(k, p),
                };
                ray.costs(rule, &weights, out);
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
        drop((muscle, band.depth));
        let (hu, muscle) = (band.hu, voxels);
        let mut search = Self { hu, levels, muscle, costs, gland, expected, free, weights };
        // A first solution tells which of the fat planes seen are where the wall ends.
        search.free = search.cheapest(scan, &search.with_prior());
        search.expected = confirmed(&search.free, &plane).filled(scan.frame.spacing[2], USUAL_MM);
        progress.at(1.0)?;
        Ok(search)
    }

    /// What was found of muscle.
    pub(crate) fn found(&self) -> Found<'_> {
        let Self { hu, levels, muscle, weights, .. } = self;
        Found { muscle, hu, levels: *levels, below: weights.muscle_hu }
    }

    /// The cheapest surface, to the step.
    fn cheapest(&self, scan: Scan<'_>, costs: &Costs) -> RadialMap {
        let chosen = cheapest(&aggregate(costs, self.jumps(scan.frame)));
        RadialMap { values: chosen.into_iter().map(height).collect() }
    }

    fn jumps(&self, frame: &Frame) -> Jumps {
        let (dz, dp) = (frame.spacing[2] / 2.5, 360.0 / RAYS as f32);
        let (mm, cost) = (JUMP_MM / STEP_MM, self.weights.jump * STEP_MM);
        Jumps {
            ray: Jump { cost: cost / dp, reach: (mm * dp).ceil() as usize },
            slice: Jump { cost: ALONG_BODY * cost / dz, reach: ((mm * dz) as usize).max(3) },
        }
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
        let misfit = misfit(&self.hu, self.levels, &height);
        Ok(Wall { height, edge, misfit })
    }

    /// The costs with the expected thickness.
    fn with_prior(&self) -> Costs {
        let levels = self.hu.levels;
        Costs::new(self.expected.slices(), levels, |k, out| {
            out.copy_from_slice(&self.costs.values[k * RAYS * levels..(k + 1) * RAYS * levels]);
            for (p, out) in out.chunks_exact_mut(levels).enumerate() {
                let goal = self.expected.at(k, p);
                let gland = &self.gland[(k * RAYS + p) * levels..][..levels];
                let mut enclosed = 0.0;
                for (level, cost) in out.iter_mut().enumerate() {
                    let above = height(level) - goal;
                    if above > GLAND_SLACK_MM {
                        enclosed += f32::from(gland[level]) / 255.0 * STEP_MM;
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

/// The surface where it agrees with the fat plane within 2 mm; NaN elsewhere.
fn confirmed(surface: &RadialMap, plane: &RadialMap) -> RadialMap {
    RadialMap::from_fn(surface.slices(), |k, p| {
        let h = surface.at(k, p);
        if (h - plane.at(k, p)).abs() < 2.0 { h } else { f32::NAN }
    })
}

/// Moves the surface to the half-way level between fat and muscle where that lies within 1 mm,
/// drops outliers, smooths lightly and takes it out of dents full of fat; gives the heights and
/// where the level was found.
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
    let middle = height.median((NEIGHBOURS_MM / frame.spacing[2]) as usize, 2);
    for (h, m) in height.values.iter_mut().zip(&middle.values) {
        if (*h - m).abs() > OUTLIER_MM {
            *h = *m;
        }
    }
    let rays_sigma = 0.7 * RAYS as f32 / 360.0;
    let mut height = height.smooth(0.35 * 2.5 / frame.spacing[2], rays_sigma);
    for (n, h) in height.values.iter_mut().enumerate() {
        let out = out_of_fat(hu.ray(n / RAYS, n % RAYS), *h, levels.middle());
        *h = seeds.bound(n).clamp(out);
    }
    let edge =
        RadialMap { values: crossing.values.iter().map(|c| f32::from(!c.is_nan())).collect() };
    (height, edge)
}

/// The outer edge of muscle no farther than `IN_FAT_MM` under height h where that lies in fat, as
/// over a dent between ribs, which the surface bridges; else h.
fn out_of_fat(hu: &[f32], h: f32, level: f32) -> f32 {
    let here = (((h - LOWEST_MM) / STEP_MM).max(0.0) as usize).min(hu.len() - 2);
    // What is not known is no fat.
    if !(hu[here] < level && hu[here + 1] < level) {
        return h;
    }
    let steps = (IN_FAT_MM / STEP_MM) as usize;
    let under = (here.saturating_sub(steps)..here).rev().find(|&n| hu[n] >= level);
    let crossing = |n: usize| height(n) + STEP_MM * (hu[n] - level) / (hu[n] - hu[n + 1]);
    // Beside what is not known there is no edge.
    under.filter(|n| here - n > 1).map(crossing).filter(|at| at.is_finite()).unwrap_or(h)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_in_fat_goes_down_to_muscle_near_under_it_and_no_farther() {
        // Muscle up to 0 mm, fat beyond.
        let hu: Vec<f32> = (0..60).map(|n| if height(n) < 0.0 { 50.0 } else { -100.0 }).collect();
        let down = |h: f32| out_of_fat(&hu, h, -25.0);
        assert!(down(1.9) < 0.0 && down(1.9) > -STEP_MM, "{}", down(1.9));
        for h in [-4.0, -0.2, 0.4, 2.6, 9.0] {
            assert_eq!(down(h), h);
        }
        assert_eq!(out_of_fat(&[f32::NAN; 60], 1.9, -25.0), 1.9);
        let beyond = |n: usize| (0.0..1.4).contains(&height(n));
        let unknown = (0..60).map(|n| if beyond(n) { f32::NAN } else { hu[n] });
        assert_eq!(out_of_fat(&unknown.collect::<Vec<f32>>(), 1.9, -25.0), 1.9);
    }
}

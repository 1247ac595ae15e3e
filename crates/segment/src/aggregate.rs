//! The cheapest smooth surface: semi-global aggregation of costs over slices and rays.
//!
//! Source: Hirschmüller, IEEE TPAMI 30 (2008), section 2.3: dynamic programming along straight
//! paths that end in each cell, costs summed, the cheapest level taken. Here 8 directions on the
//! ring of rays times the slices; the jump costs grow linearly and jumps beyond a reach are barred.

use crate::radial_map::RAYS;
use rayon::prelude::*;

/// Costs of (slice, ray, level), level fastest.
#[derive(Debug)]
pub(crate) struct Costs {
    pub(crate) levels: usize,
    pub(crate) values: Vec<f32>,
}

impl Costs {
    /// Costs filled per slice by `fill(k, costs of the slice)`.
    pub(crate) fn new(
        slices: usize,
        levels: usize,
        fill: impl Fn(usize, &mut [f32]) + Sync,
    ) -> Self {
        let mut values = vec![0.0; slices * RAYS * levels];
        values.par_chunks_mut(RAYS * levels).enumerate().for_each(|(k, chunk)| fill(k, chunk));
        Self { levels, values }
    }

    /// The levels of a ray.
    #[inline]
    pub(crate) fn ray(&self, k: usize, p: usize) -> &[f32] {
        let start = (k * RAYS + p) * self.levels;
        &self.values[start..start + self.levels]
    }
}

/// What a jump between neighbours costs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jumps {
    /// Between neighbouring rays.
    pub(crate) ray: Jump,
    /// Between neighbouring slices.
    pub(crate) slice: Jump,
}

/// A jump along a path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jump {
    /// Cost per level.
    pub(crate) cost: f32,
    /// Levels allowed.
    pub(crate) reach: usize,
}

/// Rays walked before the first one that counts, so that the ring has no seam
/// (docs/SEGMENTATION.md, Why a surface).
const WARM: usize = 60;

/// The summed path costs of every (slice, ray, level).
pub(crate) fn aggregate(costs: &Costs, jumps: Jumps) -> Costs {
    let levels = costs.levels;
    let slices = costs.values.len() / (RAYS * levels);
    let mut sum = Costs::new(slices, levels, |k, out| {
        for forward in [true, false] {
            ring(costs, k, forward, jumps.ray, out);
        }
    });
    for up in [true, false] {
        add_paths(costs, up, jumps, &mut sum);
    }
    sum
}

/// Rays that the paths along the body turn by per slice.
const TURNS: [usize; 3] = [0, 1, RAYS - 1];

/// Adds the paths from the first slice up (or the last one down), straight on and turning to both
/// sides. All at once: each slice of costs is fetched from memory for three of them.
fn add_paths(costs: &Costs, up: bool, Jumps { ray, slice }: Jumps, sum: &mut Costs) {
    let levels = costs.levels;
    let slices = costs.values.len() / (RAYS * levels);
    let diagonal =
        Jump { cost: 0.9 * ray.cost.hypot(slice.cost), reach: ray.reach.max(slice.reach) + 1 };
    // The walk at place p is on ray p.
    let mut walks = TURNS.map(|turn| {
        let rule = if turn == 0 { slice } else { diagonal };
        (0..RAYS).map(|_| Walk::new(levels, rule)).collect::<Vec<_>>()
    });
    for step in 0..slices {
        let k = if up { step } else { slices - 1 - step };
        let out = &mut sum.values[k * RAYS * levels..(k + 1) * RAYS * levels];
        let [straight, left, right] = &mut walks;
        let walks_of_rays =
            straight.par_iter_mut().zip(left.par_iter_mut()).zip(right.par_iter_mut());
        let rays = walks_of_rays.zip(out.par_chunks_mut(levels));
        rays.with_min_len(RAYS / 4).enumerate().for_each(|(p, (((a, b), c), out))| {
            let cost = costs.ray(k, p);
            [a, b, c].into_iter().for_each(|walk| walk.step(cost, out));
        });
        walks.iter_mut().zip(TURNS).for_each(|(walks, turn)| walks.rotate_right(turn));
    }
}

/// The cheapest level of every ray, slice after slice.
pub(crate) fn cheapest(sum: &Costs) -> Vec<usize> {
    sum.values
        .par_chunks(sum.levels)
        .map(|ray| {
            let mut best = 0;
            for (n, v) in ray.iter().enumerate() {
                if *v < ray[best] {
                    best = n;
                }
            }
            best
        })
        .collect()
}

/// Adds the paths round the ring of one slice.
fn ring(costs: &Costs, k: usize, forward: bool, rule: Jump, out: &mut [f32]) {
    let levels = costs.levels;
    let ray = |step: usize| if forward { step % RAYS } else { RAYS - 1 - step % RAYS };
    let mut walk = Walk::new(levels, rule);
    let mut warm = vec![0.0; levels];
    for step in RAYS - WARM..2 * RAYS {
        let p = ray(step);
        let counts = step >= RAYS;
        let out = if counts { &mut out[p * levels..(p + 1) * levels] } else { &mut warm };
        walk.step(costs.ray(k, p), out);
    }
}

/// Floats handled at once when the smallest is looked for: two registers of the oldest machines.
const LANES: usize = 8;

/// Dynamic programming along one path.
struct Walk {
    /// Costs so far, with `pad` infinite levels at both ends.
    padded: Vec<f32>,
    spread: Vec<f32>,
    /// The lowest of them.
    lowest: f32,
    jump: f32,
    /// Jumps of 1, 2, 4 ... levels are tried one after the other: every sum of them is allowed.
    doublings: u32,
    pad: usize,
}

impl Walk {
    fn new(levels: usize, Jump { cost: jump, reach }: Jump) -> Self {
        let doublings = (reach + 1).next_power_of_two().ilog2();
        let pad = 1 << doublings >> 1;
        let mut padded = vec![f32::INFINITY; levels + 2 * pad];
        let spread = padded.clone();
        padded[pad..pad + levels].fill(0.0);
        Self { padded, spread, lowest: 0.0, jump, doublings, pad }
    }

    /// Goes on to a ray of these costs and adds the costs of the path so far to `sum`.
    fn step(&mut self, cost: &[f32], sum: &mut [f32]) {
        let (levels, pad) = (self.padded.len() - 2 * self.pad, self.pad);
        for doubling in 0..self.doublings {
            let d = 1 << doubling;
            let price = d as f32 * self.jump;
            let here = &self.padded[pad..pad + levels];
            let below = &self.padded[pad - d..pad - d + levels];
            let above = &self.padded[pad + d..pad + d + levels];
            let out = &mut self.spread[pad..pad + levels];
            for ((o, h), (b, a)) in out.iter_mut().zip(here).zip(below.iter().zip(above)) {
                *o = lower(*h, lower(*b, *a) + price);
            }
            std::mem::swap(&mut self.padded, &mut self.spread);
        }
        let before = self.lowest;
        let add = |((way, sum), cost): ((&mut f32, &mut f32), &f32)| -> f32 {
            *way += cost - before;
            *sum += *way;
            *way
        };
        let mut lowest = [f32::INFINITY; LANES];
        let mut ways = self.padded[pad..pad + levels].chunks_exact_mut(LANES);
        let (mut sums, mut costs) = (sum.chunks_exact_mut(LANES), cost.chunks_exact(LANES));
        for ((ways, sums), costs) in (&mut ways).zip(&mut sums).zip(&mut costs) {
            let all = ways.iter_mut().zip(sums).zip(costs).map(add);
            lowest.iter_mut().zip(all).for_each(|(l, way)| *l = lower(*l, way));
        }
        let rest = ways.into_remainder().iter_mut().zip(sums.into_remainder());
        let rest = rest.zip(costs.remainder()).map(add);
        self.lowest = rest.chain(lowest).fold(f32::INFINITY, lower);
    }
}

/// The lower of two numbers: one instruction where `f32::min`, which sees to NaN, is three.
#[inline]
fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alike(cost: f32, reach: usize) -> Jumps {
        Jumps { ray: Jump { cost, reach }, slice: Jump { cost, reach } }
    }

    /// Evidence for level 10 + 5 sin on two rays of three, against noise everywhere.
    #[test]
    fn a_smooth_surface_is_found_through_gaps_and_false_evidence() {
        let truth = |k: usize, p: usize| {
            let a = p as f32 / RAYS as f32 * std::f32::consts::TAU;
            (12.0 + 5.0 * (2.0 * a).sin() + 2.0 * (k as f32 / 6.0).sin()).round() as usize
        };
        let costs = Costs::new(30, 24, |k, out| {
            for p in 0..RAYS {
                let ray = &mut out[p * 24..(p + 1) * 24];
                if (p / 12 + k / 4) % 3 != 0 {
                    ray[truth(k, p)] -= 3.0;
                }
                if (p * 7 + k * 13) % 11 == 0 {
                    ray[(p * 5 + k * 3) % 24] -= 2.0;
                }
            }
        });
        let sum = aggregate(&costs, alike(0.5, 3));
        let got = cheapest(&sum);
        let wrong = (0..30 * RAYS).filter(|n| got[*n].abs_diff(truth(n / RAYS, n % RAYS)) > 2);
        let wrong = wrong.count();
        assert!(wrong < RAYS / 2, "{wrong}");
    }

    #[test]
    fn without_jump_costs_each_ray_decides_alone() {
        let costs = Costs::new(3, 5, |k, out| {
            for p in 0..RAYS {
                out[p * 5 + (p + k) % 5] = -1.0;
            }
        });
        let got = cheapest(&aggregate(&costs, alike(0.0, 4)));
        assert!((0..3 * RAYS).all(|n| got[n] == (n % RAYS + n / RAYS) % 5));
    }
}

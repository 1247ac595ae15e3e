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

/// Rays walked before the first one that counts, so that the ring has no seam (reference, section 4).
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
    let Jumps { ray, slice } = jumps;
    let diagonal =
        Jump { cost: 0.9 * ray.cost.hypot(slice.cost), reach: ray.reach.max(slice.reach) + 1 };
    for up in [true, false] {
        for turn in [0, 1, RAYS - 1] {
            let rule = if turn == 0 { jumps.slice } else { diagonal };
            add_paths(costs, up, turn, rule, &mut sum);
        }
    }
    sum
}

/// Adds the paths from the first slice up (or the last one down) that turn by `turn` rays per slice.
fn add_paths(costs: &Costs, up: bool, turn: usize, rule: Jump, sum: &mut Costs) {
    let levels = costs.levels;
    let slices = costs.values.len() / (RAYS * levels);
    // The walk at place p is on ray p.
    let mut walks: Vec<Walk> = (0..RAYS).map(|_| Walk::new(levels, rule)).collect();
    for step in 0..slices {
        let k = if up { step } else { slices - 1 - step };
        let out = &mut sum.values[k * RAYS * levels..(k + 1) * RAYS * levels];
        let rays = walks.par_iter_mut().zip(out.par_chunks_mut(levels));
        rays.with_min_len(RAYS / 4).enumerate().for_each(|(p, (walk, out))| {
            walk.step(costs.ray(k, p));
            out.iter_mut().zip(walk.current()).for_each(|(o, c)| *o += c);
        });
        walks.rotate_right(turn);
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
    for step in RAYS - WARM..2 * RAYS {
        let p = ray(step);
        walk.step(costs.ray(k, p));
        if step >= RAYS {
            let out = &mut out[p * levels..(p + 1) * levels];
            out.iter_mut().zip(walk.current()).for_each(|(o, c)| *o += c);
        }
    }
}

/// Dynamic programming along one path.
struct Walk {
    /// Costs so far, with `pad` infinite levels at both ends.
    padded: Vec<f32>,
    spread: Vec<f32>,
    next: Vec<f32>,
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
        Self { padded, spread, next: vec![0.0; levels], jump, doublings, pad }
    }

    fn current(&self) -> &[f32] {
        &self.next
    }

    fn step(&mut self, cost: &[f32]) {
        let (levels, pad) = (self.next.len(), self.pad);
        let lowest = self.padded.iter().copied().fold(f32::INFINITY, f32::min);
        for doubling in 0..self.doublings {
            let d = 1 << doubling;
            let price = d as f32 * self.jump;
            let here = &self.padded[pad..pad + levels];
            let below = &self.padded[pad - d..pad - d + levels];
            let above = &self.padded[pad + d..pad + d + levels];
            let out = &mut self.spread[pad..pad + levels];
            for ((o, h), (b, a)) in out.iter_mut().zip(here).zip(below.iter().zip(above)) {
                *o = h.min(b.min(*a) + price);
            }
            std::mem::swap(&mut self.padded, &mut self.spread);
        }
        let out = &mut self.padded[pad..pad + levels];
        for (p, (n, c)) in out.iter_mut().zip(self.next.iter_mut().zip(cost)) {
            *p += c - lowest;
            *n = *p;
        }
    }
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

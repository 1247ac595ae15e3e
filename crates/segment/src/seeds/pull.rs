//! How seeds move the expected thickness of the wall around them.

use crate::sheet::{RAYS, Sheet};
use rayon::prelude::*;

/// Reach of a seed: sigma of a Gaussian along the surface, mm.
const PULL_MM: f32 = 25.0;
/// Cost per mm of departure from the wished height, at the seed.
const PULL: f32 = 1.5;
/// Where the Gaussian is cut, sigma.
const CUT: f32 = 3.0;
/// Bounds no farther apart than this say where the surface is even if it lies between them, mm.
const TIGHT_MM: f32 = 8.0;

/// What seeds wish of a ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wish {
    k: usize,
    p: usize,
    /// Length of a turn by one ray, mm.
    arc: f32,
    lower: f32,
    upper: f32,
}

impl Wish {
    /// The wish of ray `n` for a surface from `lower` to `upper` above the shell, mm.
    pub(super) fn new(n: usize, shell: f32, lower: f32, upper: f32) -> Self {
        let r = shell + 0.0f32.max(lower).min(upper);
        let arc = r.max(1.0) * std::f32::consts::TAU / RAYS as f32;
        Self { k: n / RAYS, p: n % RAYS, arc, lower, upper }
    }
}

/// All wishes.
#[derive(Debug)]
pub(super) struct Pull {
    wishes: Vec<Wish>,
    slice_mm: f32,
}

impl Pull {
    pub(super) fn new(wishes: Vec<Wish>, slice_mm: f32) -> Self {
        Self { wishes, slice_mm }
    }

    /// The expected height as the wishes move it, and the extra cost per mm of departure from it;
    /// 0 where no seed is near that says anything against the expectation or more exactly.
    ///
    /// The shift is the mean of the nearby wishes', by a Gaussian of their distance, times the
    /// Gaussian of the nearest.
    pub(super) fn apply(&self, expected: &Sheet) -> Vec<(f32, f32)> {
        let shifts: Vec<(Wish, f32)> = self
            .wishes
            .iter()
            .filter_map(|w| {
                let h = expected.at(w.k, w.p);
                let shift = h.max(w.lower).min(w.upper) - h;
                (shift != 0.0 || w.upper - w.lower < TIGHT_MM).then_some((*w, shift))
            })
            .collect();
        let mut out: Vec<(f32, f32)> = expected.values.iter().map(|&h| (h, 0.0)).collect();
        if shifts.is_empty() {
            return out;
        }
        out.par_chunks_mut(RAYS).enumerate().for_each(|(k, out)| self.slice(&shifts, k, out));
        out
    }

    fn slice(&self, shifts: &[(Wish, f32)], k: usize, out: &mut [(f32, f32)]) {
        let mut sums = vec![(0.0f32, 0.0f32, 0.0f32); RAYS];
        for (wish, shift) in shifts {
            let across = wish.k.abs_diff(k) as f32 * self.slice_mm / PULL_MM;
            if across > CUT {
                continue;
            }
            let turn = ((CUT * PULL_MM / wish.arc) as usize).min(RAYS / 2 - 1);
            for step in 0..2 * turn + 1 {
                let along = step.abs_diff(turn) as f32 * wish.arc / PULL_MM;
                let weight = (-0.5 * (along * along + across * across)).exp();
                let (sum, total, nearest) = &mut sums[(wish.p + RAYS + step - turn) % RAYS];
                *sum += weight * shift;
                *total += weight;
                *nearest = nearest.max(weight);
            }
        }
        for ((h, extra), (sum, total, nearest)) in out.iter_mut().zip(sums) {
            if total > 0.0 {
                *h += sum / total * nearest;
                *extra = PULL * nearest;
            }
        }
    }
}

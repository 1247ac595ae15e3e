//! How a seed holds the surface around it: it says where the surface is at its own ray, and the
//! thickness of the wall changes slowly.

use crate::radial_map::{RAYS, RadialMap};
use rayon::prelude::*;

// Chosen, not measured, but for the reach: 25 mm was good in docs/SEGMENTATION.md, Seeds, which
// tried no other.
/// Change of the wall's thickness per mm along the surface that is believed without evidence.
const SLOPE: f32 = 0.2;
/// Reach of a seed: sigma of a Gaussian along the surface, mm, and where it is cut, sigma.
const REACH_MM: f32 = 30.0;
const CUT: f32 = 3.0;
/// Smallest cost per mm of departure at a seed that the surface without seeds contradicts.
const MIN_PRICE: f32 = 0.3;
/// A contradiction up to this is local: nothing follows for the surroundings. From twice this on
/// all does, mm.
const LOCAL_MM: f32 = 3.0;
/// Where the evidence speaks against the seed, the seed outweighs it by this factor.
const OUTWEIGH: f32 = 1.5;

/// A limit to a ray's surface, mm above the shell, and the cost per mm beyond it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limit {
    pub(crate) height: f32,
    pub(crate) price: f32,
}

impl Limit {
    const NONE: Self = Self { height: 0.0, price: 0.0 };
}

/// What the seeds of one ray say of the surface there.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeedLimit {
    k: usize,
    p: usize,
    /// Length of a turn by one ray, mm.
    arc: f32,
    /// Of a lower (-1) or an upper (+1) limit.
    sign: f32,
    limit: Limit,
}

/// What the surface would be without seeds.
pub(crate) struct Free<'a> {
    /// Height of the surface, mm above the shell.
    pub(crate) surface: &'a RadialMap,
    /// Cost by which the evidence on ray n prefers that surface to the height h: `cost(n, h)`.
    pub(crate) gap: &'a dyn Fn(usize, f32) -> f32,
}

impl SeedLimit {
    /// The limit of ray `n`, whose shell has the radius `shell`, for a surface below (`sign` = 1)
    /// or above (-1) the height `limit`, mm.
    pub(super) fn new(n: usize, shell: f32, sign: f32, limit: f32, free: &Free<'_>) -> Self {
        let arc = (shell + limit).max(1.0) * std::f32::consts::TAU / RAYS as f32;
        let off = sign * (free.surface.values[n] - limit);
        let share = ((off - LOCAL_MM) / LOCAL_MM).clamp(0.0, 1.0);
        let per_mm = if share > 0.0 { (free.gap)(n, limit) / off } else { 0.0 };
        let limit = Limit { height: limit, price: share * MIN_PRICE.max(OUTWEIGH * per_mm) };
        Self { k: n / RAYS, p: n % RAYS, arc, sign, limit }
    }
}

/// The limits that the seeds set to every ray: (lower, upper). Of several the one counts that
/// most opposes the surface without seeds.
pub(super) fn limits(
    seed_limits: &[SeedLimit],
    free: &RadialMap,
    slice_mm: f32,
) -> Vec<[Limit; 2]> {
    let mut out = vec![[Limit::NONE; 2]; free.values.len()];
    out.par_chunks_mut(RAYS).enumerate().for_each(|(k, out)| {
        let mut best = vec![[0.0f32; 2]; RAYS];
        for seed_limit in seed_limits {
            let across = seed_limit.k.abs_diff(k) as f32 * slice_mm;
            if across > CUT * REACH_MM {
                continue;
            }
            let side = usize::from(seed_limit.sign > 0.0);
            let turn = ((CUT * REACH_MM / seed_limit.arc) as usize).min(RAYS / 2 - 1);
            for step in 0..2 * turn + 1 {
                let p = (seed_limit.p + RAYS + step - turn) % RAYS;
                let away = (step.abs_diff(turn) as f32 * seed_limit.arc).hypot(across);
                let weight = (-0.5 * (away / REACH_MM).powi(2)).exp();
                let height = seed_limit.limit.height + seed_limit.sign * SLOPE * away;
                let price = seed_limit.limit.price * weight;
                let against = price * (seed_limit.sign * (free.at(k, p) - height)).max(0.0);
                if against > best[p][side] {
                    best[p][side] = against;
                    out[p][side] = Limit { height, price };
                }
            }
        }
    });
    out
}

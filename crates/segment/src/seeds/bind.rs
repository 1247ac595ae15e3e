//! What the seeds ask of the surface of the chest wall: hard at their own ray, soft around it.

use super::{SOFT, WALL};
use crate::scan::Scan;
use crate::sheet::{RAYS, Sheet};
use crate::wall::LOWEST_MM;
use crate::{Error, Seeds};
use supine_space::Point;

/// Cost per mm of violation.
const HARD: f32 = 1000.0;
/// The constraint fades as a cone of this slope, out to this distance.
const CONE: f32 = 0.5;
const CONE_MM: f32 = 6.5;
/// The seed moves the expected thickness around it: sigma (mm) and cost per mm at the seed.
const PULL_MM: f32 = 25.0;
const PULL: f32 = 1.5;
/// The surface keeps this distance to a seed, mm.
const MARGIN_MM: f32 = 1.0;
/// Largest distance of a chest-wall seed outside the rib shell, mm.
const HIGHEST_MM: f32 = 90.0;

/// Seeds nearer to each other than this along the surface are on one ray, mm.
const SAME_PLACE_MM: f32 = 4.0;

/// The heights above the shell between which the surface must lie on a ray, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bound {
    lower: f32,
    upper: f32,
}

impl Bound {
    const FREE: Self = Self { lower: f32::NEG_INFINITY, upper: f32::INFINITY };

    /// Cost of a surface at height h.
    #[inline]
    pub(crate) fn cost(self, h: f32) -> f32 {
        HARD * ((self.lower - h).max(0.0) + (h - self.upper).max(0.0))
    }

    fn tighten(&mut self, wall: bool, limit: f32) {
        if wall {
            self.lower = self.lower.max(limit);
        } else {
            self.upper = self.upper.min(limit);
        }
    }

    /// What lies within both, as near as can be where they exclude each other: `self` goes first.
    fn within(self, other: Self) -> Self {
        let lower = self.lower.max(other.lower.min(self.upper));
        let upper = self.upper.min(other.upper.max(self.lower));
        if lower <= upper {
            return Self { lower, upper };
        }
        let middle = 0.5 * (lower + upper);
        Self { lower: middle, upper: middle }
    }

    /// Whether a seed near the surface at height h holds it there.
    pub(crate) fn touches(self, h: f32, within_mm: f32) -> bool {
        h - self.lower <= within_mm || self.upper - h <= within_mm
    }

    pub(crate) fn clamp(self, h: f32) -> f32 {
        h.max(self.lower).min(self.upper)
    }
}

/// A seed on the rays.
#[derive(Clone, Copy, Debug)]
struct Seed {
    wall: bool,
    point: Point,
    /// Nearest slice and ray.
    k: usize,
    p: usize,
    /// Radius, mm.
    r: f32,
}

/// Seeds for wall and soft tissue.
#[derive(Clone, Debug)]
pub(crate) struct Constraints {
    seeds: Vec<Seed>,
    /// Per (slice, ray), ray fastest.
    bounds: Vec<Bound>,
}

impl Constraints {
    /// The seeds on the rays.
    ///
    /// # Errors
    /// When a soft-tissue seed lies deep inside the rib shell, a chest-wall seed far outside it, or
    /// a chest-wall seed lies farther out than a soft-tissue seed of the same ray.
    pub(crate) fn new(scan: Scan<'_>, seeds: &Seeds, shell: &Sheet) -> Result<Self, Error> {
        let Scan { ct, frame, rays, .. } = scan;
        let on_rays = |wall: bool, point: &Point| {
            let [i, j, k] = ct.grid().index_from_patient(point).map(|x| x as f32);
            let k = (k.round().max(0.0) as usize).min(frame.size[2] - 1);
            let (r, turn) = rays.polar(k, [i * frame.spacing[0], j * frame.spacing[1]]);
            Seed { wall, point: *point, k, p: turn.round() as usize % RAYS, r }
        };
        let walls = seeds.chest_wall.iter().map(|p| on_rays(true, p));
        let softs = seeds.soft_tissue.iter().map(|p| on_rays(false, p));
        let seeds: Vec<Seed> = walls.chain(softs).collect();
        for seed in &seeds {
            let h = seed.r - shell.at(seed.k, seed.p);
            let why = if !seed.wall && h < LOWEST_MM + MARGIN_MM {
                format!("lies {:.0} mm inside the rib cage", -h)
            } else if seed.wall && h > HIGHEST_MM {
                format!("lies {h:.0} mm outside the rib cage")
            } else {
                continue;
            };
            let kind = if seed.wall { WALL } else { SOFT };
            return Err(Error::Seed { kind, point: seed.point.coords.into(), why });
        }
        check_pairs(&seeds, frame.spacing[2])?;
        let bounds = bounds(&seeds, shell, frame.spacing[2]);
        Ok(Self { seeds, bounds })
    }

    pub(crate) fn len(&self) -> usize {
        self.seeds.len()
    }

    /// The greatest height of a chest-wall seed above the shell, mm.
    pub(crate) fn highest(&self, shell: &Sheet) -> f32 {
        let walls = self.seeds.iter().filter(|s| s.wall);
        walls.fold(0.0, |highest, s| highest.max(s.r - shell.at(s.k, s.p)))
    }

    /// What the seeds ask of a (slice, ray).
    pub(crate) fn bound(&self, n: usize) -> Bound {
        self.bounds[n]
    }

    /// The expected thickness as the seeds move it: (height, extra cost per mm) per ray; the extra
    /// cost is 0 where no seed contradicts the expectation.
    pub(crate) fn pull(&self, expected: &Sheet, shell: &Sheet, slice_mm: f32) -> Vec<(f32, f32)> {
        let mut out: Vec<(f32, f32)> = expected.values.iter().map(|&h| (h, 0.0)).collect();
        for seed in &self.seeds {
            let goal = seed.r - shell.at(seed.k, seed.p);
            let goal = if seed.wall { goal + MARGIN_MM } else { goal - MARGIN_MM };
            for (n, (h, extra)) in out.iter_mut().enumerate() {
                let away = seed.distance(n / RAYS, n % RAYS, slice_mm);
                let weight = (-0.5 * (away / PULL_MM).powi(2)).exp();
                if weight < 0.01 {
                    continue;
                }
                let wanted = if seed.wall { h.max(goal) } else { h.min(goal) };
                if wanted != *h {
                    *h += weight * (wanted - *h);
                    *extra += PULL * weight;
                }
            }
        }
        out
    }
}

/// Refuses seeds of one place of which the outer one is chest wall.
fn check_pairs(seeds: &[Seed], slice_mm: f32) -> Result<(), Error> {
    for wall in seeds.iter().filter(|s| s.wall) {
        for soft in seeds.iter().filter(|s| !s.wall) {
            let away = soft.distance(wall.k, wall.p, slice_mm);
            if away < SAME_PLACE_MM && wall.r > soft.r + away {
                return Err(Error::SeedsContradict {
                    first_kind: WALL,
                    first: wall.point.coords.into(),
                    second_kind: SOFT,
                    second: soft.point.coords.into(),
                    why: "the chest wall would lie in front of the soft tissue",
                });
            }
        }
    }
    Ok(())
}

/// What the seeds ask of every ray: exact at their own, fading around them.
fn bounds(seeds: &[Seed], shell: &Sheet, slice_mm: f32) -> Vec<Bound> {
    let mut own = vec![Bound::FREE; shell.values.len()];
    let mut around = own.clone();
    for seed in seeds {
        let reach = (CONE_MM / slice_mm).ceil() as usize;
        let turn = ((CONE_MM / seed.arc()).ceil() as usize).min(RAYS / 8);
        for k in seed.k.saturating_sub(reach)..(seed.k + reach + 1).min(shell.slices()) {
            for step in 0..2 * turn + 1 {
                let p = (seed.p + RAYS + step - turn) % RAYS;
                let away = seed.distance(k, p, slice_mm);
                let limit = seed.r - shell.at(k, p);
                let margin = MARGIN_MM.min(limit.abs());
                let limit = if seed.wall { limit + margin } else { limit - margin };
                // The neighbouring rays share the seed's voxel.
                if k == seed.k && step.abs_diff(turn) <= 1 {
                    own[k * RAYS + p].tighten(seed.wall, limit);
                } else if away <= CONE_MM {
                    let slack = if seed.wall { -CONE * away } else { CONE * away };
                    around[k * RAYS + p].tighten(seed.wall, limit + slack);
                }
            }
        }
    }
    own.into_iter().zip(around).map(|(own, around)| own.within(around)).collect()
}

impl Seed {
    /// Length of a turn by one ray at the seed, mm.
    fn arc(&self) -> f32 {
        self.r.max(1.0) * std::f32::consts::TAU / RAYS as f32
    }

    /// Distance along the surface to a (slice, ray), mm.
    fn distance(&self, k: usize, p: usize, slice_mm: f32) -> f32 {
        let turn = p.abs_diff(self.p).min(RAYS - p.abs_diff(self.p));
        (turn as f32 * self.arc()).hypot(k.abs_diff(self.k) as f32 * slice_mm)
    }
}

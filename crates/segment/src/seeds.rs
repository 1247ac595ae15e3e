//! The user's points: hard at their own ray, soft around it.

use crate::aggregate::Costs;
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::scan::Scan;
use crate::sheet::{RAYS, Rays, Sheet};
use crate::wall::{LOWEST_MM, height};
use crate::{Error, Seeds};
use supine_space::Point;
use supine_volume::{Ct, LabelMap, label};

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
/// A soft-tissue seed may lie this far outside the body found, mm.
const NEAR_SKIN_MM: f32 = 4.0;
/// Radius round an exclude seed that is taken off the body, mm.
const EXCLUDE_MM: f32 = 3.0;
/// Largest distance of a chest-wall seed outside the rib shell, mm.
const HIGHEST_MM: f32 = 90.0;

/// Seeds nearer to each other than this along the surface are on one ray, mm.
const SAME_PLACE_MM: f32 = 4.0;

pub(crate) const WALL: &str = "chest-wall";
pub(crate) const SOFT: &str = "soft-tissue";
pub(crate) const EXCLUDE: &str = "exclude";

/// A seed on the rays.
#[derive(Clone, Copy, Debug)]
struct Seed {
    wall: bool,
    point: Point,
    /// Continuous slice and position within the slice, mm.
    slice: f32,
    position: [f32; 2],
}

/// Seeds for wall and soft tissue.
#[derive(Clone, Debug, Default)]
pub(crate) struct Constraints {
    seeds: Vec<Seed>,
}

/// The voxel of each seed, checked to lie within the volume.
fn voxel(ct: &Ct, kind: &'static str, p: &Point) -> Result<[usize; 3], Error> {
    ct.grid().voxel_at(p).ok_or_else(|| Error::Seed {
        kind,
        point: p.coords.into(),
        why: "lies outside the CT".into(),
    })
}

/// Takes the surroundings of exclude seeds off the body, adds those of soft-tissue seeds to it, and
/// checks every seed.
pub(crate) fn apply_to_body(
    ct: &Ct,
    frame: &Frame,
    seeds: &Seeds,
    body: &mut Body,
) -> Result<(), Error> {
    let lists = [(WALL, &seeds.chest_wall), (SOFT, &seeds.soft_tissue), (EXCLUDE, &seeds.exclude)];
    let mut taken: Vec<([usize; 3], &'static str, Point)> = Vec::new();
    for (kind, points) in lists {
        for p in points {
            let here = voxel(ct, kind, p)?;
            if let Some((_, other, q)) = taken.iter().find(|(v, k, _)| *v == here && *k != kind) {
                return Err(Error::SeedsContradict {
                    first_kind: other,
                    first: q.coords.into(),
                    second_kind: kind,
                    second: p.coords.into(),
                    why: "they lie in one voxel",
                });
            }
            taken.push((here, kind, *p));
        }
    }
    for p in &seeds.exclude {
        ball(ct, frame, voxel(ct, EXCLUDE, p)?, EXCLUDE_MM, |n| body.flags[n] &= !flag::BODY);
    }
    for (kind, points) in &lists[..2] {
        for p in *points {
            claim(ct, frame, body, kind, p)?;
        }
    }
    if !(seeds.exclude.is_empty() && seeds.soft_tissue.is_empty()) {
        body.measure_depth(frame);
    }
    Ok(())
}

/// Makes sure that the body holds a seed.
fn claim(
    ct: &Ct,
    frame: &Frame,
    body: &mut Body,
    kind: &'static str,
    p: &Point,
) -> Result<(), Error> {
    let here = voxel(ct, kind, p)?;
    if body.flags[ct.grid().offset(here)] & flag::BODY != 0 {
        return Ok(());
    }
    let mut near = false;
    ball(ct, frame, here, NEAR_SKIN_MM, |n| near |= body.flags[n] & flag::BODY != 0);
    if !near || kind == WALL {
        let why = "lies outside the body".into();
        return Err(Error::Seed { kind, point: p.coords.into(), why });
    }
    ball(ct, frame, here, NEAR_SKIN_MM, |n| {
        if body.flags[n] & flag::OPEN_AIR == 0 {
            body.flags[n] |= flag::BODY;
        }
    });
    body.flags[ct.grid().offset(here)] |= flag::BODY;
    Ok(())
}

/// Calls `f` with the offset of each voxel within `radius` (mm) of a voxel.
fn ball(ct: &Ct, frame: &Frame, at: [usize; 3], radius: f32, mut f: impl FnMut(usize)) {
    let reach = [0, 1, 2].map(|a| (radius / frame.spacing[a]) as usize);
    let low = [0, 1, 2].map(|a| at[a].saturating_sub(reach[a]));
    let high = [0, 1, 2].map(|a| (at[a] + reach[a]).min(frame.size[a] - 1));
    for k in low[2]..=high[2] {
        for j in low[1]..=high[1] {
            for i in low[0]..=high[0] {
                let v = [i, j, k];
                let off = [0, 1, 2].map(|a| v[a].abs_diff(at[a]) as f32 * frame.spacing[a]);
                if off.iter().map(|x| x * x).sum::<f32>() <= radius * radius {
                    f(ct.grid().offset(v));
                }
            }
        }
    }
}

impl Constraints {
    /// The seeds on the rays.
    ///
    /// # Errors
    /// When a soft-tissue seed lies deep inside the rib shell, a chest-wall seed far outside it, or
    /// a chest-wall seed lies farther out than a soft-tissue seed of the same ray.
    pub(crate) fn new(scan: Scan<'_>, seeds: &Seeds, shell: &Sheet) -> Result<Self, Error> {
        let Scan { ct, frame, rays, .. } = scan;
        let on_rays = |wall: bool, p: &Point| {
            let [i, j, k] = ct.grid().index_from_patient(p).map(|x| x as f32);
            let position = [i * frame.spacing[0], j * frame.spacing[1]];
            Seed { wall, point: *p, slice: k, position }
        };
        let walls = seeds.chest_wall.iter().map(|p| on_rays(true, p));
        let softs = seeds.soft_tissue.iter().map(|p| on_rays(false, p));
        let all = Self { seeds: walls.chain(softs).collect() };
        for seed in &all.seeds {
            let (k, p, r) = seed.cell(rays, seed.row(shell));
            let h = r - shell.at(k, p);
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
        all.check_pairs(rays, shell, frame.spacing[2])?;
        Ok(all)
    }

    fn check_pairs(&self, rays: &Rays, shell: &Sheet, slice_mm: f32) -> Result<(), Error> {
        for wall in self.seeds.iter().filter(|s| s.wall) {
            for soft in self.seeds.iter().filter(|s| !s.wall) {
                let (k, p, r) = wall.cell(rays, wall.row(shell));
                let (l, q, s) = soft.cell(rays, soft.row(shell));
                let turn = p.abs_diff(q).min(RAYS - p.abs_diff(q)) as f32;
                let arc = turn * s * std::f32::consts::TAU / RAYS as f32;
                let away = arc.hypot(k.abs_diff(l) as f32 * slice_mm);
                if away < SAME_PLACE_MM && r > s + away {
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

    pub(crate) fn len(&self) -> usize {
        self.seeds.len()
    }

    /// The greatest height of a seed above the shell, mm.
    pub(crate) fn highest(&self, rays: &Rays, shell: &Sheet) -> f32 {
        self.seeds.iter().filter(|s| s.wall).fold(0.0, |highest, s| {
            let (k, p, r) = s.cell(rays, s.row(shell));
            highest.max(r - shell.at(k, p))
        })
    }

    /// Calls `f(seed, n, limit)` for the rays around each seed: the surface at ray n must lie
    /// outside (wall) or inside (soft tissue) the height `limit`, which is exact at its own rays.
    fn each_limit(
        &self,
        rays: &Rays,
        shell: &Sheet,
        slice_mm: f32,
        mut f: impl FnMut(&Seed, usize, (f32, bool)),
    ) {
        for seed in &self.seeds {
            let (k0, p0, r) = seed.cell(rays, seed.row(shell));
            let reach = (CONE_MM / slice_mm).ceil() as usize;
            let arc = r.max(1.0) * std::f32::consts::TAU / RAYS as f32;
            let turn = ((CONE_MM / arc).ceil() as usize).min(RAYS / 8);
            for k in k0.saturating_sub(reach)..(k0 + reach + 1).min(shell.slices()) {
                for step in 0..2 * turn + 1 {
                    let p = (p0 + RAYS + step - turn) % RAYS;
                    let aside = step.abs_diff(turn);
                    let away = (aside as f32 * arc).hypot(k.abs_diff(k0) as f32 * slice_mm);
                    if away > CONE_MM {
                        continue;
                    }
                    // The neighbouring rays share the seed's voxel.
                    let own = k == k0 && aside <= 1;
                    let slack = if own { 0.0 } else { CONE * away };
                    let limit = r - shell.at(k, p);
                    let margin = MARGIN_MM.min(limit.abs());
                    let limit =
                        if seed.wall { limit + margin - slack } else { limit - margin + slack };
                    f(seed, k * RAYS + p, (limit, own));
                }
            }
        }
    }

    pub(crate) fn add_hard(&self, costs: &mut Costs, rays: &Rays, shell: &Sheet, slice_mm: f32) {
        let levels = costs.levels;
        self.each_limit(rays, shell, slice_mm, |seed, n, (limit, _)| {
            for (level, cost) in costs.values[n * levels..(n + 1) * levels].iter_mut().enumerate() {
                let h = height(level);
                let violation = if seed.wall { limit - h } else { h - limit };
                *cost += HARD * violation.max(0.0);
            }
        });
    }

    /// Holds the finished surface to the seeds.
    pub(crate) fn clamp(&self, surface: &mut Sheet, rays: &Rays, shell: &Sheet, slice_mm: f32) {
        // The cone of one seed must not overrule another seed's own rays: those come last.
        for own in [false, true] {
            self.each_limit(rays, shell, slice_mm, |seed, n, (limit, is_own)| {
                if is_own == own {
                    let h = &mut surface.values[n];
                    *h = if seed.wall { h.max(limit) } else { h.min(limit) };
                }
            });
        }
    }

    /// The expected thickness as the seeds move it: (height, extra cost per mm) per ray; the extra
    /// cost is 0 where no seed contradicts the expectation.
    pub(crate) fn pull(
        &self,
        expected: &Sheet,
        rays: &Rays,
        shell: &Sheet,
        slice_mm: f32,
    ) -> Vec<(f32, f32)> {
        let mut out: Vec<(f32, f32)> = expected.values.iter().map(|&h| (h, 0.0)).collect();
        for seed in &self.seeds {
            let (k0, p0, r) = seed.cell(rays, seed.row(shell));
            let goal = r - shell.at(k0, p0);
            let goal = if seed.wall { goal + MARGIN_MM } else { goal - MARGIN_MM };
            for (n, (h, extra)) in out.iter_mut().enumerate() {
                let (k, p) = (n / RAYS, n % RAYS);
                let turn = p.abs_diff(p0).min(RAYS - p.abs_diff(p0));
                let along = turn as f32 * r * std::f32::consts::TAU / RAYS as f32;
                let across = k.abs_diff(k0) as f32 * slice_mm;
                let weight = (-0.5 * (along * along + across * across) / PULL_MM.powi(2)).exp();
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

impl Seed {
    /// Nearest slice.
    fn row(&self, shell: &Sheet) -> usize {
        (self.slice.round().max(0.0) as usize).min(shell.slices() - 1)
    }

    /// Slice, nearest ray and radius (mm).
    fn cell(&self, rays: &Rays, k: usize) -> (usize, usize, f32) {
        let (r, turn) = rays.polar(k, self.position);
        (k, turn.round() as usize % RAYS, r)
    }
}

/// Gives the voxels of the seeds their labels: no interpolation overrules a seed.
pub(crate) fn stamp(labels: &mut LabelMap, seeds: &Seeds) {
    let lists = [
        (label::CHEST_WALL, &seeds.chest_wall),
        (label::SOFT_TISSUE, &seeds.soft_tissue),
        (label::OUTSIDE, &seeds.exclude),
    ];
    for (value, points) in lists {
        for p in points {
            if let Some(voxel) = labels.grid().voxel_at(p) {
                let n = labels.grid().offset(voxel);
                labels.data_mut()[n] = value;
            }
        }
    }
}

//! What the seeds ask of the surface of the chest wall: hard at their own rays, fading around them.

use super::marks::{Mark, contradiction};
use super::pull::{Free, Limit, SeedLimit, limits};
use super::refusal::refused;
use crate::Error;
use crate::band::LOWEST_MM;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use supine_volume::SeedKind;

/// Cost per mm of violation (docs/SEGMENTATION.md, Seeds).
const HARD: f32 = 1000.0;
/// The constraint fades as a cone of this slope, out to this distance (the same).
const CONE: f32 = 0.5;
const CONE_MM: f32 = 6.5;
// What follows was chosen, not measured.
/// The surface keeps this distance to a point, and half a pixel to the centre of a painted voxel.
const MARGIN_MM: f32 = 1.0;
/// Seeds this near along the surface must be told apart by a surface of no more than this slope.
const SAME_PLACE_MM: f32 = 4.0;
const STEEPEST: f32 = 1.5;

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

    /// How far a surface at height h may still move to either side, mm; infinite where a side is
    /// free.
    pub(crate) fn room(self, h: f32) -> f32 {
        (h - self.lower).max(self.upper - h)
    }

    pub(crate) fn clamp(self, h: f32) -> f32 {
        h.max(self.lower).min(self.upper)
    }

    /// What lies within both; where they exclude each other, `self` stands.
    fn within(self, other: Self) -> Self {
        Self {
            lower: self.lower.max(other.lower.min(self.upper)),
            upper: self.upper.min(other.upper.max(self.lower)),
        }
        .ordered()
    }

    /// Half-way where the lower end lies above the upper one.
    fn ordered(self) -> Self {
        if self.lower <= self.upper {
            return self;
        }
        let middle = 0.5 * (self.lower + self.upper);
        Self { lower: middle, upper: middle }
    }
}

/// A seed on the rays.
#[derive(Clone, Copy, Debug)]
struct Place {
    mark: usize,
    /// Slice and angle, in rays.
    k: usize,
    turn: f32,
    /// Radius and distance that the surface keeps, mm.
    r: f32,
    margin: f32,
}

/// The outermost chest wall and the innermost soft tissue on a ray.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    wall: Option<Place>,
    soft: Option<Place>,
}

impl Cell {
    fn hold(&mut self, wall: bool, place: Place) {
        if wall {
            if self.wall.is_none_or(|w| w.r < place.r) {
                self.wall = Some(place);
            }
        } else if self.soft.is_none_or(|s| s.r > place.r) {
            self.soft = Some(place);
        }
    }

    fn bound(&self, shell: f32) -> Bound {
        Bound {
            lower: self.wall.map_or(f32::NEG_INFINITY, |w| w.r + w.margin - shell),
            upper: self.soft.map_or(f32::INFINITY, |s| s.r - s.margin - shell),
        }
        .ordered()
    }
}

/// What all seeds of chest wall and soft tissue ask.
#[derive(Debug)]
pub(crate) struct Constraints {
    /// Per (slice, ray), ray fastest.
    bounds: Vec<Bound>,
    /// The bounds of the seeds' own rays, by place in `bounds`.
    own: Vec<(usize, Bound)>,
    highest_mm: f32,
}

impl Constraints {
    /// Reduces the seeds to two bounds per ray, whatever their number.
    ///
    /// # Errors
    /// When a soft-tissue seed lies at the axis of the chest, or chest wall lies farther out than
    /// soft tissue of the same place.
    pub(crate) fn new(scan: Scan<'_>, marks: &[Mark], shell: &RadialMap) -> Result<Self, Error> {
        let slice_mm = scan.frame.spacing[2];
        let mut cells = vec![Cell::default(); shell.values.len()];
        let mut highest_mm = 0.0f32;
        for (n, mark) in marks.iter().enumerate().filter(|(_, m)| m.kind != SeedKind::Exclude) {
            let place = place(scan, n, mark);
            let wall = mark.kind == SeedKind::ChestWall;
            let (k, p) = (place.k, place.turn as usize % RAYS);
            let h = place.r - shell.at(k, p);
            if !wall && h < LOWEST_MM + MARGIN_MM {
                let why = format!("lies {:.0} mm from the axis of the chest", place.r);
                return Err(refused(mark.kind, mark.point, why));
            }
            if wall {
                highest_mm = highest_mm.max(h);
            }
            // The label of a voxel is decided by the two rays beside it.
            for p in [p, (p + 1) % RAYS] {
                cells[k * RAYS + p].hold(wall, place);
            }
        }
        check_pairs(&cells, marks, slice_mm)?;
        let own: Vec<Bound> = cells.iter().zip(&shell.values).map(|(c, &r)| c.bound(r)).collect();
        let bounds = faded(&own, shell, slice_mm);
        let own = own.into_iter().enumerate().filter(|(_, b)| *b != Bound::FREE).collect();
        Ok(Self { bounds, own, highest_mm })
    }

    /// Whether the surface is free everywhere.
    pub(crate) fn bind_nothing(&self) -> bool {
        self.own.is_empty()
    }

    /// The greatest height of a chest-wall seed above the shell, mm.
    pub(crate) fn highest_mm(&self) -> f32 {
        self.highest_mm
    }

    /// What the seeds ask of a (slice, ray).
    #[inline]
    pub(crate) fn bound(&self, n: usize) -> Bound {
        self.bounds[n]
    }

    /// The limits that the seeds set to the surface around them: (lower, upper) per ray.
    pub(crate) fn limits(
        &self,
        free: &Free<'_>,
        shell: &RadialMap,
        slice_mm: f32,
    ) -> Vec<[Limit; 2]> {
        let mut seed_limits = Vec::new();
        for &(n, bound) in &self.own {
            for (sign, limit) in [(-1.0, bound.lower), (1.0, bound.upper)] {
                if limit.is_finite() {
                    seed_limits.push(SeedLimit::new(n, shell.values[n], sign, limit, free));
                }
            }
        }
        limits(&seed_limits, free.surface, slice_mm)
    }
}

fn place(scan: Scan<'_>, n: usize, mark: &Mark) -> Place {
    let (frame, grid) = (scan.frame, scan.ct.grid());
    let [i, j, k] = grid.index_from_patient(&mark.point).map(|x| x as f32);
    let k = (k.round().max(0.0) as usize).min(frame.size[2] - 1);
    let (r, turn) = scan.rays.polar(k, [i * frame.spacing[0], j * frame.spacing[1]]);
    let margin = if mark.painted { 0.5 * frame.pixel() } else { MARGIN_MM };
    Place { mark: n, k, turn, r, margin }
}

/// Length of a turn by one ray, mm.
fn arc(r: f32) -> f32 {
    r.max(1.0) * std::f32::consts::TAU / RAYS as f32
}

/// Refuses seeds of one place of which the outer one is chest wall.
fn check_pairs(cells: &[Cell], marks: &[Mark], slice_mm: f32) -> Result<(), Error> {
    let slices = cells.len() / RAYS;
    let reach = (SAME_PLACE_MM / slice_mm) as usize;
    for (n, cell) in cells.iter().enumerate() {
        let Some(wall) = cell.wall else { continue };
        let turn = ((SAME_PLACE_MM / arc(wall.r)) as usize).min(RAYS / 8);
        let (k, p) = (n / RAYS, n % RAYS);
        for row in k.saturating_sub(reach)..(k + reach + 1).min(slices) {
            for step in 0..2 * turn + 1 {
                let Some(soft) = cells[row * RAYS + (p + RAYS + step - turn) % RAYS].soft else {
                    continue;
                };
                let aside = (wall.turn - soft.turn).abs();
                let aside = aside.min(RAYS as f32 - aside) * arc(soft.r);
                let away = aside.hypot(wall.k.abs_diff(soft.k) as f32 * slice_mm);
                if away < SAME_PLACE_MM && wall.r > soft.r + STEEPEST * away {
                    let why = "the chest wall would lie in front of the soft tissue";
                    return Err(contradiction(&marks[wall.mark], &marks[soft.mark], why));
                }
            }
        }
    }
    Ok(())
}

/// The bounds of the seeds' own rays, fading around them.
fn faded(own: &[Bound], shell: &RadialMap, slice_mm: f32) -> Vec<Bound> {
    let mut around = vec![Bound::FREE; own.len()];
    let slices = shell.slices();
    let reach = (CONE_MM / slice_mm) as usize;
    for (n, bound) in own.iter().enumerate().filter(|(_, b)| **b != Bound::FREE) {
        let (k0, p0, shell0) = (n / RAYS, n % RAYS, shell.values[n]);
        let arc = arc(shell0 + bound.clamp(0.0));
        let turn = ((CONE_MM / arc) as usize).min(RAYS / 8);
        for k in k0.saturating_sub(reach)..(k0 + reach + 1).min(slices) {
            for step in 0..2 * turn + 1 {
                let m = k * RAYS + (p0 + RAYS + step - turn) % RAYS;
                let away =
                    (step.abs_diff(turn) as f32 * arc).hypot(k.abs_diff(k0) as f32 * slice_mm);
                if away > CONE_MM {
                    continue;
                }
                let shift = shell0 - shell.values[m];
                let out = &mut around[m];
                out.lower = out.lower.max(bound.lower + shift - CONE * away);
                out.upper = out.upper.min(bound.upper + shift + CONE * away);
            }
        }
    }
    own.iter().zip(around).map(|(own, around)| own.within(around)).collect()
}

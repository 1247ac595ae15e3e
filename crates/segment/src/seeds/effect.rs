//! What seeds did to the chest wall.

use crate::frame::Frame;
use crate::levels::Levels;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use supine_space::{Point, Vector, Warning};
use supine_volume::{SeedKind, Seeds};

/// The wall is looked at this far around a seed, mm: beyond, other seeds or the fit itself move it.
const AROUND_MM: f32 = 40.0;
/// A wall that a seed moves by more than this is told, mm. Chosen: more than automatic walls are
/// off by on the synthetic patients.
const FAR_MM: f32 = 10.0;
/// A wall that moves outwards by more than this takes something in, mm.
const TAKES_IN_MM: f32 = 3.0;
/// Gland lies between fat and muscle, HU from each.
const FROM_FAT_HU: f32 = 60.0;
const FROM_MUSCLE_HU: f32 = 10.0;
/// Rays that took in gland before it is told.
const RAYS_OF_GLAND: usize = 20;
/// Step along a ray, mm.
const STEP_MM: f32 = 1.0;

/// The outer surface of the chest wall, radius in mm per ray, without the seeds and with them.
pub(crate) struct Walls<'a> {
    pub(crate) without: &'a RadialMap,
    pub(crate) with: &'a RadialMap,
}

/// What seeds did that a planner must see.
pub(crate) fn warnings(
    scan: Scan<'_>,
    levels: Levels,
    walls: &Walls<'_>,
    seeds: &Seeds,
) -> Vec<Warning> {
    let kinds = [SeedKind::ChestWall, SeedKind::SoftTissue];
    let of = |kind: SeedKind| {
        let points = seeds.points(kind);
        points.iter().filter_map(move |point| told(scan, levels, walls, kind, (point, points)))
    };
    kinds.into_iter().flat_map(of).collect()
}

/// A seed draws the wall to its own side: what went the other way, others did; and what lies nearer
/// to another seed of its kind, that one did.
fn told(
    scan: Scan<'_>,
    levels: Levels,
    walls: &Walls<'_>,
    kind: SeedKind,
    (point, all): (&Point, &[Point]),
) -> Option<Warning> {
    let (way, sign) = match kind {
        SeedKind::ChestWall => ("outwards", 1.0),
        _ => ("inwards", -1.0),
    };
    let rays = near(scan, walls.with, point);
    let along = |&(k, p): &(usize, usize)| sign * (walls.with.at(k, p) - walls.without.at(k, p));
    let own = |at: &(usize, usize)| {
        let place = on_wall(scan, walls.with, *at);
        let off = |seed: &Point| (in_mm(scan, seed) - place).norm_squared();
        all.iter().all(|other| off(point) <= off(other))
    };
    let moved: Vec<_> =
        rays.iter().filter(|at| along(at) > TAKES_IN_MM).filter(|at| own(at)).copied().collect();
    let before: Vec<_> = rays.iter().map(|at| on_wall(scan, walls.without, *at)).collect();
    let far = moved.iter().filter(|at| along(at) > FAR_MM);
    let far_mm = far.map(|at| apart(&before, on_wall(scan, walls.with, *at))).fold(0.0, f64::max);
    let gland = kind == SeedKind::ChestWall
        && moved.iter().filter(|at| took_gland(scan, levels, walls, **at)).count() >= RAYS_OF_GLAND;
    if far_mm <= f64::from(FAR_MM) && !gland {
        return None;
    }
    let most_mm = f64::from(moved.iter().map(along).fold(0.0, f32::max));
    let mm = if far_mm > 0.0 { far_mm } else { most_mm };
    let [x, y, z] = point.coords.into();
    let into = if gland { ", into tissue as dense as gland" } else { "" };
    let text = format!(
        "the {} seed at [{x:.1}, {y:.1}, {z:.1}] mm moves the chest wall {way} by up to {mm:.0} mm{into}: \
         look whether it lies where it should",
        kind.name()
    );
    Some(Warning::new("seed-moves-wall", text).at(point))
}

/// A place in the frame of the rays, mm.
fn in_mm(scan: Scan<'_>, point: &Point) -> Vector {
    let index = scan.ct.grid().index_from_patient(point);
    Vector::from_fn(|a, _| index[a] * f64::from(scan.frame.spacing[a]))
}

/// Where the wall cuts a ray, in that frame.
fn on_wall(scan: Scan<'_>, wall: &RadialMap, (k, p): (usize, usize)) -> Vector {
    let [x, y] = scan.rays.pixel(k, p, wall.at(k, p));
    let [dx, dy, dz] = scan.frame.spacing;
    Vector::new((x * dx).into(), (y * dy).into(), (k as f32 * dz).into())
}

/// How far a place lies from the nearest of others: along a ray that grazes the wall it would be
/// more.
fn apart(others: &[Vector], place: Vector) -> f64 {
    others.iter().map(|other| (other - place).norm_squared()).fold(f64::INFINITY, f64::min).sqrt()
}

/// The rays whose wall lies near a point.
fn near(scan: Scan<'_>, wall: &RadialMap, point: &Point) -> Vec<(usize, usize)> {
    let Frame { spacing, .. } = scan.frame;
    let [i, j, k] = scan.ct.grid().index_from_patient(point).map(|x| x as f32);
    let at = [i * spacing[0], j * spacing[1]];
    let slices = (AROUND_MM / spacing[2]).ceil() as usize;
    let middle = (k.round().max(0.0) as usize).min(wall.slices() - 1);
    let within = middle.saturating_sub(slices)..(middle + slices + 1).min(wall.slices());
    let close = |&(k, p): &(usize, usize)| {
        let [x, y] = scan.rays.pixel(k, p, wall.at(k, p));
        let [x, y] = [x * spacing[0], y * spacing[1]];
        let z = (k as f32 - middle as f32) * spacing[2];
        (x - at[0]).powi(2) + (y - at[1]).powi(2) + z * z < AROUND_MM * AROUND_MM
    };
    within.flat_map(|k| (0..RAYS).map(move |p| (k, p))).filter(close).collect()
}

/// Whether what the wall took in along a ray is as dense as gland in the mean.
fn took_gland(scan: Scan<'_>, levels: Levels, walls: &Walls<'_>, (k, p): (usize, usize)) -> bool {
    let (from, to) = (walls.without.at(k, p), walls.with.at(k, p));
    let steps = ((to - from) / STEP_MM) as usize;
    let size = scan.frame.size;
    let (mut sum, mut count) = (0.0, 0.0);
    for step in 0..steps {
        let at = scan.rays.pixel(k, p, from + (step as f32 + 0.5) * STEP_MM);
        let at = at.map(|c| c.round().max(0.0) as usize);
        if at[0] < size[0] && at[1] < size[1] {
            sum += f32::from(scan.ct.at([at[0], at[1], k]));
            count += 1.0;
        }
    }
    let mean = sum / f32::max(count, 1.0);
    count > 0.0 && mean > levels.fat + FROM_FAT_HU && mean < levels.muscle - FROM_MUSCLE_HU
}

//! What seeds did to the chest wall.

use crate::frame::Frame;
use crate::levels::Levels;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use supine_space::{Point, Warning};
use supine_volume::{SeedKind, Seeds};

/// The wall is looked at this far around a seed, mm: beyond, other seeds or the fit itself move it.
const AROUND_MM: f32 = 40.0;
/// A wall that a seed moves by more than this is told, mm. Chosen: more than automatic walls are off by on the synthetic
/// patients.
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
    let kinds = [(SeedKind::ChestWall, "chest-wall"), (SeedKind::SoftTissue, "soft-tissue")];
    let all =
        kinds.iter().flat_map(|(kind, name)| seeds.points(*kind).iter().map(move |p| (*name, p)));
    all.filter_map(|(name, point)| told(scan, levels, walls, name, point)).collect()
}

fn told(
    scan: Scan<'_>,
    levels: Levels,
    walls: &Walls<'_>,
    name: &str,
    point: &Point,
) -> Option<Warning> {
    let rays = near(scan, walls.with, point);
    let moved = |&(k, p): &(usize, usize)| walls.with.at(k, p) - walls.without.at(k, p);
    let farthest = rays.iter().map(moved).max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let gland =
        rays.iter().filter(|at| moved(at) > TAKES_IN_MM && took_gland(scan, levels, walls, **at));
    let gland = gland.count() >= RAYS_OF_GLAND;
    if farthest.abs() <= FAR_MM && !gland {
        return None;
    }
    let [x, y, z] = point.coords.into();
    let way = if farthest > 0.0 { "outwards" } else { "inwards" };
    let into = if gland { ", into tissue as dense as gland" } else { "" };
    let text = format!(
        "the {name} seed at [{x:.1}, {y:.1}, {z:.1}] mm moves the chest wall {way} by up to {:.0} mm{into}: \
         look whether it lies where it should",
        farthest.abs()
    );
    Some(Warning::new("seed-moves-wall", text))
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

//! Seeds that the rib shell contradicts: the shell was found wrong there, and is bent to them.

use super::marks::Mark;
use super::refusal::refused;
use crate::Error;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use supine_volume::SeedKind;

// Chosen, not measured: with these one seed mends a shell that was drawn 14 mm into fat
// (docs/VERIFICATION.md, "Segmentation").
/// Soft tissue this far inside the shell contradicts it, mm; the shell is then drawn to so far
/// inside the seed, mm: room for a chest wall of usual thickness.
const INSIDE_MM: f32 = 2.0;
const ROOM_MM: f32 = 6.0;
/// Chest wall this far outside the shell contradicts it, mm; the shell is then drawn to half of
/// that.
const OUTSIDE_MM: f32 = 90.0;
/// Around the seed the shell returns to its own place with this slope.
const SLOPE: f32 = 0.4;
/// The shell keeps this distance to the axis, mm.
const LEAST_MM: f32 = 10.0;

/// Lung stays this far inside the shell, mm. Measured on four real CTs: no chest wall is thinner.
const OVER_LUNG_MM: f32 = 3.0;

/// The shell bent to the seeds; `None` where none contradicts it.
///
/// # Errors
/// When lung lies outside a soft-tissue seed.
pub(crate) fn bent(
    scan: Scan<'_>,
    marks: &[Mark],
    shell: &RadialMap,
) -> Result<Option<RadialMap>, Error> {
    let (frame, rays) = (scan.frame, scan.rays);
    let mut out: Option<RadialMap> = None;
    for mark in marks {
        let k = mark.voxel / frame.plane();
        let (r, turn) = rays.polar(k, frame.position(mark.voxel % frame.plane()));
        let ray = (k, turn.round() as usize % RAYS);
        let above = r - shell.at(ray.0, ray.1);
        let goal = match mark.kind {
            SeedKind::SoftTissue if above < -INSIDE_MM => {
                if scan.outermost_lung(ray, [r, r - above]).is_some() {
                    let why = "lies inside the chest: there is lung in front of it";
                    return Err(refused(mark.kind, mark.point, why.into()));
                }
                r - ROOM_MM
            }
            SeedKind::ChestWall if above > OUTSIDE_MM => r - 0.5 * OUTSIDE_MM,
            _ => continue,
        };
        draw(out.get_or_insert_with(|| shell.clone()), ray, goal, frame.spacing[2]);
    }
    let Some(mut out) = out else { return Ok(None) };
    for (n, r) in out.values.iter_mut().enumerate().filter(|(n, r)| **r < shell.values[*n]) {
        let lung = scan.outermost_lung((n / RAYS, n % RAYS), [*r, shell.values[n]]);
        *r = r.max(lung.map_or(LEAST_MM, |lung| lung + OVER_LUNG_MM));
    }
    Ok(Some(out))
}

/// Draws a surface to a radius on one ray, and towards it around.
fn draw(surface: &mut RadialMap, (k0, p0): (usize, usize), goal: f32, slice_mm: f32) {
    let change = goal - surface.at(k0, p0);
    let reach_mm = change.abs() / SLOPE;
    let arc = goal.max(LEAST_MM) * std::f32::consts::TAU / RAYS as f32;
    let (slices, turn) =
        ((reach_mm / slice_mm) as usize, ((reach_mm / arc) as usize).min(RAYS / 2 - 1));
    for k in k0.saturating_sub(slices)..(k0 + slices + 1).min(surface.slices()) {
        for step in 0..2 * turn + 1 {
            let n = k * RAYS + (p0 + RAYS + step - turn) % RAYS;
            let away = (step.abs_diff(turn) as f32 * arc).hypot(k.abs_diff(k0) as f32 * slice_mm);
            let near = goal - change.signum() * SLOPE * away;
            let r = &mut surface.values[n];
            *r = if change < 0.0 { r.min(near) } else { r.max(near) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shell_is_drawn_to_its_goal_and_returns_around() {
        for goal in [70.0, 130.0] {
            let mut shell = RadialMap::new(41, 100.0);
            draw(&mut shell, (20, 359), goal, 5.0);
            assert_eq!(shell.at(20, 359), goal);
            assert!((shell.at(22, 359) - 100.0).abs() < 27.0, "{}", shell.at(22, 359));
            assert_eq!((shell.at(20, 180), shell.at(40, 359)), (100.0, 100.0));
        }
    }
}

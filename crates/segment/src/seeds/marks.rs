//! The voxels of the seeds, and whether they can be meant.

use super::brush::brushed;
use super::refusal::{SKIN_MM, refused};
use super::resample::on_grid;
use crate::Error;
use crate::body::flag;
use crate::scan::Scan;
use supine_space::{Grid, Point};
use supine_volume::{SeedKind, Seeds};

// Chosen, not measured.
/// A soft-tissue seed may lie this far outside the body found, mm.
pub(super) const NEAR_SKIN_MM: f32 = 4.0;

/// A voxel of the CT whose tissue the user told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mark {
    pub(super) kind: SeedKind,
    /// Offset of the voxel in memory.
    pub(super) voxel: usize,
    /// The point itself, or the centre of the painted voxel; LPS, mm.
    pub(super) point: Point,
    /// Painted, by a map or a stroke; or a point.
    pub(super) painted: bool,
}

/// That no seed that is a point lies outside a CT: what can be told of them before the CT is
/// segmented.
///
/// # Errors
/// [`Error::Seed`] of the first that does.
pub fn check_seeds_lie_in(grid: &Grid, seeds: &Seeds) -> Result<(), Error> {
    points_in(grid, seeds).map(drop)
}

/// Seeds that are points, with their voxels.
fn points_in(grid: &Grid, seeds: &Seeds) -> Result<Vec<(SeedKind, Point, [usize; 3])>, Error> {
    let kinds = [SeedKind::ChestWall, SeedKind::SoftTissue, SeedKind::Exclude];
    let all =
        kinds.iter().flat_map(|&kind| seeds.points(kind).iter().map(move |point| (kind, *point)));
    let placed = |(kind, point): (SeedKind, Point)| match grid.voxel_at(&point) {
        Some(at) => Ok((kind, point, at)),
        None => Err(refused(kind, point, "lies outside the CT".into())),
    };
    all.map(placed).collect()
}

/// All seeds as voxels of the CT, in order of memory.
///
/// # Errors
/// When a point lies outside the CT, none of a painted map lies within it, a stroke covers nothing
/// of the patient, two kinds claim one voxel, a seed lies outside the body (of soft tissue: well
/// outside), or a chest-wall seed lies in the skin.
pub(crate) fn marks(scan: Scan<'_>, seeds: &Seeds) -> Result<Vec<Mark>, Error> {
    let grid = scan.ct.grid();
    let mut marks = Vec::new();
    for (kind, point, at) in points_in(grid, seeds)? {
        marks.push(Mark { kind, voxel: grid.offset(at), point, painted: false });
    }
    for map in &seeds.painted {
        let before = marks.len();
        marks.extend(on_grid(grid, map).into_iter().map(|(voxel, kind)| {
            let point = grid.centre(grid.voxel(voxel));
            Mark { kind, voxel, point, painted: true }
        }));
        if marks.len() == before {
            return Err(Error::SeedsElsewhere);
        }
    }
    marks.extend(brushed(scan, &seeds.strokes)?.into_iter().map(|(voxel, kind)| {
        let point = grid.centre(grid.voxel(voxel));
        Mark { kind, voxel, point, painted: true }
    }));
    marks.sort_by_key(|m| (m.voxel, m.kind));
    for pair in marks.windows(2) {
        if pair[0].voxel == pair[1].voxel && pair[0].kind != pair[1].kind {
            return Err(contradiction(&pair[0], &pair[1], "they lie in one voxel"));
        }
    }
    for mark in marks.iter().filter(|m| m.kind != SeedKind::Exclude) {
        check(scan, mark)?;
    }
    Ok(marks)
}

fn check(scan: Scan<'_>, mark: &Mark) -> Result<(), Error> {
    let is_body = |n: usize| scan.body.flags[n] & flag::BODY != 0;
    let wall = mark.kind == SeedKind::ChestWall;
    if is_body(mark.voxel) {
        let depth = scan.body.depth_mm(mark.voxel);
        if wall && depth < SKIN_MM {
            let why = format!("lies in the skin, {depth:.1} mm deep");
            return Err(refused(mark.kind, mark.point, why));
        }
        return Ok(());
    }
    let mut near = false;
    if !wall {
        ball(scan, mark.voxel, NEAR_SKIN_MM, |n| near |= is_body(n));
    }
    if near { Ok(()) } else { Err(refused(mark.kind, mark.point, "lies outside the body".into())) }
}

pub(super) fn contradiction(first: &Mark, second: &Mark, why: &'static str) -> Error {
    Error::SeedsContradict {
        first_kind: first.kind.name(),
        first: first.point.coords.into(),
        second_kind: second.kind.name(),
        second: second.point.coords.into(),
        why,
    }
}

/// Calls `f` with the offset of each voxel within `radius` (mm) of a voxel.
pub(super) fn ball(scan: Scan<'_>, voxel: usize, radius: f32, mut f: impl FnMut(usize)) {
    let (grid, frame) = (scan.ct.grid(), scan.frame);
    let at = grid.voxel(voxel);
    let reach = [0, 1, 2].map(|a| (radius / frame.spacing[a]) as usize);
    let low = [0, 1, 2].map(|a| at[a].saturating_sub(reach[a]));
    let high = [0, 1, 2].map(|a| (at[a] + reach[a]).min(frame.size[a] - 1));
    for k in low[2]..=high[2] {
        for j in low[1]..=high[1] {
            for i in low[0]..=high[0] {
                let v = [i, j, k];
                let off = [0, 1, 2].map(|a| v[a].abs_diff(at[a]) as f32 * frame.spacing[a]);
                if off.iter().map(|x| x * x).sum::<f32>() <= radius * radius {
                    f(grid.offset(v));
                }
            }
        }
    }
}

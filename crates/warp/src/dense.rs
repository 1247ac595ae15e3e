//! Small dense things in the tissue, clips and wires, as they are: what is stiff does not deform,
//! and interpolation would blur what a planner looks for.
//!
//! Each is moved by the displacement of its middle in whole voxels, so that every value of it stays
//! as it was scanned; its place is then known to half a voxel.

use crate::{Error, Params, carry_points};
use std::collections::BTreeSet;
use supine_mesh::Deformation;
use supine_record::{DenseFate, DenseThing};
use supine_space::{Grid, Point, Vector};
use supine_volume::{Ct, LabelMap, label};

/// From here on a voxel is no soft tissue, HU.
const DENSE_HU: i16 = 300;
/// What never comes so high is contrast agent or a faint calcification, HU.
const PEAK_HU: i16 = 1000;
/// What is larger is no clip, mm³; it deforms with the tissue.
const LARGEST_MM3: f64 = 2000.0;
/// What lies farther from the mesh is not looked at, mm: the table of the scanner has metal too.
const NEAR_MM: f64 = 20.0;
/// Around what was drawn of it, voxels above this are its blurred rim, HU.
const RIM_HU: i16 = 200;
/// How far that rim is looked for, voxels.
const RIM: usize = 3;

/// Finds dense things in and near the mesh, outside the chest wall, and puts the small ones into
/// `out`, the CT after deformation on the CT's grid, as they were scanned. In the order of their
/// first voxels.
///
/// # Errors
/// When a parameter is out of range.
pub fn keep_dense(
    ct: &Ct,
    labels: &LabelMap,
    out: &mut Ct,
    deformation: &Deformation,
    params: &Params,
) -> Result<Vec<DenseThing>, Error> {
    let grid = ct.grid().clone();
    let clusters = things(ct, labels);
    let middles: Vec<Point> = clusters.iter().map(|voxels| middle(&grid, voxels)).collect();
    let carried = carry_points(deformation, params, &middles)?;
    let mut things = Vec::new();
    let mut moved = Vec::new();
    let near = near(deformation);
    for ((voxels, centre), carried) in clusters.iter().zip(middles).zip(carried) {
        let after = carried;
        let volume_mm3 = voxels.len() as f64 * grid.voxel_volume();
        let outside = voxels.iter().filter(|n| labels.data()[**n] == label::OUTSIDE).count() * 2
            > voxels.len();
        let shift = after.map_or([0; 3], |after| steps(&grid, after - centre));
        let fate = match after {
            None if !near(&centre) => continue,
            _ if outside => DenseFate::OutsideBody,
            Some(_) if volume_mm3 > LARGEST_MM3 => DenseFate::Deformed,
            // Also what moves by less than half a voxel: it would be blurred.
            Some(_) => DenseFate::Whole,
            None => DenseFate::Still,
        };
        let (shift, after) = match fate {
            DenseFate::OutsideBody => ([0; 3], centre),
            _ => (shift, after.unwrap_or(centre)),
        };
        if matches!(fate, DenseFate::Whole | DenseFate::OutsideBody) {
            // What the warp drew of it lies where its middle went.
            let drawn = carried.map_or([0; 3], |after| steps(&grid, after - centre));
            moved.push((voxels, drawn, shift));
        }
        let peak_hu = voxels.iter().map(|n| ct.data()[*n]).max().unwrap_or(DENSE_HU);
        things.push(DenseThing {
            before_mm: centre.into(),
            after_mm: after.into(),
            voxels: voxels.len(),
            volume_mm3,
            peak_hu,
            fate,
        });
    }
    // All that was blurred goes before anything is put back: two clips may lie side by side.
    for (voxels, drawn, _) in &moved {
        wipe(out, labels, &shifted(&grid, voxels, *drawn));
    }
    for (voxels, _, shift) in &moved {
        put_back(ct, out, voxels, *shift);
    }
    Ok(things)
}

/// Whether a place lies near the mesh: in the box around it, or as near as a wire on the skin.
fn near(deformation: &Deformation) -> impl Fn(&Point) -> bool {
    let points = || deformation.mesh().points().iter();
    let low = [0, 1, 2].map(|a| points().map(|p| p[a]).fold(f64::INFINITY, f64::min) - NEAR_MM);
    let high =
        [0, 1, 2].map(|a| points().map(|p| p[a]).fold(f64::NEG_INFINITY, f64::max) + NEAR_MM);
    move |p| (0..3).all(|a| (low[a]..=high[a]).contains(&p[a]))
}

/// Dense voxels that touch each other, one list a thing, by their first voxel.
fn things(ct: &Ct, labels: &LabelMap) -> Vec<Vec<usize>> {
    let grid = ct.grid();
    let soft = |n: usize| {
        !matches!(labels.data()[n], label::CHEST_WALL | label::LUNG | label::BONE | label::MUSCLE)
    };
    let dense = |n: usize| ct.data()[n] >= DENSE_HU && soft(n);
    let mut seen = BTreeSet::new();
    let mut things = Vec::new();
    for start in (0..grid.len()).filter(|n| ct.data()[*n] >= PEAK_HU && soft(*n)) {
        if seen.insert(start) {
            let thing = flood(grid, &[start], dense, |_| true);
            seen.extend(thing.iter().copied());
            things.push(thing);
        }
    }
    things
}

/// The voxels that hang together with some, by faces, edges or corners; ascending.
fn flood(
    grid: &Grid,
    from: &[usize],
    belongs: impl Fn(usize) -> bool,
    within: impl Fn([usize; 3]) -> bool,
) -> Vec<usize> {
    let mut all: BTreeSet<usize> = from.iter().copied().filter(|n| belongs(*n)).collect();
    let mut open: Vec<usize> = all.iter().copied().collect();
    while let Some(n) = open.pop() {
        for (beside, at) in around(grid, n, 1) {
            if within(at) && belongs(beside) && all.insert(beside) {
                open.push(beside);
            }
        }
    }
    all.into_iter().collect()
}

/// The voxels up to so many steps away along each axis.
fn around(grid: &Grid, n: usize, reach: usize) -> impl Iterator<Item = (usize, [usize; 3])> {
    let (at, size) = (grid.voxel(n), grid.size());
    let low = at.map(|x| x.saturating_sub(reach));
    let high = [0, 1, 2].map(|a| (at[a] + reach).min(size[a] - 1));
    (low[2]..=high[2]).flat_map(move |k| {
        (low[1]..=high[1]).flat_map(move |j| {
            (low[0]..=high[0]).map(move |i| ((k * size[1] + j) * size[0] + i, [i, j, k]))
        })
    })
}

fn middle(grid: &Grid, voxels: &[usize]) -> Point {
    let sum: Vector = voxels.iter().map(|n| grid.centre(grid.voxel(*n)).coords).sum();
    Point::from(sum / voxels.len().max(1) as f64)
}

/// A way in whole voxels.
fn steps(grid: &Grid, way: Vector) -> [isize; 3] {
    let along = grid.direction().transpose() * way;
    [0, 1, 2].map(|a| (along[a] / grid.spacing()[a]).round() as isize)
}

fn step(grid: &Grid, n: usize, shift: [isize; 3]) -> Option<usize> {
    let (at, size) = (grid.voxel(n), grid.size());
    let mut to = [0; 3];
    for a in 0..3 {
        to[a] = at[a].checked_add_signed(shift[a]).filter(|x| *x < size[a])?;
    }
    Some((to[2] * size[1] + to[1]) * size[0] + to[0])
}

fn shifted(grid: &Grid, voxels: &[usize], shift: [isize; 3]) -> Vec<usize> {
    voxels.iter().filter_map(|n| step(grid, *n, shift)).collect()
}

/// Takes what the warp drew of a thing away: what is around it, by its median, in its place.
fn wipe(out: &mut Ct, labels: &LabelMap, place: &[usize]) {
    let grid = out.grid().clone();
    let box_of: BTreeSet<usize> =
        place.iter().flat_map(|n| around(&grid, *n, RIM)).map(|(n, _)| n).collect();
    let wall = |n: usize| matches!(labels.data()[n], label::CHEST_WALL | label::LUNG | label::BONE);
    let bright = |n: usize| out.data()[n] > RIM_HU && box_of.contains(&n) && !wall(n);
    let near: Vec<usize> =
        place.iter().flat_map(|n| around(&grid, *n, 1)).map(|(n, _)| n).collect();
    let drawn = flood(&grid, &near, bright, |_| true);
    let mut tissue: Vec<i16> = box_of.iter().map(|n| out.data()[*n]).collect();
    tissue.retain(|hu| *hu <= RIM_HU);
    tissue.sort_unstable();
    let Some(median) = tissue.get(tissue.len() / 2).copied() else { return };
    drawn.into_iter().for_each(|n| out.data_mut()[n] = median);
}

/// Puts a thing and the voxels beside it, which hold part of it, where it belongs.
fn put_back(ct: &Ct, out: &mut Ct, voxels: &[usize], shift: [isize; 3]) {
    let grid = ct.grid();
    let with_rim: BTreeSet<usize> =
        voxels.iter().flat_map(|n| around(grid, *n, 1)).map(|(n, _)| n).collect();
    for n in with_rim {
        if let Some(to) = step(grid, n, shift) {
            out.data_mut()[to] = ct.data()[n];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture::{lattice, moved};
    use crate::warp;
    use supine_mesh::{BoundaryTag, Order};
    use supine_space::{Matrix, Progress};
    use supine_volume::Volume;

    /// Fat of 60 mm with a clip of 3 x 2 x 4 voxels, and one like it outside the body.
    fn scene() -> (Ct, LabelMap, Deformation) {
        let grid =
            Grid::new([60, 60, 60], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let grid = grid.unwrap();
        let inside = |at: [usize; 3]| at.iter().all(|x| (10..50).contains(x));
        let clip = |[i, j, k]: [usize; 3], at: usize| {
            (at..at + 3).contains(&i) && (at..at + 2).contains(&j) && (at..at + 4).contains(&k)
        };
        let ct = Volume::from_fn(grid.clone(), |at| match at {
            at if clip(at, 30) || clip(at, 3) => 2500,
            at if inside(at) => -100,
            _ => -1000,
        });
        let labels = Volume::from_fn(grid, |at| u8::from(inside(at)) * label::SOFT_TISSUE);
        let mesh = lattice([4, 4, 4], 10.0, Point::new(10.0, 10.0, 10.0), |_| BoundaryTag::Skin);
        // A shift that grows along x, by no whole number of voxels.
        let deformation =
            moved(&mesh, Order::Linear, |p| Vector::new(2.6 + 0.05 * (p.x - 30.0), 1.4, 0.0));
        (ct, labels, deformation)
    }

    #[test]
    fn a_clip_moves_whole_and_one_on_the_skin_stays() {
        let (ct, labels, deformation) = scene();
        let params = Params { fade_mm: Some(0.0), ..Params::default() };
        let (mut out, _) = warp(&ct, &deformation, &params, Progress::none()).unwrap();
        let dense = |ct: &Ct| ct.data().iter().filter(|hu| **hu >= DENSE_HU).count();
        let blurred = out.data().iter().filter(|hu| **hu == 2500).count();
        assert!(blurred < 48, "the warp alone blurs it: {blurred} voxels");
        let found = keep_dense(&ct, &labels, &mut out, &deformation, &params).unwrap();
        let fates: Vec<DenseFate> = found.iter().map(|thing| thing.fate).collect();
        assert_eq!(fates, [DenseFate::OutsideBody, DenseFate::Whole]);
        assert_eq!((dense(&out), dense(&ct)), (48, 48));
        assert_eq!(out.at([33, 31, 30]), 2500, "three voxels along x, one along y");
        assert_eq!((out.at([32, 31, 30]), out.at([30, 30, 30])), (-100, -100));
        let [before, after] = [found[1].before_mm, found[1].after_mm].map(Point::from);
        assert!((after - before - Vector::new(2.65, 1.4, 0.0)).norm() < 1e-6);
        assert_eq!((found[1].voxels, found[1].peak_hu), (24, 2500));
    }

    #[test]
    fn what_is_large_deforms() {
        let (mut ct, labels, deformation) = scene();
        for at in 0..16 * 16 * 16 {
            let [i, j, k] = [at % 16, at / 16 % 16, at / 256].map(|x| 20 + x);
            ct.data_mut()[(k * 60 + j) * 60 + i] = 1500;
        }
        let params = Params { fade_mm: Some(0.0), ..Params::default() };
        let (mut out, _) = warp(&ct, &deformation, &params, Progress::none()).unwrap();
        let before = out.clone();
        let found = keep_dense(&ct, &labels, &mut out, &deformation, &params).unwrap();
        assert!(found.iter().any(|thing| thing.fate == DenseFate::Deformed));
        assert!(found.iter().all(|thing| thing.fate != DenseFate::Whole));
        assert!(out.data() == before.data());
    }
}

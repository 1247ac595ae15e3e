//! Slices in which a carried structure lies as it was drawn: there its contours are those that were
//! given.

use super::{Plane, SAME_PLANE_MM};
use rayon::prelude::*;
use std::collections::BTreeMap;
use supine_space::{Grid, Point, Vector};

/// Contours that enclose less are specks of the cut, mm²; but none that is as large as what was
/// drawn.
const SPECK_MM2: f64 = 2.0;
/// Contours that lie upon each other so far are the same, mm.
const SAME_MM: f64 = 1e-4;

/// Contours by the number of their slice.
type Slices = BTreeMap<usize, Vec<Vec<Point>>>;

/// The contours of the operating position, in the order of the slices: `cut` from the solid after,
/// and, in slices where that is what `before` was cut to from the solid as drawn, the contours
/// given there. A slice that lies still between drawn slices that lie still stays empty if nothing
/// was drawn in it.
pub(super) fn put_back(
    given: &[Vec<Point>],
    planes: &[Plane],
    [before, cut]: [Vec<Vec<Point>>; 2],
    grid: &Grid,
) -> Vec<Vec<Point>> {
    let drawn = by_slice(given, grid);
    let [before, cut] = [before, cut].map(|contours| by_slice(&contours, grid));
    let none = Vec::new();
    let still: Vec<bool> = (0..grid.size()[2])
        .into_par_iter()
        .map(|k| same(before.get(&k).unwrap_or(&none), cut.get(&k).unwrap_or(&none)))
        .collect();
    let kept = |k: usize| {
        let [below, above] = beside(planes, k, grid);
        [below, above]
            .into_iter()
            .flatten()
            .all(|k| drawn.contains_key(&k) && still.get(k) == Some(&true))
    };
    let overlapped = |k: usize| {
        let level = k as f64 * grid.spacing().z;
        let here = |plane: &&Plane| (plane.level - level).abs() <= SAME_PLANE_MM;
        planes.iter().filter(here).any(|plane| plane.outlines.overlap())
    };
    let speck = smallest(given).min(SPECK_MM2);
    let mut all = Vec::new();
    for k in 0..grid.size()[2] {
        match (still[k], drawn.get(&k)) {
            // Contours that lie upon each other are given back as what they hold together.
            (true, Some(contours)) if !overlapped(k) => all.extend(contours.iter().cloned()),
            (true, None) if kept(k) => {}
            _ => {
                let contours = cut.get(&k).into_iter().flatten();
                all.extend(contours.filter(|c| area(c) >= speck).cloned());
            }
        }
    }
    all
}

/// Contours by the slice in which they lie; those between slices are left out.
fn by_slice(contours: &[Vec<Point>], grid: &Grid) -> Slices {
    let step = grid.spacing().z;
    let mut slices = Slices::new();
    for contour in contours.iter().filter(|c| c.len() >= 3) {
        let level = grid.index_from_patient(&contour[0])[2];
        let k = level.round();
        if (level - k).abs() * step <= SAME_PLANE_MM && k >= 0.0 && k < grid.size()[2] as f64 {
            slices.entry(k as usize).or_default().push(contour.clone());
        }
    }
    slices
}

/// The slices next to a slice on which planes were drawn; where there is a plane but no slice, the
/// slice itself, which then was not drawn.
fn beside(planes: &[Plane], k: usize, grid: &Grid) -> [Option<usize>; 2] {
    let step = grid.spacing().z;
    let slice = |plane: &Plane| {
        let nearest = (plane.level / step).round();
        let on = (plane.level - nearest * step).abs() <= SAME_PLANE_MM && nearest >= 0.0;
        if on { nearest as usize } else { k }
    };
    let level = k as f64 * step;
    let below = planes.iter().rev().find(|plane| plane.level < level).map(slice);
    let above = planes.iter().find(|plane| plane.level > level).map(slice);
    [below, above]
}

/// Area of a contour, mm².
fn area(contour: &[Point]) -> f64 {
    let first = contour[0];
    let fan = contour.windows(2).map(|w| (w[0] - first).cross(&(w[1] - first)));
    0.5 * fan.sum::<Vector>().norm()
}

/// The smallest area that was drawn, mm².
fn smallest(given: &[Vec<Point>]) -> f64 {
    let drawn = given.iter().filter(|c| c.len() >= 3).map(|c| area(c));
    drawn.filter(|mm2| *mm2 > 0.0).fold(f64::INFINITY, f64::min)
}

/// Whether contours of one slice lie upon each other: each corner on a side of the others.
fn same(a: &[Vec<Point>], b: &[Vec<Point>]) -> bool {
    let on = |these: &[Vec<Point>], those: &[Vec<Point>]| {
        these.iter().flatten().all(|p| those.iter().any(|contour| lies_on(p, contour)))
    };
    on(a, b) && on(b, a)
}

fn lies_on(p: &Point, contour: &[Point]) -> bool {
    (0..contour.len()).any(|n| {
        let [a, b] = [contour[n], contour[(n + 1) % contour.len()]];
        let (along, to) = (b - a, p - a);
        let share =
            if along.norm_squared() > 0.0 { to.dot(&along) / along.norm_squared() } else { 0.0 };
        (to - along * share.clamp(0.0, 1.0)).norm() <= SAME_MM
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: f64) -> Vec<Point> {
        [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]]
            .map(|[x, y]| Point::new(x, y, 0.0))
            .into()
    }

    #[test]
    fn contours_upon_each_other_are_the_same_with_any_corners() {
        let mut finer = square(4.0);
        finer.insert(1, Point::new(2.0, 0.0, 0.0));
        assert!(same(&[square(4.0)], &[finer]));
        assert!(!same(&[square(4.0)], &[square(4.01)]));
        assert!(!same(&[square(4.0)], &[square(4.0), square(1.0)]));
        assert!(same(&[], &[]) && !same(&[], &[square(1.0)]));
        assert!((area(&square(3.0)) - 9.0).abs() < 1e-12);
    }
}

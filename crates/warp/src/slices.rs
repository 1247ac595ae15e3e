//! Closed surfaces cut by the slices of a grid.

use std::collections::BTreeMap;
use supine_mesh::TriSurface;
use supine_space::{Grid, Point};

/// Corners nearer to the last one are left out, mm.
const NEAR_MM: f64 = 0.05;
/// Contours that enclose less are left out, mm².
const MIN_MM2: f64 = 0.05;

/// The contours in which the slices of `grid` cut a closed surface, slice by slice; LPS, mm. What
/// lies within the surface lies within them by the even-odd rule where the surface does not cross
/// itself.
pub fn contours(surface: &TriSurface, grid: &Grid) -> Vec<Vec<Point>> {
    let index: Vec<[f64; 3]> =
        surface.points().iter().map(|p| grid.index_from_patient(p)).collect();
    // By slice, from the side on which a triangle goes up through it to that on which it comes
    // down; the triangle beside goes the other way there.
    let mut ways: BTreeMap<usize, BTreeMap<[u32; 2], Vec<[u32; 2]>>> = BTreeMap::new();
    for triangle in surface.triangles() {
        let k = triangle.map(|p| index[p as usize][2]);
        let low = k.into_iter().fold(f64::INFINITY, f64::min);
        let high = k.into_iter().fold(f64::NEG_INFINITY, f64::max);
        // A corner on the slice counts as above it.
        let first = (low.floor() + 1.0).max(0.0) as usize;
        for slice in first..grid.size()[2] {
            if slice as f64 > high {
                break;
            }
            let above = k.map(|k| k >= slice as f64);
            let side = |up: bool| {
                let edge = (0..3).find(|&c| above[c] != up && above[(c + 1) % 3] == up);
                edge.map(|c| {
                    let (p, q) = (triangle[c], triangle[(c + 1) % 3]);
                    [p.min(q), p.max(q)]
                })
            };
            if let (Some(up), Some(down)) = (side(true), side(false)) {
                ways.entry(slice).or_default().entry(up).or_default().push(down);
            }
        }
    }
    let mut contours = Vec::new();
    for (slice, mut ways) in ways {
        while let Some(start) = ways.keys().next().copied() {
            let mut contour = Vec::new();
            let mut side = start;
            while let Some(next) = take(&mut ways, side) {
                contour.push(crossing(&index, side, slice as f64));
                side = next;
            }
            contours.extend(cleaned(&contour, grid));
        }
    }
    contours
}

/// Takes a way that starts at a side.
fn take(ways: &mut BTreeMap<[u32; 2], Vec<[u32; 2]>>, side: [u32; 2]) -> Option<[u32; 2]> {
    let ends = ways.get_mut(&side)?;
    let end = ends.pop();
    if ends.is_empty() {
        ways.remove(&side);
    }
    end
}

/// Where a side goes through a slice, as an index.
fn crossing(index: &[[f64; 3]], side: [u32; 2], slice: f64) -> [f64; 3] {
    let [p, q] = side.map(|n| index[n as usize]);
    let share = ((slice - p[2]) / (q[2] - p[2])).clamp(0.0, 1.0);
    [p[0] + (q[0] - p[0]) * share, p[1] + (q[1] - p[1]) * share, slice]
}

/// The contour in space without corners at the same place; `None` when it encloses nothing.
fn cleaned(contour: &[[f64; 3]], grid: &Grid) -> Option<Vec<Point>> {
    let mut kept: Vec<Point> = Vec::new();
    for p in contour.iter().map(|&index| grid.patient_from_index(index)) {
        if kept.last().is_none_or(|last| (p - last).norm() > NEAR_MM) {
            kept.push(p);
        }
    }
    while kept.len() > 1 && (kept[0] - kept[kept.len() - 1]).norm() <= NEAR_MM {
        kept.pop();
    }
    let first = *kept.first()?;
    let fan = kept.windows(2).map(|w| (w[0] - first).cross(&(w[1] - first)));
    let area = 0.5 * fan.sum::<supine_space::Vector>().norm();
    (kept.len() > 2 && area >= MIN_MM2).then_some(kept)
}

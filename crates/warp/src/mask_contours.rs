//! The outlines of a mask in its slices.

use rayon::prelude::*;
use std::collections::BTreeMap;
use supine_space::Point;
use supine_volume::Volume;

/// A place halfway between voxels, in halves of voxels.
type Half = [i64; 2];

/// Outer outlines of a mask, slice by slice, through the middles between voxels within and without
/// (LPS, mm); holes and outlines that enclose less than `least_mm2` are left out. Voxels that touch
/// at a corner alone are apart.
pub fn mask_contours(mask: &Volume<bool>, least_mm2: f64) -> Vec<Vec<Point>> {
    let (grid, spacing) = (mask.grid(), mask.grid().spacing());
    let slices: Vec<Vec<Vec<Point>>> = (0..grid.size()[2])
        .into_par_iter()
        .map(|k| {
            let outer = |half: &Vec<Half>| {
                // Anticlockwise outlines go round what is within.
                let mm2 = area(half) * 0.25 * spacing.x * spacing.y;
                mm2 >= least_mm2
            };
            let place = |[x, y]: &Half| {
                grid.patient_from_index([*x as f64 / 2.0, *y as f64 / 2.0, k as f64])
            };
            let outlines = outlines(mask, k).into_iter().filter(outer);
            outlines.map(|half| straightened(&half).iter().map(place).collect()).collect()
        })
        .collect();
    slices.into_iter().flatten().collect()
}

/// All outlines of a slice, what is within on the left.
fn outlines(mask: &Volume<bool>, k: usize) -> Vec<Vec<Half>> {
    let [ni, nj, _] = mask.grid().size().map(|n| n as i64);
    let within = |i: i64, j: i64| {
        (0..ni).contains(&i) && (0..nj).contains(&j) && mask.at([i as usize, j as usize, k])
    };
    // Each square of four voxel centres is crossed from one of its sides to another.
    let mut ways: BTreeMap<Half, Half> = BTreeMap::new();
    for j in -1..nj {
        for i in -1..ni {
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| within(i + a, j + b));
            let sides = [[1, 0], [2, 1], [1, 2], [0, 1]].map(|[a, b]| [2 * i + a, 2 * j + b]);
            for side in 0..4 {
                // Going round anticlockwise, the outline leaves the square where what is within
                // begins.
                if !corners[side] && corners[(side + 1) % 4] {
                    let end =
                        (1..4).find(|n| corners[(side + n) % 4] && !corners[(side + n + 1) % 4]);
                    let from = end.map_or(side, |n| (side + n) % 4);
                    ways.insert(sides[from], sides[side]);
                }
            }
        }
    }
    let mut outlines = Vec::new();
    while let Some((&start, _)) = ways.first_key_value() {
        let (mut outline, mut at) = (vec![start], start);
        while let Some(next) = ways.remove(&at) {
            if next == start {
                break;
            }
            outline.push(next);
            at = next;
        }
        outlines.push(outline);
    }
    outlines
}

/// Twice the area in halves of voxels squared, by half; positive when anticlockwise along i and j.
fn area(outline: &[Half]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let twice: i64 = outline.iter().zip(next).map(|([a, b], [c, d])| a * d - c * b).sum();
    twice as f64 / 2.0
}

/// Without the corners on straight lines.
fn straightened(outline: &[Half]) -> Vec<Half> {
    let n = outline.len();
    let bends = |at: &usize| {
        let [a, b, c] = [(at + n - 1) % n, *at, (at + 1) % n].map(|m| outline[m]);
        (b[0] - a[0]) * (c[1] - b[1]) != (b[1] - a[1]) * (c[0] - b[0])
    };
    (0..n).filter(bends).map(|at| outline[at]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Vector};

    fn mask(inside: impl Fn(usize, usize) -> bool) -> Volume<bool> {
        let grid =
            Grid::new([60, 50, 2], Vector::new(0.5, 1.0, 3.0), Point::origin(), Matrix::identity());
        Volume::from_fn(grid.unwrap(), |[i, j, k]| k == 1 && inside(i, j))
    }

    fn mm2(contour: &[Point]) -> f64 {
        let next = contour.iter().cycle().skip(1);
        let twice: f64 = contour.iter().zip(next).map(|(a, b)| a.x * b.y - b.x * a.y).sum();
        twice / 2.0
    }

    #[test]
    fn a_rectangle_has_its_corners_cut_and_its_hole_is_left_out() {
        let holed = mask(|i, j| {
            (10..30).contains(&i) && (5..25).contains(&j) && !((15..20).contains(&i) && j == 10)
        });
        let found = mask_contours(&holed, 1.0);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].len(), 8);
        assert!(found[0].iter().all(|p| p.z == 3.0));
        // 20 x 20 voxels of 0.5 x 1 mm without an eighth of one at each corner.
        assert!((mm2(&found[0]) - 199.75).abs() < 1e-9, "{}", mm2(&found[0]));
    }

    #[test]
    fn a_disc_keeps_its_area_and_what_touches_at_a_corner_is_apart() {
        let disc = mask(|i, j| {
            let (x, y) = (i as f64 * 0.5 - 15.0, j as f64 - 25.0);
            x.hypot(y) < 12.0
        });
        let found = mask_contours(&disc, 1.0);
        assert_eq!(found.len(), 1);
        assert!((mm2(&found[0]) / (std::f64::consts::PI * 144.0) - 1.0).abs() < 0.02);
        let corners = mask(|i, j| (i, j) == (10, 10) || (i, j) == (11, 11));
        assert_eq!(mask_contours(&corners, 0.0).len(), 2);
        let edge = mask(|i, _| i < 3);
        assert_eq!(mask_contours(&edge, 1.0).len(), 1, "what ends with the slice is closed");
    }
}

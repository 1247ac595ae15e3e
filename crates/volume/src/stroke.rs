//! A stroke of a brush.

use crate::SeedKind;
use supine_space::{Grid, Point, Vector};

/// A stroke of a brush: balls along a line of points.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What it says of the tissue; `None`: takes back what the strokes before it said.
    pub kind: Option<SeedKind>,
    /// Radius of the brush, mm.
    pub radius_mm: f64,
    /// Where it went, LPS, mm.
    pub points: Vec<Point>,
}

impl Stroke {
    /// Calls `f` with the offset of each voxel whose centre lies within the brush, some more than
    /// once.
    pub fn voxels(&self, grid: &Grid, mut f: impl FnMut(usize)) {
        let ends = self.points.windows(2).map(|pair| (pair[0], pair[1]));
        let dot = self.points.first().filter(|_| self.points.len() == 1).map(|p| (*p, *p));
        for (from, to) in ends.chain(dot) {
            self.capsule(grid, (from, to), &mut f);
        }
    }

    fn capsule(&self, grid: &Grid, (from, to): (Point, Point), f: &mut impl FnMut(usize)) {
        let Some([low, high]) = self.bounds(grid, &from, &to) else { return };
        let along = to - from;
        let square = self.radius_mm * self.radius_mm;
        for k in low[2]..=high[2] {
            for j in low[1]..=high[1] {
                for i in low[0]..=high[0] {
                    let away = off(&(grid.centre([i, j, k]) - from), &along);
                    if away.norm_squared() <= square {
                        f(grid.offset([i, j, k]));
                    }
                }
            }
        }
    }

    /// First and last voxels of a box that holds a capsule, if any is on the grid.
    fn bounds(&self, grid: &Grid, from: &Point, to: &Point) -> Option<[[usize; 3]; 2]> {
        let (a, b) = (grid.index_from_patient(from), grid.index_from_patient(to));
        let mut bounds = [[0; 3]; 2];
        for axis in 0..3 {
            let reach = self.radius_mm / grid.spacing()[axis];
            let low = (a[axis].min(b[axis]) - reach).ceil().max(0.0);
            let high = (a[axis].max(b[axis]) + reach).floor().min(grid.size()[axis] as f64 - 1.0);
            if low > high {
                return None;
            }
            (bounds[0][axis], bounds[1][axis]) = (low as usize, high as usize);
        }
        Some(bounds)
    }
}

/// From the nearest point of a line from the origin to `along`, to `place`.
fn off(place: &Vector, along: &Vector) -> Vector {
    let square = along.norm_squared();
    let share = if square > 0.0 { (place.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    place - along * share
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use supine_space::Matrix;

    #[test]
    fn a_stroke_covers_what_lies_within_its_radius_and_leaves_no_gaps() {
        let turn = Matrix::from_columns(&[
            Vector::new(0.0, -1.0, 0.0),
            Vector::new(0.6, 0.0, 0.8),
            Vector::new(-0.8, 0.0, 0.6),
        ]);
        let spacing = Vector::new(0.9, 1.1, 2.5);
        let grid = Grid::new([40, 36, 20], spacing, Point::new(5.0, 6.0, 7.0), turn).unwrap();
        let at = |i: f64, j: f64, k: f64| grid.patient_from_index([i, j, k]);
        let points = vec![at(3.0, 4.0, 2.0), at(30.0, 20.0, 9.0), at(55.0, 20.0, 9.0)];
        let stroke = Stroke { kind: None, radius_mm: 4.0, points: points.clone() };
        let mut found = BTreeSet::new();
        stroke.voxels(&grid, |n| {
            found.insert(n);
        });
        for n in 0..grid.len() {
            let p = grid.centre(grid.voxel(n));
            // Sampled finely instead of by the formula.
            let near = points.windows(2).any(|pair| {
                (0..=2000).any(|s| {
                    (pair[0] + (pair[1] - pair[0]) * (f64::from(s) / 2000.0) - p).norm() <= 4.0
                })
            });
            assert_eq!(found.contains(&n), near, "{:?}", grid.voxel(n));
        }
        let dot = Stroke { points: vec![at(3.0, 4.0, 2.0)], ..stroke };
        let mut count = 0;
        dot.voxels(&grid, |_| count += 1);
        assert!((90..130).contains(&count), "{count}");
    }
}

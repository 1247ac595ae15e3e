//! How much there is of connected pieces, and where the largest lies.

use supine_space::{Grid, Point};
use supine_volume::{Parts, Run};

/// Volume of some pieces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Amount {
    /// All of them, ml.
    pub(crate) ml: f64,
    /// The largest of them, ml, and its middle (LPS, mm).
    pub(crate) largest_ml: f64,
    pub(crate) middle: Point,
}

/// How much of the runs that count there is, in pieces of at least `least_ml`; their grid is that
/// of the parts.
pub(crate) fn amount(
    parts: &Parts,
    grid: &Grid,
    least_ml: f64,
    counts: impl Fn(&Run, usize) -> bool,
) -> Amount {
    let [ni, nj, _] = grid.size();
    let mut sums = vec![[0.0f64; 4]; parts.voxels.len()];
    for (run, part) in parts.iter().filter(|(run, part)| counts(run, *part)) {
        let voxels = run.len as f64;
        let i = (run.start % ni) as f64 + 0.5 * (voxels - 1.0);
        let [j, k] = [run.start / ni % nj, run.start / ni / nj].map(|n| n as f64);
        let add = [voxels, voxels * i, voxels * j, voxels * k];
        sums[part] = [0, 1, 2, 3].map(|a| sums[part][a] + add[a]);
    }
    let mut out = Amount { ml: 0.0, largest_ml: 0.0, middle: Point::origin() };
    for [voxels, i, j, k] in sums {
        let ml = voxels * grid.voxel_volume() / 1000.0;
        if ml < least_ml {
            continue;
        }
        out.ml += ml;
        if ml > out.largest_ml {
            out.largest_ml = ml;
            out.middle = grid.patient_from_index([i, j, k].map(|sum| sum / voxels));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Vector};

    #[test]
    fn pieces_are_summed_and_the_largest_is_placed() {
        let spacing = Vector::new(10.0, 10.0, 5.0);
        let grid = Grid::new([8, 6, 4], spacing, Point::new(-7.0, 0.0, 3.0), Matrix::identity());
        let grid = grid.unwrap();
        let on = |n: usize| matches!(grid.voxel(n), [0, 0, 0] | [2..=4, 3, 1..=2] | [7, 5, 3]);
        let parts = Parts::new(grid.size(), on);
        let all = amount(&parts, &grid, 0.0, |_, _| true);
        assert!((all.ml - 4.0).abs() < 1e-9 && (all.largest_ml - 3.0).abs() < 1e-9, "{all:?}");
        assert!((all.middle - Point::new(23.0, 30.0, 10.5)).norm() < 1e-9, "{all:?}");
        assert!((amount(&parts, &grid, 0.6, |_, _| true).ml - 3.0).abs() < 1e-9);
        let first = amount(&parts, &grid, 0.0, |run, _| run.start == 0);
        assert!((first.ml - 0.5).abs() < 1e-9 && first.middle == grid.centre([0, 0, 0]));
    }
}

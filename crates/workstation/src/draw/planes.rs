//! The planes of a grid, as the views of the page show them.

use serde::Serialize;
use supine_space::{Grid, View};

/// How the grid's own planes are shown in a view.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct ViewShown {
    name: &'static str,
    /// The grid's axis at right angles to the planes.
    normal: usize,
    right: AxisShown,
    down: AxisShown,
    /// At the left, right, upper and lower edge.
    letters: [&'static str; 4],
}

/// An axis of the grid along one side of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct AxisShown {
    axis: usize,
    /// Whether the index falls along it.
    flip: bool,
}

impl ViewShown {
    /// Whether it has a name.
    pub(crate) fn is(&self, name: &str) -> bool {
        self.name == name
    }

    /// The grid's axis at right angles to its planes.
    pub(crate) fn normal(&self) -> usize {
        self.normal
    }

    /// The grid's axes along its right and down sides.
    pub(crate) fn sides(&self) -> [usize; 2] {
        [self.right.axis, self.down.axis]
    }
}

/// The views of a grid's own planes. Each direction of a picture is that axis of the grid that
/// comes nearest to it; no two directions share one.
pub(crate) fn views(grid: &Grid) -> Vec<ViewShown> {
    let order = nearest_axes(grid);
    let along = |direction: [f64; 3]| {
        let lps = (0..3).find(|a| direction[*a] != 0.0).unwrap_or(0);
        let axis = order[lps];
        let same = grid.direction()[(lps, axis)] * direction[lps] > 0.0;
        AxisShown { axis, flip: !same }
    };
    let shown = |view: View| ViewShown {
        name: view.name(),
        normal: order[view.axis()],
        right: along(view.right().into()),
        down: along(view.down().into()),
        letters: view.letters(),
    };
    View::ALL.map(shown).into()
}

/// Which axis of the grid runs nearest along x, y and z of LPS: of the six ways to pair them the
/// one with the largest sum of cosines.
fn nearest_axes(grid: &Grid) -> [usize; 3] {
    let ways = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let fit =
        |way: &[usize; 3]| (0..3).map(|lps| grid.direction()[(lps, way[lps])].abs()).sum::<f64>();
    let best = ways.into_iter().max_by(|a, b| fit(a).total_cmp(&fit(b)));
    best.unwrap_or([0, 1, 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    fn grid(columns: [[f64; 3]; 3]) -> Grid {
        let direction = Matrix::from_columns(&columns.map(Vector::from));
        Grid::new([4, 5, 6], Vector::new(1.0, 1.0, 2.0), Point::origin(), direction).unwrap()
    }

    /// Where a picture's upper left, upper right and lower left corners lie, LPS.
    fn corners(grid: &Grid, view: &ViewShown) -> [Point; 3] {
        let at = |right: bool, down: bool| {
            let mut voxel = [0; 3];
            for (side, far) in [(view.right, right), (view.down, down)] {
                voxel[side.axis] = if side.flip == far { 0 } else { grid.size()[side.axis] - 1 };
            }
            grid.centre(voxel)
        };
        [at(false, false), at(true, false), at(false, true)]
    }

    #[test]
    fn pictures_lie_as_their_letters_say_on_grids_of_all_kinds() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let not = |v: [f64; 3]| v.map(|c: f64| -c);
        let tilted = [[0.995, 0.0998, 0.0], [-0.0998, 0.995, 0.0], z];
        // Axial, flipped rows, feet first, coronal, sagittal, slightly turned.
        for axes in [
            [x, y, z],
            [not(x), not(y), z],
            [not(x), y, not(z)],
            [x, not(z), y],
            [y, not(z), x],
            tilted,
        ] {
            let grid = grid(axes);
            for (shown, view) in views(&grid).iter().zip(View::ALL) {
                let [corner, right, down] = corners(&grid, shown);
                assert!((right - corner).dot(&view.right()) > 0.0, "{axes:?} {shown:?}");
                assert!((down - corner).dot(&view.down()) > 0.0, "{axes:?} {shown:?}");
                let used = [shown.normal, shown.right.axis, shown.down.axis];
                assert_eq!(used.iter().sum::<usize>(), 3, "{used:?}");
            }
        }
    }
}

//! What a plane shows of a volume: samples at its pixels, and lines through them.

use crate::sample::{Cell, Pair, sample_cell};
use crate::{Volume, sample_trilinear};
use rayon::prelude::*;
use supine_space::{Grid, Plane, Spot};

/// Trilinear samples at the pixels' centres, row by row; NaN outside the volume's voxels.
pub fn sample_plane<T: Copy + Into<f32> + Sync>(volume: &Volume<T>, plane: &Plane) -> Vec<f32> {
    let mut samples = vec![f32::NAN; plane.width * plane.height];
    let rows = samples.par_chunks_exact_mut(plane.width).enumerate();
    match Pairs::new(volume.grid(), plane) {
        Some(pairs) => rows.for_each(|(y, row)| pairs.sample(volume, y, row)),
        None => rows.for_each(|(y, row)| sample_row(volume, plane, y, row)),
    }
    samples
}

/// The row of an oblique plane.
fn sample_row<T: Copy + Into<f32>>(volume: &Volume<T>, plane: &Plane, y: usize, row: &mut [f32]) {
    let grid = volume.grid();
    for (x, sample) in row.iter_mut().enumerate() {
        let index = grid.index_from_patient(&plane.patient([x as f64, y as f64]));
        if (0..3).all(|a| is_inside(grid, a, index[a])) {
            *sample = sample_trilinear(volume, index);
        }
    }
}

/// Whether an index lies within the voxels of an axis.
fn is_inside(grid: &Grid, axis: usize, index: f64) -> bool {
    (-0.5..=grid.size()[axis] as f64 - 0.5).contains(&index)
}

/// What the pixels of a plane share where the volume's axes are those of the plane: each axis has
/// its pair of voxels by the column, by the row, or one for all pixels. The samples are those of
/// [`sample_row`] to the bit, in a third of the time.
struct Pairs {
    /// For each axis of the volume; none where a pixel lies outside.
    along: [Vec<Option<Pair>>; 3],
    /// By what an axis has its pairs: 0 the column, 1 the row, 2 neither.
    by: [usize; 3],
}

impl Pairs {
    /// None where an axis of the volume is not an axis of LPS.
    fn new(grid: &Grid, plane: &Plane) -> Option<Self> {
        let directions = [plane.view.right(), plane.view.down()];
        let size = grid.size();
        let (mut along, mut by, mut stride) = ([const { Vec::new() }; 3], [2; 3], 1);
        for a in 0..3 {
            let axis = grid.direction().column(a);
            if axis.iter().filter(|cosine| **cosine != 0.0).count() != 1 {
                return None;
            }
            by[a] = directions.iter().position(|d| d.dot(&axis) != 0.0).unwrap_or(2);
            let count = [plane.width, plane.height, 1][by[a]];
            let pair = |n: usize| {
                let mut spot = [0.0; 3];
                spot[by[a]] = n as f64;
                let index = grid.index_from_patient(&plane.patient([spot[0], spot[1]]))[a];
                is_inside(grid, a, index).then(|| Pair::new(size[a], stride, index))
            };
            along[a] = (0..count).map(pair).collect();
            stride *= size[a];
        }
        Some(Self { along, by })
    }

    /// Fills the row `y`; a pixel outside is left as it is.
    fn sample<T: Copy + Into<f32>>(&self, volume: &Volume<T>, y: usize, row: &mut [f32]) {
        for (x, sample) in row.iter_mut().enumerate() {
            let at = |a: usize| self.along[a][[x, y, 0][self.by[a]]];
            if let (Some(i), Some(j), Some(k)) = (at(0), at(1), at(2)) {
                *sample = sample_cell(volume, &Cell::of([i, j, k]));
            }
        }
    }
}

/// The lines at which a picture of samples (row by row, `width` across) crosses `level`, by
/// marching squares with linear interpolation, in pixels; cells with a NaN are left out.
pub fn contour(samples: &[f32], width: usize, level: f32) -> Vec<[Spot; 2]> {
    let height = samples.len().checked_div(width).unwrap_or(0);
    let mut segments = Vec::new();
    for y in 0..height.saturating_sub(1) {
        for x in 0..width - 1 {
            let corners = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
            let value = corners.map(|(x, y)| samples[y * width + x]);
            let above = value.iter().filter(|v| **v > level).count();
            // Most cells are crossed by nothing.
            if above == 0 || above == 4 || value.iter().any(|v| v.is_nan()) {
                continue;
            }
            let mut crossings: Vec<Spot> = Vec::with_capacity(4);
            for a in 0..4 {
                let b = (a + 1) % 4;
                if (value[a] > level) != (value[b] > level) {
                    let t = f64::from((level - value[a]) / (value[b] - value[a]));
                    let mix = |p: usize, q: usize| p as f64 + t * (q as f64 - p as f64);
                    crossings
                        .push([mix(corners[a].0, corners[b].0), mix(corners[a].1, corners[b].1)]);
                }
            }
            segments.extend(crossings.chunks_exact(2).map(|c| [c[0], c[1]]));
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector, View};

    #[test]
    fn a_plane_along_the_axes_is_that_of_its_single_places_to_the_bit() {
        let turned = Matrix::new(0.0, 0.0, -1.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
        let leaning = Matrix::new(0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0);
        for (direction, are_axes) in [(Matrix::identity(), true), (turned, true), (leaning, false)]
        {
            let spacing = Vector::new(1.3, 0.7, 2.9);
            let grid = Grid::new([7, 9, 5], spacing, Point::new(-4.1, 3.7, 11.3), direction);
            let volume =
                Volume::from_fn(grid.unwrap(), |[i, j, k]| (i * i + 7 * j + 31 * k * i) as i16);
            let centre = volume.grid().patient_from_index([3.1, 4.2, 1.9]);
            let frame = [centre - Vector::repeat(6.0), centre + Vector::repeat(6.0)];
            for view in View::ALL {
                let plane = Plane::new(view, &centre, frame, 0.37);
                assert_eq!(Pairs::new(volume.grid(), &plane).is_some(), are_axes);
                let mut single = vec![f32::NAN; plane.width * plane.height];
                let rows = single.chunks_mut(plane.width).enumerate();
                rows.for_each(|(y, row)| sample_row(&volume, &plane, y, row));
                let bits = |samples: Vec<f32>| samples.into_iter().map(f32::to_bits);
                assert!(single.iter().any(|v| v.is_nan()) && single.iter().any(|v| *v > 0.0));
                assert!(bits(sample_plane(&volume, &plane)).eq(bits(single)), "{view:?}");
            }
        }
    }

    #[test]
    fn a_contour_of_a_cone_is_a_circle() {
        let cone: Vec<f32> =
            (0..1600).map(|n| ((n % 40) as f32 - 19.5).hypot((n / 40) as f32 - 19.5)).collect();
        let circle = contour(&cone, 40, 12.0);
        let length: f64 = circle.iter().map(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1])).sum();
        assert!((length - std::f64::consts::TAU * 12.0).abs() < 0.2, "{length}");
        for [x, y] in circle.iter().flatten() {
            assert!(((x - 19.5).hypot(y - 19.5) - 12.0).abs() < 0.02);
        }
    }
}

//! Sampling between voxel centres.

use crate::Volume;
use supine_space::Point;

/// Trilinear sample at a continuous index, clamped to the volume per axis.
///
/// Position in f64, interpolation in f32. The cell is `min(floor q, n - 2)`; an axis of one voxel
/// is constant.
pub fn sample_trilinear<T: Copy + Into<f32>>(volume: &Volume<T>, index: [f64; 3]) -> f32 {
    let size = volume.grid().size();
    let mut base = [0usize; 3];
    let mut step = [0usize; 3];
    let mut t = [0f32; 3];
    for a in 0..3 {
        let last = size[a] - 1;
        let q = index[a].clamp(0.0, last as f64);
        base[a] = (q.floor() as usize).min(last.saturating_sub(1));
        step[a] = usize::from(last > 0);
        t[a] = (q - base[a] as f64) as f32;
    }
    let v = |i: usize, j: usize, k: usize| -> f32 {
        volume.at([base[0] + i * step[0], base[1] + j * step[1], base[2] + k * step[2]]).into()
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |j, k| mix(v(0, j, k), v(1, j, k), t[0]);
    let plane = |k| mix(row(0, k), row(1, k), t[1]);
    mix(plane(0), plane(1), t[2])
}

/// Trilinear sample at a position (LPS, mm), clamped to the volume.
pub fn sample_trilinear_at<T: Copy + Into<f32>>(volume: &Volume<T>, p: &Point) -> f32 {
    sample_trilinear(volume, volume.grid().index_from_patient(p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Vector};

    #[test]
    fn linear_functions_are_reproduced_and_the_outside_is_clamped() {
        let g = Grid::new([4, 3, 2], Vector::repeat(2.0), Point::origin(), Matrix::identity());
        let v = Volume::from_fn(g.unwrap(), |[i, j, k]| (i + 10 * j + 100 * k) as f32);
        assert!((sample_trilinear(&v, [1.25, 0.5, 0.75]) - 81.25).abs() < 1e-4);
        assert!((sample_trilinear(&v, [-5.0, 9.0, 0.5]) - 70.0).abs() < 1e-4);
        assert!((sample_trilinear_at(&v, &Point::new(2.5, 1.0, 1.5)) - 81.25).abs() < 1e-4);
    }

    #[test]
    fn an_axis_of_one_voxel_is_constant() {
        let g = Grid::new([2, 2, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let v = Volume::from_fn(g.unwrap(), |[i, j, _]| (i + 2 * j) as f32);
        assert!((sample_trilinear(&v, [0.5, 0.5, 7.0]) - 1.5).abs() < 1e-6);
    }
}

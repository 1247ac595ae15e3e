//! Sampling between voxel centres: where a place lies among them, and how their values are mixed.

use crate::Volume;
use supine_space::Point;

/// The eight voxels around a continuous index, and the way from the first to the others.
///
/// An index beyond the volume is held at its border, per axis. The first voxel is `min(floor q, n -
/// 2)`; an axis of one voxel is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    first: usize,
    stride: [usize; 3],
    t: [f64; 3],
}

/// The two voxels of an axis around a continuous index: where the first lies in memory, how far the
/// other is from it, and the way between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    first: usize,
    stride: usize,
    t: f64,
}

impl Pair {
    /// The pair of an axis of `size` voxels that are `stride` apart in memory.
    #[inline]
    pub(crate) fn new(size: usize, stride: usize, index: f64) -> Self {
        let q = index.clamp(0.0, (size - 1) as f64);
        let at = (q as usize).min(size.saturating_sub(2));
        let stride_between = if size == 1 { 0 } else { stride };
        Self { first: at * stride, stride: stride_between, t: q - at as f64 }
    }
}

impl Cell {
    /// The cell of a continuous index in a volume of that size, i fastest in memory.
    #[inline]
    pub fn new(size: [usize; 3], index: [f64; 3]) -> Self {
        let [i, j, _] = size;
        Self::of([
            Pair::new(i, 1, index[0]),
            Pair::new(j, i, index[1]),
            Pair::new(size[2], i * j, index[2]),
        ])
    }

    /// The cell of a pair along each axis.
    #[inline]
    pub(crate) fn of([i, j, k]: [Pair; 3]) -> Self {
        Self {
            first: i.first + j.first + k.first,
            stride: [i.stride, j.stride, k.stride],
            t: [i.t, j.t, k.t],
        }
    }

    /// Places in memory of the corners; i fastest, then j, then k.
    #[inline]
    pub fn corners(&self) -> [usize; 8] {
        let [i, j, k] = self.stride;
        [0, i, j, i + j, k, i + k, j + k, i + j + k].map(|offset| self.first + offset)
    }

    /// Share of each corner, in their order; together 1.
    #[inline]
    pub fn weights(&self) -> [f64; 8] {
        let share = |a: usize, far: usize| if far == 1 { self.t[a] } else { 1.0 - self.t[a] };
        [0, 1, 2, 3, 4, 5, 6, 7].map(|c| share(0, c & 1) * share(1, c >> 1 & 1) * share(2, c >> 2))
    }

    /// The value between those of the corners, in f32.
    #[inline]
    pub fn mix_f32(&self, c: &[f32; 8]) -> f32 {
        let t = self.t.map(|t| t as f32);
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let row = |n: usize| mix(c[n], c[n + 1], t[0]);
        let plane = |n: usize| mix(row(n), row(n + 2), t[1]);
        mix(plane(0), plane(4), t[2])
    }

    /// The value between those of the corners, and its rise from voxel to voxel along i, j, k.
    #[inline]
    pub fn mix_with_rise(&self, c: &[f64; 8]) -> (f64, [f64; 3]) {
        let t = self.t;
        let rise = |n: usize| c[n + 1] - c[n];
        let (d0, d2, d4, d6) = (rise(0), rise(2), rise(4), rise(6));
        let (x0, x2) = (c[0] + d0 * t[0], c[2] + d2 * t[0]);
        let (x4, x6) = (c[4] + d4 * t[0], c[6] + d6 * t[0]);
        let (y0, y4) = (x0 + (x2 - x0) * t[1], x4 + (x6 - x4) * t[1]);
        let (e0, e4) = (d0 + (d2 - d0) * t[1], d4 + (d6 - d4) * t[1]);
        let along = (x2 - x0) + ((x6 - x4) - (x2 - x0)) * t[2];
        (y0 + (y4 - y0) * t[2], [e0 + (e4 - e0) * t[2], along, y4 - y0])
    }
}

/// Trilinear sample at a continuous index, clamped to the volume per axis.
///
/// Position in f64, interpolation in f32.
#[inline]
pub fn sample_trilinear<T: Copy + Into<f32>>(volume: &Volume<T>, index: [f64; 3]) -> f32 {
    sample_cell(volume, &Cell::new(volume.grid().size(), index))
}

/// Trilinear sample in a cell of the volume, interpolated in f32.
#[inline]
pub(crate) fn sample_cell<T: Copy + Into<f32>>(volume: &Volume<T>, cell: &Cell) -> f32 {
    cell.mix_f32(&cell.corners().map(|n| volume.data()[n].into()))
}

/// Trilinear sample at a position (LPS, mm), clamped to the volume.
pub fn sample_trilinear_at<T: Copy + Into<f32>>(volume: &Volume<T>, p: &Point) -> f32 {
    sample_trilinear(volume, volume.grid().index_from_patient(p))
}

/// Trilinear sample of a volume of vectors at a continuous index, clamped to the volume per axis.
///
/// The corners' vectors times their shares, summed in f64 in the order of memory.
pub fn sample_vector<const N: usize>(volume: &Volume<[f32; N]>, index: [f64; 3]) -> [f64; N] {
    let cell = Cell::new(volume.grid().size(), index);
    let mut sum = [0.0; N];
    for (n, weight) in cell.corners().into_iter().zip(cell.weights()) {
        let value = volume.data()[n];
        for a in 0..N {
            sum[a] += f64::from(value[a]) * weight;
        }
    }
    sum
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
    fn every_way_of_mixing_meets_what_is_linear_in_each_coordinate() {
        let g = Grid::new([4, 3, 5], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let f = |[x, y, z]: [f64; 3]| 2.0 * x * y - z + x * y * z;
        let v = Volume::from_fn(g.unwrap(), |v| [f(v.map(|n| n as f64)) as f32, 1.0]);
        for at in [[0.3, 1.7, 2.2], [2.9, 0.0, 3.5], [3.0, 2.0, 4.0], [-1.0, 0.5, 9.0]] {
            let held = [0, 1, 2].map(|a| f64::clamp(at[a], 0.0, [3.0, 2.0, 4.0][a]));
            let [value, one] = sample_vector(&v, at);
            assert!((value - f(held)).abs() < 1e-6 && (one - 1.0).abs() < 1e-12, "{at:?}");
            let cell = Cell::new(v.grid().size(), at);
            let corners = cell.corners().map(|n| f64::from(v.data()[n][0]));
            let (mixed, rise) = cell.mix_with_rise(&corners);
            let [x, y, z] = held;
            let slope = [2.0 * y + y * z, 2.0 * x + x * z, x * y - 1.0];
            assert!((mixed - value).abs() < 1e-9, "{at:?}");
            assert!((0..3).all(|a| (rise[a] - slope[a]).abs() < 1e-6), "{at:?} {rise:?}");
        }
    }

    #[test]
    fn an_axis_of_one_voxel_is_constant() {
        let g = Grid::new([2, 2, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let v = Volume::from_fn(g.unwrap(), |[i, j, _]| (i + 2 * j) as f32);
        assert!((sample_trilinear(&v, [0.5, 0.5, 7.0]) - 1.5).abs() < 1e-6);
    }
}

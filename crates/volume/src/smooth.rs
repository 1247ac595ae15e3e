//! Gaussian smoothing of volumes and slices.

use crate::Volume;
use rayon::prelude::*;
use std::ops::Range;

/// The volume smoothed by a Gaussian of `sigma_mm` (per axis i, j, k; 0 leaves the axis alone).
///
/// Separable sampled kernel, cut at 4 sigma and normalised; the border value continues outside.
/// The same bits for any number of threads.
pub fn gaussian(volume: &Volume<f32>, sigma_mm: [f64; 3]) -> Volume<f32> {
    let grid = volume.grid();
    let [ni, nj, nk] = grid.size();
    let mut data = volume.data().to_vec();
    for axis in 0..3 {
        let kernel = kernel(sigma_mm[axis] / grid.spacing()[axis]);
        if kernel.len() == 1 {
            continue;
        }
        if axis == 0 {
            data.par_chunks_mut(ni).for_each(|row| smooth_row(row, &kernel, &mut Vec::new()));
            continue;
        }
        let source = data.clone();
        let line =
            if axis == 1 { Line { n: nj, stride: ni } } else { Line { n: nk, stride: ni * nj } };
        data.par_chunks_mut(ni).enumerate().for_each(|(row, out)| {
            let here = if axis == 1 { row % nj } else { row / nj };
            line.smooth_rows(&source[row * ni - here * line.stride..], here, &kernel, out);
        });
    }
    Volume::from_parts(grid.clone(), data)
}

/// Smooths a slice (rows of `ni` pixels, `spacing` mm apart) in place by a Gaussian of `sigma_mm`.
///
/// Separable sampled kernel, cut at 3 sigma; the border value continues outside. In single
/// precision and cut nearer than [`gaussian`]: the labels of the segmentation rest on these very
/// digits.
pub fn gaussian_slice(image: &mut [f32], ni: usize, spacing: [f32; 2], sigma_mm: f32) {
    let rows = 0..image.len() / ni;
    gaussian_rows(image, ni, spacing, sigma_mm, rows);
}

/// [`gaussian_slice`] for some rows of the slice; those near them are left smoothed along the row
/// alone.
pub fn gaussian_rows(
    image: &mut [f32],
    ni: usize,
    spacing: [f32; 2],
    sigma_mm: f32,
    rows: Range<usize>,
) {
    let nj = image.len() / ni;
    let [along, across] = spacing.map(|mm| slice_kernel(sigma_mm / mm));
    let from = rows.start.saturating_sub(across.len() - 1);
    let to = (rows.end + across.len() - 1).min(nj);
    let mut padded = Vec::new();
    let near = &mut image[from * ni..to * ni];
    near.chunks_exact_mut(ni).for_each(|row| smooth_row(row, &along, &mut padded));
    let source = near.to_vec();
    // Where rows are left out, none of those wanted reaches them.
    let line = Line { n: to - from, stride: ni };
    for j in rows {
        line.smooth_rows(&source, j - from, &across, &mut image[j * ni..(j + 1) * ni]);
    }
}

/// One-sided half of the kernel, weight of the centre first, cut at 4 sigma; `[1.0]` when sigma
/// (voxels) is negligible.
fn kernel(sigma: f64) -> Vec<f32> {
    if sigma.is_nan() || sigma < 0.05 {
        return vec![1.0];
    }
    let reach = (4.0 * sigma).ceil() as usize;
    let half: Vec<f64> = (0..=reach).map(|x| (-0.5 * (x as f64 / sigma).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    half.iter().map(|w| (w / sum) as f32).collect()
}

/// One-sided half of a normalised Gaussian, weight of the centre first, cut at 3 sigma (pixels).
pub fn slice_kernel(sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil().max(0.0) as usize;
    let half: Vec<f32> =
        (0..=reach).map(|x| (-0.5 * (x as f32 / sigma.max(1e-3)).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f32>();
    half.iter().map(|w| w / sum).collect()
}

/// Smooths a row in place. Its ends are continued by copies, so that all weights are applied to
/// whole slices.
fn smooth_row(row: &mut [f32], kernel: &[f32], padded: &mut Vec<f32>) {
    let (n, reach) = (row.len(), kernel.len() - 1);
    padded.clear();
    padded.resize(reach, row[0]);
    padded.extend_from_slice(row);
    padded.resize(n + 2 * reach, row[n - 1]);
    weigh(row, kernel, |x| (&padded[reach - x..], &padded[reach + x..]));
}

/// Values summed at once: they stay in registers for all weights.
const BLOCK: usize = 16;

/// The sums of what lies `x` to both sides, `beside(x)`, weighed by the one-sided half of a kernel
/// and added from the centre outwards. The slices of both sides are as long as `out` at least.
///
/// # Panics
/// When one of them is shorter.
#[inline]
pub fn weigh<'a>(
    out: &mut [f32],
    kernel: &[f32],
    beside: impl Fn(usize) -> (&'a [f32], &'a [f32]),
) {
    let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
    let whole = blocks.len() * BLOCK;
    for (block, out) in blocks.iter_mut().enumerate() {
        let at = block * BLOCK;
        let here = &beside(0).0[at..at + BLOCK];
        let mut sum: [f32; BLOCK] = std::array::from_fn(|n| here[n] * kernel[0]);
        for (x, w) in kernel.iter().enumerate().skip(1) {
            let (below, above) = beside(x);
            let (below, above) = (&below[at..at + BLOCK], &above[at..at + BLOCK]);
            sum = std::array::from_fn(|n| sum[n] + w * (below[n] + above[n]));
        }
        *out = sum;
    }
    for (n, out) in rest.iter_mut().enumerate() {
        let n = whole + n;
        let sides = kernel.iter().enumerate().skip(1);
        *out = sides.fold(beside(0).0[n] * kernel[0], |sum, (x, w)| {
            let (below, above) = beside(x);
            sum + w * (below[n] + above[n])
        });
    }
}

/// Rows that lie `stride` apart in memory, `n` of them.
#[derive(Clone, Copy)]
struct Line {
    n: usize,
    stride: usize,
}

impl Line {
    /// Weighted sum of whole rows at `here - x` and `here + x`; the first row is at the start of
    /// `source`.
    fn smooth_rows(self, source: &[f32], here: usize, kernel: &[f32], out: &mut [f32]) {
        let len = out.len();
        let row = |at: usize| &source[at * self.stride..][..len];
        let beside = |x: usize| (row(here.saturating_sub(x)), row((here + x).min(self.n - 1)));
        weigh(out, kernel, beside);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn a_step_becomes_the_error_function_along_every_axis() {
        let grid = |size| {
            Grid::new(size, Vector::new(0.5, 0.7, 0.9), Point::origin(), Matrix::identity())
                .unwrap()
        };
        for axis in 0..3 {
            let mut size = [3; 3];
            size[axis] = 41;
            let step = Volume::from_fn(grid(size), |v| if v[axis] > 20 { 1.0 } else { 0.0 });
            let spacing = step.grid().spacing()[axis];
            let smooth = gaussian(&step, [1.5; 3]);
            let mut at = [1; 3];
            for x in 17..25usize {
                at[axis] = x;
                let distance = (x as f64 - 20.5) * spacing;
                let expected = 1.0 / (1.0 + (-1.702 * distance / 1.5).exp());
                let got = f64::from(smooth.at(at));
                assert!((got - expected).abs() < 0.012, "axis {axis} {x}: {got} {expected}");
            }
        }
    }

    #[test]
    fn a_constant_stays() {
        let g = Grid::new([5, 6, 7], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let v = gaussian(&Volume::from_fn(g.unwrap(), |_| 3.0), [2.0, 1.0, 0.0]);
        assert!(v.data().iter().all(|x| (x - 3.0).abs() < 1e-5));
    }

    #[test]
    fn some_rows_are_as_in_the_whole_slice() {
        let noise: Vec<f32> = (0..30 * 20).map(|n| (n * 7919 % 101) as f32).collect();
        let mut whole = noise.clone();
        gaussian_slice(&mut whole, 30, [0.7, 1.1], 1.5);
        for rows in [0..20, 0..3, 8..11, 17..20] {
            let mut part = noise.clone();
            gaussian_rows(&mut part, 30, [0.7, 1.1], 1.5, rows.clone());
            let pixels = rows.start * 30..rows.end * 30;
            assert_eq!(part[pixels.clone()], whole[pixels], "{rows:?}");
        }
    }

    #[test]
    fn smoothing_a_slice_keeps_a_constant_and_a_ramp() {
        let mut image: Vec<f32> = (0..30 * 20).map(|n| (n % 30) as f32 + 2.0).collect();
        gaussian_slice(&mut image, 30, [0.7, 1.1], 1.5);
        for x in 8..22 {
            assert!((image[10 * 30 + x] - (x as f32 + 2.0)).abs() < 1e-4);
        }
    }
}

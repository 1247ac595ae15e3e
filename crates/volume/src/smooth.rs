//! Gaussian smoothing.

use crate::Volume;
use rayon::prelude::*;

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
        let source = data.clone();
        let n = grid.size()[axis];
        let stride = [1, ni, ni * nj][axis];
        data.par_chunks_mut(ni).enumerate().for_each(|(row, out)| {
            if axis == 0 {
                convolve_row(&source[row * ni..(row + 1) * ni], &kernel, out);
            } else {
                let (j, k) = (row % nj, row / nj);
                let here = if axis == 1 { j } else { k };
                add_rows(&source, row * ni, (here, n, stride), &kernel, out);
            }
        });
    }
    debug_assert_eq!(data.len(), ni * nj * nk);
    Volume::from_parts(grid.clone(), data)
}

/// One-sided half of the kernel, weight of the centre first; `[1.0]` when sigma is negligible.
fn kernel(sigma: f64) -> Vec<f32> {
    if sigma.is_nan() || sigma < 0.05 {
        return vec![1.0];
    }
    let reach = (4.0 * sigma).ceil() as usize;
    let half: Vec<f64> = (0..=reach).map(|x| (-0.5 * (x as f64 / sigma).powi(2)).exp()).collect();
    let sum = half[0] + 2.0 * half[1..].iter().sum::<f64>();
    half.iter().map(|w| (w / sum) as f32).collect()
}

/// The ends of the row are continued by copies, so that all weights are applied to whole slices.
fn convolve_row(row: &[f32], kernel: &[f32], out: &mut [f32]) {
    let (n, reach) = (row.len(), kernel.len() - 1);
    let mut padded = vec![row[0]; n + 2 * reach];
    padded[reach..reach + n].copy_from_slice(row);
    padded[reach + n..].fill(row[n - 1]);
    out.iter_mut().zip(row).for_each(|(out, value)| *out = kernel[0] * value);
    for (x, w) in kernel.iter().enumerate().skip(1) {
        let (below, above) = (&padded[reach - x..][..n], &padded[reach + x..][..n]);
        for (out, (a, b)) in out.iter_mut().zip(below.iter().zip(above)) {
            *out += w * (a + b);
        }
    }
}

/// Weighted sum of whole rows at `here - x` and `here + x` along an axis of `n` rows.
fn add_rows(
    source: &[f32],
    start: usize,
    (here, n, stride): (usize, usize, usize),
    kernel: &[f32],
    out: &mut [f32],
) {
    let base = start - here * stride;
    let row = |at: usize| &source[base + at * stride..base + at * stride + out.len()];
    let mut sum: Vec<f32> = row(here).iter().map(|v| v * kernel[0]).collect();
    for (x, w) in kernel.iter().enumerate().skip(1) {
        let (below, above) = (row(here.saturating_sub(x)), row((here + x).min(n - 1)));
        for (s, (a, b)) in sum.iter_mut().zip(below.iter().zip(above)) {
            *s += w * (a + b);
        }
    }
    out.copy_from_slice(&sum);
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
}

//! A CT with less noise, its edges kept: in noise neither gland is told from muscle nor a thin
//! plane of fat found.

use crate::body::Body;
use crate::frame::Frame;
use crate::noise::noise_hu;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use supine_volume::Ct;

/// A CT with no more noise is left as it is, HU. Measured: at 22 HU the unclear parts of a wall are
/// 1.1 mm off without and 0.8 mm with, at 10 and 15 HU nothing is won.
const QUIET_HU: f32 = 18.0;
/// Neighbours that differ by this many times the noise are other tissue. Measured: fat and muscle
/// lie 2.9 times 52 HU apart.
const OTHER: f32 = 3.0;

/// The CT in which every voxel of the rows that hold the body is the mean of its 27 neighbours,
/// weighted by how little they differ from it (Tukey's biweight), where it is noisy; the CT itself
/// where it is not.
pub(crate) fn quiet(ct: &Arc<Ct>, frame: &Frame, body: &Body) -> Arc<Ct> {
    let noise = noise_hu(ct, frame, body);
    if noise <= QUIET_HU {
        return ct.clone();
    }
    let mut out = ct.as_ref().clone();
    let ni = frame.size[0];
    out.data_mut().par_chunks_mut(frame.plane()).enumerate().for_each(|(k, out)| {
        let (mut sum, mut weight) = (vec![0.0f32; ni], vec![0.0f32; ni]);
        for j in body.rows(frame, k) {
            sum.fill(0.0);
            weight.fill(0.0);
            let here = row(ct, frame, k, j);
            for neighbour in rows_around(ct, frame, k, j) {
                add(here, neighbour, OTHER * noise, &mut sum, &mut weight);
            }
            let means = sum.iter().zip(&weight).map(|(sum, weight)| (sum / weight).round() as i16);
            out[j * ni..(j + 1) * ni].iter_mut().zip(means).for_each(|(out, mean)| *out = mean);
        }
    });
    Arc::new(out)
}

fn row<'a>(ct: &'a Ct, frame: &Frame, k: usize, j: usize) -> &'a [i16] {
    let start = k * frame.plane() + j * frame.size[0];
    &ct.data()[start..start + frame.size[0]]
}

/// The row and the eight around it; at the end of the CT, the last one again.
fn rows_around<'a>(
    ct: &'a Ct,
    frame: &'a Frame,
    k: usize,
    j: usize,
) -> impl Iterator<Item = &'a [i16]> {
    let near = |n: usize, axis: usize| [n.saturating_sub(1), n, (n + 1).min(frame.size[axis] - 1)];
    near(k, 2).into_iter().flat_map(move |k| near(j, 1).map(|j| row(ct, frame, k, j)))
}

/// Adds the pixels of a row and those to both sides of them, weighted by how little they differ
/// from the pixels of `here`; at the ends of the row, the last one again.
fn add(here: &[i16], neighbour: &[i16], other_hu: f32, sum: &mut [f32], weight: &mut [f32]) {
    let scale = 1.0 / other_hu;
    // Slices of one length each: they are added eight at once.
    let mut shifted = |to: Range<usize>, from: Range<usize>| {
        let pairs = here[to.clone()].iter().zip(&neighbour[from]);
        let sums = sum[to.clone()].iter_mut().zip(&mut weight[to]);
        for ((at, value), (sum, weight)) in pairs.zip(sums) {
            let (value, at) = (f32::from(*value), f32::from(*at));
            let off = (value - at) * scale;
            let like = (1.0 - off * off).max(0.0);
            let like = like * like;
            *sum += like * value;
            *weight += like;
        }
    };
    let n = here.len();
    shifted(0..n, 0..n);
    shifted(1..n, 0..n - 1);
    shifted(0..n - 1, 1..n);
    shifted(0..1, 0..1);
    shifted(n - 1..n, n - 1..n);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::flag;
    use supine_space::{Grid, Matrix, Point, Vector};

    /// Fat and muscle side by side, 3 pixels of fat in the muscle, and noise of about 40 HU.
    fn noisy(sigma: f32) -> (Arc<Ct>, Frame, Body, Vec<f32>) {
        let grid = Grid::new(
            [80, 80, 32],
            Vector::new(2.0, 2.0, 2.0),
            Point::origin(),
            Matrix::identity(),
        );
        let grid = grid.unwrap();
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let truth = |i: usize| if i < 40 || (60..63).contains(&i) { -100.0 } else { 50.0 };
        let expected: Vec<f32> = (0..80 * 80 * 32).map(|n| truth(n % 80)).collect();
        // The sum of 12 has a deviation of 1.
        let mut noise = || ((0..12).map(|_| random()).sum::<f32>() - 6.0) * sigma;
        let data = expected.iter().map(|hu| (hu + noise()).round() as i16).collect();
        let ct = Ct::new(grid, data).unwrap();
        let frame = Frame::new(ct.grid()).unwrap();
        let body = Body::new(&frame, vec![flag::BODY; expected.len()], vec![true; 80 * 80], 1.0);
        (Arc::new(ct), frame, body, expected)
    }

    /// Mean difference to the truth over the pixels i of all rows, and its deviation.
    fn off(ct: &Ct, truth: &[f32], i: Range<usize>) -> (f32, f32) {
        let of = |n: usize| f32::from(ct.data()[n]) - truth[n];
        let off: Vec<f32> = (0..truth.len()).filter(|n| i.contains(&(n % 80))).map(of).collect();
        let mean = off.iter().sum::<f32>() / off.len() as f32;
        let square = off.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / off.len() as f32;
        (mean, square.sqrt())
    }

    #[test]
    fn noise_goes_and_edges_stay() {
        let (ct, frame, mut body, truth) = noisy(40.0);
        body.measure_depth(&frame);
        let quiet = quiet(&ct, &frame, &body);
        let (_, before) = off(&ct, &truth, 10..30);
        let (mean, after) = off(&quiet, &truth, 10..30);
        assert!(mean.abs() < 1.0 && after < 0.5 * before, "{mean} {before} {after}");
        // Next to the edge, and in the thin plane of fat, little of the other tissue is mixed in.
        for (i, most) in [(39..40, 12.0), (40..41, 12.0), (60..63, 18.0)] {
            let (mean, _) = off(&quiet, &truth, i.clone());
            assert!(mean.abs() < most, "{i:?}: {mean}");
        }
    }

    #[test]
    fn a_quiet_scan_is_left_as_it_is() {
        let (ct, frame, body, _) = noisy(10.0);
        assert!(Arc::ptr_eq(&ct, &quiet(&ct, &frame, &body)));
    }
}

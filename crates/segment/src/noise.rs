//! The noise of a scan.

use crate::body::Body;
use crate::frame::Frame;
use rayon::prelude::*;
use supine_volume::{Ct, median};

// Chosen, not measured: far enough apart for the noise of neighbouring pixels to be independent.
/// Where noise is measured: pixels this far apart, in about so many slices, in soft tissue.
const NOISE_MM: f32 = 2.5;
const NOISE_SLICES: usize = 20;
const NOISE_DEPTH_MM: f32 = 6.0;
const SOFT_HU: std::ops::Range<i16> = -250..250;

/// Standard deviation of the noise within the slices, HU: the spread of what a pixel differs from
/// the mean of its neighbours `NOISE_MM` to both sides, in soft tissue under the skin, where
/// half of all pixels at least lie clear of any edge.
pub(crate) fn noise_hu(ct: &Ct, frame: &Frame, body: &Body) -> f32 {
    let step = ((NOISE_MM / frame.spacing[0]).round() as usize).max(1);
    let slices: Vec<usize> =
        (0..frame.size[2]).step_by((frame.size[2] / NOISE_SLICES).max(1)).collect();
    let mut off: Vec<f32> = slices
        .into_par_iter()
        .flat_map_iter(|k| {
            let start = k * frame.plane();
            let hu = &ct.data()[start..start + frame.plane()];
            (step..hu.len() - step).filter_map(move |n| {
                let [a, b, c] = [hu[n - step], hu[n], hu[n + step]];
                let soft = [a, b, c].iter().all(|v| SOFT_HU.contains(v));
                (soft && body.depth_mm(start + n) > NOISE_DEPTH_MM)
                    .then(|| (f32::from(b) - 0.5 * (f32::from(a) + f32::from(c))).abs())
            })
        })
        .collect();
    // 1.5: the variance of such a difference in white noise; 0.6745: the median of |normal|.
    median(&mut off).unwrap_or(0.0) / (0.6745 * 1.5f32.sqrt())
}

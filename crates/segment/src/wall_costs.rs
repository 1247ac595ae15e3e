//! What the tissue along a ray says of where the outer surface of the chest wall lies.

use crate::Weights;
use crate::band::{Band, STEP_MM, height};
use crate::levels::Levels;

// Costs and reaches of docs/SEGMENTATION.md, step 6, unless another source is named;
// what is weighed is in [`Weights`].
/// What differs over the ribs and below them.
#[derive(Clone, Copy)]
pub(crate) struct Rule {
    /// Cost per mm of fat enclosed beyond the shell; above the cap counted less.
    fat: f32,
    /// Dense tissue left outside the surface counts within this reach, mm.
    dense_mm: f32,
}

impl Rule {
    pub(crate) fn over_ribs(weights: &Weights) -> Self {
        Self { fat: weights.fat, dense_mm: 8.0 }
    }

    /// Chosen, not measured: there the fat of the belly lies under a thin sheet of muscle, and no
    /// gland over it.
    pub(crate) fn below_ribs() -> Self {
        Self { fat: 0.035, dense_mm: 25.0 }
    }
}

/// Fat is counted from this height on, mm, and above this much less: the fat of the armpit lies
/// under the free border of a muscle (measured on a real CT: its tip is cut by 12 instead of 9 mm
/// without).
const FAT_FROM_MM: f32 = -2.0;
const FAT_CAP_MM: f32 = 8.0;
const FAT_BEYOND_CAP: f32 = 0.3;
/// Cost per mm of dense tissue left just outside the surface.
const DENSE: f32 = 0.6;
/// Muscle left outside counts within this reach, mm.
const MUSCLE_MM: f32 = 25.0;
/// Width over which an edge from muscle to fat is measured, mm.
const EDGE_MM: f32 = 2.0;
/// Cost of coming closer to the skin than this (mm). Chosen, not measured.
const BARRED: f32 = 20.0;
pub(crate) const SKIN_MM: f32 = 2.5;
/// Thickness of a fat plane that shows where the wall ends, mm.
const PLANE_MM: f32 = 2.0;
/// Least usual distance from the lung to the outer surface of the wall, mm. Measured on three real
/// CTs: 5 to 8 where there is least muscle, and no less.
const OVER_LUNG_MM: f32 = 10.0;

/// Likeness to muscle, 0 (fat) to 1, along a ray; 1/2 where nothing is known, 0 in the skin.
pub(crate) fn likeness(band: &Band, levels: Levels, k: usize, p: usize) -> Vec<f32> {
    let (hu, depth) = (band.hu.ray(k, p), band.depth.ray(k, p));
    hu.iter()
        .zip(depth)
        .map(|(&v, &d)| {
            if v.is_nan() {
                0.5
            } else if d < SKIN_MM {
                0.0
            } else {
                levels.likeness(v)
            }
        })
        .collect()
}

/// What lies along a ray.
pub(crate) struct Ray<'a> {
    /// Likeness to muscle by HU alone.
    pub(crate) likeness: &'a [f32],
    /// Likeness to homogeneous muscle.
    pub(crate) muscle: &'a [f32],
    /// Under the skin, mm.
    pub(crate) depth: &'a [f32],
    /// Height of the outermost lung, mm.
    pub(crate) lung: Option<f32>,
}

impl Ray<'_> {
    /// The costs of the levels, but for the expected thickness.
    pub(crate) fn costs(&self, rule: Rule, weights: &Weights, out: &mut [f32]) {
        let n = self.likeness.len();
        let sums = |values: &[f32]| -> Vec<f32> {
            let mut sum = vec![0.0; n + 1];
            for (i, v) in values.iter().enumerate() {
                sum[i + 1] = sum[i] + v * STEP_MM;
            }
            sum
        };
        let (dense, muscle) = (sums(self.likeness), sums(self.muscle));
        let steps = |mm: f32| (mm / STEP_MM) as usize;
        let (near, far, width) = (steps(rule.dense_mm), steps(MUSCLE_MM), steps(EDGE_MM));
        let mut fat = 0.0f32;
        for i in 0..n {
            let h = height(i);
            if h >= FAT_FROM_MM {
                fat += (1.0 - self.likeness[i]) * STEP_MM;
            }
            let here = i + 1;
            let beyond = |sum: &[f32], reach: usize| sum[(here + reach).min(n)] - sum[here];
            let inside = dense[here] - dense[here.saturating_sub(width)];
            let edge = 0.5 * (inside - beyond(&dense, width));
            let enclosed = fat.min(FAT_CAP_MM) + FAT_BEYOND_CAP * (fat - FAT_CAP_MM).max(0.0);
            out[i] = rule.fat * enclosed
                + DENSE * beyond(&dense, near)
                + weights.muscle * beyond(&muscle, far)
                - weights.edge * edge.max(0.0);
            // Beyond the field nothing bars; the depth is NaN only there.
            if self.depth[i] < SKIN_MM {
                out[i] += BARRED;
            }
            if let Some(lung) = self.lung {
                out[i] += weights.lung * (lung + OVER_LUNG_MM - h).max(0.0);
            }
        }
    }
}

/// Height of the first fat plane outside the shell; NaN where there is none within 30 mm.
pub(crate) fn first_fat_plane(likeness: &[f32], depth: &[f32]) -> f32 {
    let need = (PLANE_MM / STEP_MM) as usize;
    (0..likeness.len() - need)
        .find(|&i| {
            let fat = likeness[i..i + need].iter().all(|&m| m < 0.35);
            height(i) >= 0.5 && depth[i] > SKIN_MM && fat
        })
        .map(height)
        .filter(|&h| h < 30.0)
        .unwrap_or(f32::NAN)
}

/// Height of the outer edge of the first muscle under the skin; NaN where there is none.
pub(crate) fn outermost_muscle(likeness: &[f32], depth: &[f32]) -> f32 {
    let need = (PLANE_MM / STEP_MM) as usize;
    (need..likeness.len())
        .rev()
        .find(|&i| depth[i] > SKIN_MM && likeness[i - need..i].iter().all(|&m| m > 0.65))
        .map_or(f32::NAN, height)
}

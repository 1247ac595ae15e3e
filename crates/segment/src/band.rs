//! The band outside the rib shell in which the wall is searched, along the rays.

use crate::aggregate::Costs;
use crate::noise::noise_hu;
use crate::plane::bilinear;
use crate::radial_map::RadialMap;
use crate::scan::{Heights, Scan};
use crate::smoothing::smoothed;

/// Heights searched: from `LOWEST_MM` outside the shell in steps of `STEP_MM`
/// (docs/SEGMENTATION.md, step 6).
pub(crate) const LOWEST_MM: f32 = -10.0;
pub(crate) const STEP_MM: f32 = 0.5;
/// Smoothing (sigma) per HU of noise, and its bounds, mm. Chosen, not measured.
const SMOOTH_MM_PER_HU: f32 = 0.02;
const SMOOTH_MM: (f32, f32) = (0.4, 1.2);
/// Rays in front: the sine of their angle to the side is below this. Chosen, not measured.
pub(crate) const FRONT: f32 = 0.2;

/// What lies along the rays, from `LOWEST_MM` outside the shell.
pub(crate) struct Band {
    /// HU; NaN beyond the field.
    pub(crate) hu: Costs,
    /// Distance to the skin, mm.
    pub(crate) depth: Costs,
}

impl Band {
    pub(crate) fn sample(scan: Scan<'_>, shell: &RadialMap, highest_mm: f32) -> Self {
        let (ni, body) = (scan.frame.size[0], scan.body);
        let heights = heights(((highest_mm - LOWEST_MM) / STEP_MM) as usize + 1);
        let sigma = smoothing_mm(scan);
        let image = |k| smoothed(scan.ct, scan.frame, k, sigma);
        let hu = scan.sample(shell, heights, image, |image, _, at| {
            let seen = bilinear(&body.field, ni, at, f32::from)? > 0.99;
            if seen { bilinear(image, ni, at, |v| v) } else { None }
        });
        let depth = |k| body.depth_slice(scan.frame, k);
        let depth = scan.sample(shell, heights, depth, |depth, _, at| {
            Some(bilinear(depth, ni, at, f32::from)? * 0.1)
        });
        Self { hu, depth }
    }

    pub(crate) fn levels(&self) -> usize {
        self.hu.levels
    }
}

/// Smoothing within the slice that suits the noise: every mm of it rounds off thin fat planes.
fn smoothing_mm(scan: Scan<'_>) -> f32 {
    (SMOOTH_MM_PER_HU * noise_hu(scan.ct, scan.frame, scan.body)).clamp(SMOOTH_MM.0, SMOOTH_MM.1)
}

/// The heights searched, so many.
pub(crate) fn heights(count: usize) -> Heights {
    Heights { lowest_mm: LOWEST_MM, step_mm: STEP_MM, count }
}

/// Height of a level above the shell, mm.
#[inline]
pub(crate) fn height(level: usize) -> f32 {
    LOWEST_MM + STEP_MM * level as f32
}

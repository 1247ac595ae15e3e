//! What the searches of a fit have in common.

/// Variance of residuals, (0.4 mm)², over some 60 that tell on their own.
pub(super) const PRIOR_MM2: f64 = 0.0027;
/// Reach of the loss at the end, mm.
pub(crate) const REACH_MM: f64 = 4.0;
/// A patient who seems to lean more than this, degrees, did not sit: of one who leaned 10 a lean of
/// 8 to 9 is found, of a gland four times as stiff as fat one of up to 16, and one who lay half, at
/// 38, was taken for one who leans 21 in the other rest state, with another modulus.
pub(super) const LEANS_DEG: f64 = 20.0;

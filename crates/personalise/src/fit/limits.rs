//! What the searches of a fit have in common.

/// Variance of residuals, (0.4 mm)², over some 60 that tell on their own.
pub(super) const PRIOR_MM2: f64 = 0.0027;
/// Reach of the loss at the end, mm.
pub(crate) const REACH_MM: f64 = 4.0;

//! Energy of a membrane that wrinkles rather than bear a compression.
//!
//! With α₁ ≥ α₂ the squared principal stretches of an incompressible neo-Hookean membrane in plane
//! stress, its energy over h μ is
//!
//! ½ (α₁ + α₂ + 1/(α₁ α₂) − 3) where it is taut: α₂ ≥ 1/√α₁,
//! ½ (α₁ + 2/√α₁ − 3) where it is wrinkled: only pulled, as narrow as it then becomes by itself,
//! 0 where it is slack: α₁ < 1.
//!
//! Source: Pipkin, The relaxed energy density for isotropic elastic membranes, IMA J. Appl. Math.
//! 36 (1986); for the taut part Green and Adkins, Large Elastic Deformations, 1960, ch. 4. The
//! stresses are continuous; their slopes jump where wrinkles begin. No stress is a compression, so
//! that the membrane makes no equilibrium unstable.

/// How far below the border of wrinkles skin still counts as taut: what rounding makes of skin at
/// rest.
const ROUNDING: f64 = 1e-12;

/// The energy W over h μ of two squared principal stretches, and its slopes. No units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TensionField {
    pub(crate) energy: f64,
    /// s₁ and s₂, sᵢ = 2 ∂W/∂αᵢ.
    pub(crate) pulls: [f64; 2],
    /// ∂s₁/∂α₁, ∂s₁/∂α₂, ∂s₂/∂α₂.
    pub(crate) slopes: [f64; 3],
    /// (s₁ − s₂) / (α₁ − α₂): what a turn of the principal directions costs.
    pub(crate) shear: f64,
}

impl TensionField {
    /// Of α₁ ≥ α₂ > 0.
    pub(crate) fn new(a1: f64, a2: f64) -> Self {
        if a2 * a1.sqrt() >= 1.0 - ROUNDING || a1.is_nan() {
            Self::taut(a1, a2)
        } else if a1 > 1.0 {
            Self::wrinkled(a1, a2)
        } else {
            Self::default()
        }
    }

    fn taut(a1: f64, a2: f64) -> Self {
        let thinned = 1.0 / (a1 * a2);
        Self {
            energy: 0.5 * (a1 + a2 + thinned - 3.0),
            pulls: [1.0 - thinned / a1, 1.0 - thinned / a2],
            slopes: [2.0 * thinned / (a1 * a1), thinned * thinned, 2.0 * thinned / (a2 * a2)],
            shear: thinned * thinned,
        }
    }

    /// Its pull is less than 3/2 (α₁ − 1), and α₂ < 1: the shear is bounded.
    fn wrinkled(a1: f64, a2: f64) -> Self {
        let root = a1.sqrt();
        let pull = 1.0 - 1.0 / (a1 * root);
        Self {
            energy: 0.5 * (a1 + 2.0 / root - 3.0),
            pulls: [pull, 0.0],
            slopes: [1.5 / (a1 * a1 * root), 0.0, 0.0],
            shear: pull / (a1 - a2),
        }
    }
}

#[cfg(test)]
#[path = "tension_field_tests.rs"]
mod tests;

//! W = μ/2b (e^{bQ} − 1): tissue that stiffens ever faster.
//!
//! Source: Demiray, A note on the elasticity of soft biological tissues, J. Biomech. 5 (1972) 309,
//! with Q in place of I₁ − 3 so that the stress-free state stays free of stress in compressible
//! tissue; the exponential without the second invariant of Veronda and Westmann, Mechanical
//! characterization of skin, J. Biomech. 3 (1970) 111.

use super::laws::{Number, Stretching};

/// b Q above which W is taken for infinite: e^500 is no energy that a solution has.
const FURTHEST: f64 = 500.0;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Exponential<S> {
    mu: S,
    b: S,
}

impl<S: Number> Stretching<S> for Exponential<S> {
    const STIFFENS: bool = true;

    fn new(mu: S, b: S) -> Self {
        Self { mu, b }
    }

    #[inline(always)]
    fn reaches(&self, q: S) -> bool {
        (S::all(FURTHEST) - self.b * q).all_positive()
    }

    #[inline(always)]
    fn energy(&self, q: S) -> S {
        S::all(0.5) * self.mu / self.b * (self.b * q).exp_m1()
    }

    #[inline(always)]
    fn shear(&self, q: S) -> S {
        self.mu * (S::all(1.0) + (self.b * q).exp_m1())
    }

    #[inline(always)]
    fn growth(&self, q: S) -> S {
        S::all(2.0) * self.b * self.shear(q)
    }
}

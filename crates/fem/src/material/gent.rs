//! W = −μ/2b ln(1 − bQ): tissue that cannot be stretched beyond Q = 1/b.
//!
//! Source: Gent, A new constitutive relation for rubber, Rubber Chem. Technol. 69 (1996) 59, whose
//! J_m is 1/b, with Q in place of I₁ − 3 so that the stress-free state stays free of stress in
//! compressible tissue.

use super::laws::{Number, Stretching};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Gent<S> {
    mu: S,
    b: S,
}

impl<S: Number> Gent<S> {
    /// 1 − bQ.
    #[inline(always)]
    fn left(&self, q: S) -> S {
        S::all(1.0) - self.b * q
    }
}

impl<S: Number> Stretching<S> for Gent<S> {
    const STIFFENS: bool = true;

    fn new(mu: S, b: S) -> Self {
        Self { mu, b }
    }

    #[inline(always)]
    fn reaches(&self, q: S) -> bool {
        self.left(q).all_positive()
    }

    #[inline(always)]
    fn energy(&self, q: S) -> S {
        S::all(-0.5) * self.mu / self.b * (S::all(-1.0) * self.b * q).ln_1p()
    }

    #[inline(always)]
    fn shear(&self, q: S) -> S {
        self.mu / self.left(q)
    }

    #[inline(always)]
    fn growth(&self, q: S) -> S {
        S::all(2.0) * self.b * self.shear(q) / self.left(q)
    }
}

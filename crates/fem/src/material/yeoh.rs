//! W = μ/2 (Q + b Q² / 2): tissue whose shear modulus grows evenly.
//!
//! Source: Yeoh, Some forms of the strain energy function for rubber, Rubber Chem. Technol. 66
//! (1993) 754, to the second order, with Q in place of I₁ − 3 so that the stress-free state stays
//! free of stress in compressible tissue.

use super::laws::{Number, Stretching};

#[derive(Clone, Copy, Debug)]
pub(crate) struct Yeoh<S> {
    mu: S,
    b: S,
}

impl<S: Number> Stretching<S> for Yeoh<S> {
    const STIFFENS: bool = true;

    fn new(mu: S, b: S) -> Self {
        Self { mu, b }
    }

    #[inline(always)]
    fn reaches(&self, _: S) -> bool {
        true
    }

    #[inline(always)]
    fn energy(&self, q: S) -> S {
        S::all(0.5) * self.mu * q * (S::all(1.0) + S::all(0.5) * self.b * q)
    }

    #[inline(always)]
    fn shear(&self, q: S) -> S {
        self.mu * (S::all(1.0) + self.b * q)
    }

    #[inline(always)]
    fn growth(&self, _: S) -> S {
        S::all(2.0) * self.b * self.mu
    }
}

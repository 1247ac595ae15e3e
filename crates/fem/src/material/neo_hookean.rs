//! W = μ Q / 2: the compressible neo-Hookean solid.
//!
//! Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, 2nd edition
//! 2008, section 6.4.3.

use super::laws::{Number, Stretching};

#[derive(Clone, Copy, Debug)]
pub(crate) struct NeoHookean<S> {
    mu: S,
}

impl<S: Number> Stretching<S> for NeoHookean<S> {
    const STIFFENS: bool = false;

    fn new(mu: S, _: S) -> Self {
        Self { mu }
    }

    #[inline(always)]
    fn reaches(&self, _: S) -> bool {
        true
    }

    #[inline(always)]
    fn energy(&self, q: S) -> S {
        self.mu * (S::all(0.5) * q)
    }

    #[inline(always)]
    fn shear(&self, _: S) -> S {
        self.mu
    }

    #[inline(always)]
    fn growth(&self, _: S) -> S {
        S::all(0.0)
    }
}

//! The isotropic laws Ψ = W(Q) + λ/2 (ln J)² that can be chosen.
//!
//! Q = tr FᵀF − 3 − 2 ln J is 0 where tissue is turned alone and positive elsewhere. W(Q) is μ Q / 2
//! at small strain, so every law there is the solid of the same Lamé parameters. A law is a file
//! with its W, its name in [`supine_record::Law`] and its line in [`by_law`].

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Sub};
use supine_space::Pack;

/// A number, or those of several elements.
pub(crate) trait Number:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + 'static
{
    /// The same number everywhere.
    fn all(value: f64) -> Self;
    /// ln (1 + x).
    fn ln_1p(self) -> Self;
    /// eˣ − 1.
    fn exp_m1(self) -> Self;
    /// Whether all are finite and above 0.
    fn all_positive(self) -> bool;
    /// Itself where it is above 0, else 0.
    fn positive_part(self) -> Self;
    /// 1 where it is above 0, else 0.
    fn above_zero(self) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn all(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        f64::ln_1p(self)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        f64::exp_m1(self)
    }

    #[inline(always)]
    fn all_positive(self) -> bool {
        self > 0.0 && self < f64::INFINITY
    }

    #[inline(always)]
    fn positive_part(self) -> Self {
        self.max(0.0)
    }

    #[inline(always)]
    fn above_zero(self) -> Self {
        f64::from(u8::from(self > 0.0))
    }
}

impl Number for Pack {
    #[inline(always)]
    fn all(value: f64) -> Self {
        Pack::all(value)
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        Pack::ln_1p(self)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        Pack::exp_m1(self)
    }

    #[inline(always)]
    fn all_positive(self) -> bool {
        Pack::all_positive(self)
    }

    #[inline(always)]
    fn positive_part(self) -> Self {
        Pack::max(self, Pack::ZERO)
    }

    #[inline(always)]
    fn above_zero(mut self) -> Self {
        for number in &mut self.0 {
            *number = if *number > 0.0 { 1.0 } else { 0.0 };
        }
        self
    }
}

/// W(Q) of a law and its slopes.
pub(crate) trait Stretching<S: Number>: Copy + Debug + Send + Sync + 'static {
    /// Whether W is other than proportional to Q.
    const STIFFENS: bool;

    /// That of the shear modulus μ (kPa) at small strain; `stiffening` is dW′/dQ over W′ there.
    fn new(shear_kpa: S, stiffening: S) -> Self;

    /// Whether tissue can be stretched as far as `q`.
    fn reaches(&self, q: S) -> bool;

    /// W, kPa.
    fn energy(&self, q: S) -> S;

    /// 2 W′, kPa: μ at small strain.
    fn shear(&self, q: S) -> S;

    /// 4 W″, kPa; at least 0.
    fn growth(&self, q: S) -> S;
}

/// Calls an expression with the type of a law as `$type`, for numbers `$number`.
macro_rules! by_law {
    ($law:expr, $number:ty, $type:ident => $body:expr) => {
        match $law {
            supine_record::Law::NeoHookean => {
                type $type = $crate::material::NeoHookean<$number>;
                $body
            }
            supine_record::Law::Exponential => {
                type $type = $crate::material::Exponential<$number>;
                $body
            }
            supine_record::Law::Gent => {
                type $type = $crate::material::Gent<$number>;
                $body
            }
            supine_record::Law::Yeoh => {
                type $type = $crate::material::Yeoh<$number>;
                $body
            }
        }
    };
}

pub(crate) use by_law;

//! Arithmetic on several numbers at once.
//!
//! Plain loops over fixed arrays, which the compiler turns into vector instructions where the
//! caller is compiled for them. No operation is fused, so every machine gives the same digits.

use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// Numbers of a [`Pack`].
pub const LANES: usize = 8;

/// One number of each of several things.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Pack(pub [f64; LANES]);

macro_rules! lanewise {
    ($trait:ident, $function:ident, $op:tt) => {
        impl $trait for Pack {
            type Output = Self;
            #[inline(always)]
            fn $function(mut self, other: Self) -> Self {
                for (a, b) in self.0.iter_mut().zip(other.0) {
                    *a $op b;
                }
                self
            }
        }
    };
}

lanewise!(Add, add, +=);
lanewise!(Sub, sub, -=);
lanewise!(Mul, mul, *=);
lanewise!(Div, div, /=);

macro_rules! each {
    ($($(#[$doc:meta])* $function:ident: $a:ident => $value:expr;)+) => {
        impl Pack {
            $($(#[$doc])*
            #[inline(always)]
            pub fn $function(mut self) -> Self {
                for number in &mut self.0 {
                    let $a = *number;
                    *number = $value;
                }
                self
            })+
        }
    };
}

// Written as loops: closures are not compiled for the instructions of the function they are called
// in.
each! {
    /// The whole number at or above each.
    ceil: a => a.ceil();
    /// The whole number at or below each.
    floor: a => a.floor();
    /// Each without its sign.
    abs: a => a.abs();
    /// 1 with the sign of each.
    sign: a => 1f64.copysign(a);
}

impl AddAssign for Pack {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Pack {
    /// 0 for each.
    pub const ZERO: Self = Self([0.0; LANES]);

    /// The same number for each.
    #[inline(always)]
    pub fn all(value: f64) -> Self {
        Self([value; LANES])
    }

    /// The smaller of each two; not that of the library, which asks for NaN.
    #[inline(always)]
    pub fn min(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = if *a < b { *a } else { b };
        }
        self
    }

    /// The greater of each two.
    #[inline(always)]
    pub fn max(mut self, other: Self) -> Self {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a = if *a > b { *a } else { b };
        }
        self
    }

    /// ln (1 + x) for x > −1, to two units of the last digit.
    ///
    /// 1 + x = 2^k m with m in [√½, √2); ln m = 2 artanh(f / (2 + f)), f = m − 1, by its series'
    /// best polynomial, and what rounding took from 1 + x is given back. Source: FreeBSD msun
    /// `e_log.c`, `s_log1p.c` (Sun Microsystems 1993).
    #[inline(always)]
    pub fn ln_1p(self) -> Self {
        const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
        const SERIES: [f64; 7] = [
            6.666_666_666_666_735e-1,
            3.999_999_999_940_942e-1,
            2.857_142_874_366_239e-1,
            2.222_219_843_214_978_4e-1,
            1.818_357_216_161_805e-1,
            1.531_383_769_920_937_3e-1,
            1.479_819_860_511_658_6e-1,
        ];
        /// Bits of √½: subtracted, they leave the exponent k.
        const ROOT: u64 = 0x3fe6_a09e_667f_3bcd;
        const MANTISSA: u64 = (1 << 52) - 1;
        let mut out = [0.0; LANES];
        for (out, x) in out.iter_mut().zip(self.0) {
            let whole = 1.0 + x;
            let bits = whole.to_bits().wrapping_sub(ROOT);
            // An arithmetic shift of 64 bits has no vector instruction before AVX-512.
            let exponent = ((bits >> 52) as i32) << 20 >> 20;
            let m = f64::from_bits((bits & MANTISSA).wrapping_add(ROOT));
            let k = f64::from(exponent);
            let lost = (x - (whole - 1.0)) / whole;
            let f = m - 1.0;
            let s = f / (2.0 + f);
            let z = s * s;
            let mut r = SERIES[6];
            for c in SERIES[..6].iter().rev() {
                r = r * z + c;
            }
            let half = 0.5 * f * f;
            let small = s * (half + z * r) + (k * LN2[1] + lost);
            *out = k * LN2[0] - ((half - small) - f);
        }
        Self(out)
    }

    /// eˣ − 1 for x up to 700, to four units of the last digit.
    ///
    /// x = k ln 2 + r with |r| ≤ ½ ln 2; eʳ − 1 by its power series to r¹³, whose next term is below
    /// half a unit of the last digit.
    #[inline(always)]
    pub fn exp_m1(self) -> Self {
        const LN2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
        /// 1/n! from 13 down to 2.
        const SERIES: [f64; 12] = [
            1.605_904_383_682_161_3e-10,
            2.087_675_698_786_809_7e-9,
            2.505_210_838_544_171_6e-8,
            2.755_731_922_398_589_3e-7,
            2.755_731_922_398_589e-6,
            2.480_158_730_158_73e-5,
            1.984_126_984_126_984e-4,
            1.388_888_888_888_889e-3,
            8.333_333_333_333_333e-3,
            4.166_666_666_666_666_4e-2,
            1.666_666_666_666_666_6e-1,
            0.5,
        ];
        let mut out = [0.0; LANES];
        for (out, x) in out.iter_mut().zip(self.0) {
            let k = (x * std::f64::consts::LOG2_E).round_ties_even();
            let r = (x - k * LN2[0]) - k * LN2[1];
            let mut sum = SERIES[0];
            for c in &SERIES[1..] {
                sum = sum * r + c;
            }
            let small = sum * r * r + r;
            // 2ᵏ by its exponent.
            let two = f64::from_bits((k as i32 as i64 + 1023) as u64 * (1 << 52));
            *out = two * small + (two - 1.0);
        }
        Self(out)
    }

    /// Each in single precision.
    #[inline(always)]
    pub fn single(self) -> [f32; LANES] {
        let mut single = [0.0; LANES];
        for (s, a) in single.iter_mut().zip(self.0) {
            *s = a as f32;
        }
        single
    }

    /// Whether each is above 0 and finite.
    #[inline(always)]
    pub fn all_positive(self) -> bool {
        let mut all = true;
        for v in self.0 {
            all &= v > 0.0 && v < f64::INFINITY;
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_logarithm_is_that_of_the_library(exponent in -40.0..6.0f64, below in any::<bool>()) {
            let size = 2f64.powf(exponent);
            let x = if below { -(size.min(0.999_999)) } else { size };
            let (ours, theirs) = (Pack::all(x).ln_1p(), x.ln_1p());
            prop_assert!(ours.0.iter().all(|v| v.to_bits() == ours.0[0].to_bits()));
            prop_assert!((ours.0[0] - theirs).abs() <= 4.0 * f64::EPSILON * theirs.abs(),
                "{x}: {} {theirs}", ours.0[0]);
        }
    }

    proptest! {
        #[test]
        fn the_exponential_is_that_of_the_library(exponent in -40.0..9.4f64, below in any::<bool>()) {
            let size = 2f64.powf(exponent);
            let x = if below { -(size.min(30.0)) } else { size };
            let (ours, theirs) = (Pack::all(x).exp_m1(), x.exp_m1());
            prop_assert!(ours.0.iter().all(|v| v.to_bits() == ours.0[0].to_bits()));
            prop_assert!((ours.0[0] - theirs).abs() <= 4.0 * f64::EPSILON * theirs.abs(),
                "{x}: {} {theirs}", ours.0[0]);
        }
    }

    #[test]
    fn nothing_has_no_logarithm() {
        assert_eq!(Pack::ZERO.ln_1p(), Pack::ZERO);
        assert!(Pack::all(1e-300).all_positive());
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut pack = Pack::all(1.0);
            pack.0[5] = bad;
            assert!(!pack.all_positive(), "{bad}");
        }
    }
}

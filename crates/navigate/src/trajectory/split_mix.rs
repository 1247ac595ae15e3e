//! Numbers that look random and are the same everywhere.

use std::f64::consts::TAU;

/// The generator SplitMix64: a counter that grows by a fixed odd number, each value of it stirred.
///
/// Source: Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA 2014.
#[derive(Clone, Debug)]
pub(crate) struct SplitMix(u64);

/// What the counter grows by: 2^64 over the golden ratio.
const STRIDE: u64 = 0x9E37_79B9_7F4A_7C15;

impl SplitMix {
    /// The sequence of a seed.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STRIDE);
        let stirred = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let stirred = (stirred ^ (stirred >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        stirred ^ (stirred >> 31)
    }

    /// Evenly spread over 0 <= u < 1: the upper 53 bits.
    pub(crate) fn even(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normally distributed with mean 0 and deviation 1, from two even ones (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let length = (-2.0 * (1.0 - self.even()).ln()).sqrt();
        length * (TAU * self.even()).cos()
    }

    /// Three of them.
    pub(crate) fn normals(&mut self) -> [f64; 3] {
        [self.normal(), self.normal(), self.normal()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bits_are_those_that_are_published() {
        let mut of_zero = SplitMix::new(0);
        assert_eq!(of_zero.bits(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(of_zero.bits(), 0x6E78_9E6A_A1B9_65F4);
        assert_eq!(of_zero.bits(), 0x06C4_5D18_8009_454F);
    }

    #[test]
    fn moments_of_the_draws_are_right() {
        let mut draws = SplitMix::new(1);
        let count = 20_000;
        let normal: Vec<f64> = (0..count).map(|_| draws.normal()).collect();
        let mean = normal.iter().sum::<f64>() / f64::from(count);
        let square = normal.iter().map(|x| x * x).sum::<f64>() / f64::from(count);
        // Four standard errors: 1/sqrt(n) and sqrt(2/n).
        assert!(mean.abs() < 4.0 / f64::from(count).sqrt(), "{mean}");
        assert!((square - 1.0).abs() < 4.0 * (2.0 / f64::from(count)).sqrt(), "{square}");
    }
}

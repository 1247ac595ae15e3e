//! How HU become stored values.

use crate::source::Source;
use rayon::prelude::*;

/// Stored value = (HU - intercept) with slope 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Encoding {
    /// Whether it is that of the source.
    pub(super) inherited: bool,
    pub(super) bits_stored: u16,
    pub(super) signed: bool,
    pub(super) intercept: i32,
}

impl Encoding {
    /// The encoding of the source where it is the same for all slices and holds the HU exactly;
    /// else 16 bits signed with intercept 0, which holds every HU.
    pub(super) fn choose(source: &Source, hu: &[i16]) -> Self {
        let first = &source.slices[0].slice;
        let (bits, signed) = (first.pixels.bits_stored, first.pixels.signed);
        let uniform = source.slices.iter().all(|s| {
            s.slice.pixels == first.pixels
                && s.slice.rescale == first.rescale
                && s.slice.padding == first.padding
        });
        let intercept = first.rescale.intercept;
        let whole = first.rescale.slope == 1.0 && intercept.fract() == 0.0 && intercept.abs() < 1e6;
        let ends = |part: &[i16]| {
            part.iter().fold((i16::MAX, i16::MIN), |(low, high), &v| (low.min(v), high.max(v)))
        };
        let join = |a: (i16, i16), b: (i16, i16)| (a.0.min(b.0), a.1.max(b.1));
        let (lowest, highest) =
            hu.par_chunks(1 << 16).map(ends).reduce(|| (i16::MAX, i16::MIN), join);
        let range = if signed { -(1 << (bits - 1))..1 << (bits - 1) } else { 0..1 << bits };
        let fits = |v: i32| range.contains(&(v - intercept as i32));
        let shape = first.pixels.bits_allocated == 16 && (12..=16).contains(&bits);
        if uniform && whole && shape && fits(lowest.into()) && fits(highest.into()) {
            return Self {
                inherited: true,
                bits_stored: bits,
                signed,
                intercept: intercept as i32,
            };
        }
        Self { inherited: false, bits_stored: 16, signed: true, intercept: 0 }
    }

    /// Pixel Data of a slice, little endian; signed values are extended to all 16 bits.
    pub(super) fn stored(&self, hu: &[i16]) -> Vec<u8> {
        let mut bytes = vec![0; 2 * hu.len()];
        for (pair, &v) in bytes.chunks_exact_mut(2).zip(hu) {
            pair.copy_from_slice(&(i32::from(v).wrapping_sub(self.intercept) as u16).to_le_bytes());
        }
        bytes
    }
}

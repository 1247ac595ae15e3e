//! Values counted in bins, and where most of them lie.

use rayon::prelude::*;
use std::ops::Range;
use supine_volume::slice_kernel;

/// Width of a bin, HU, and smoothing (sigma) before the highest is taken, bins.
const BIN_HU: f32 = 2.0;
const SMOOTH_BINS: f32 = 3.0;
/// The top holds this share of the highest bin and more. Chosen, not measured.
const TOP: f32 = 0.9;
/// Values that one thread counts at a time.
const CHUNK: usize = 1 << 16;

/// How many values lie in each bin of a range of HU. Whole numbers: their sums are exact in any
/// order.
#[derive(Clone, Debug)]
pub(crate) struct Histogram {
    from: f32,
    counts: Vec<f32>,
}

impl Histogram {
    /// Nothing counted yet.
    pub(crate) fn new(hu: &Range<f32>) -> Self {
        let bins = ((hu.end - hu.start) / BIN_HU) as usize;
        Self { from: hu.start, counts: vec![0.0; bins] }
    }

    /// Counts the values (HU) whose place `counts`.
    pub(crate) fn of(
        values: &[i16],
        hu: &Range<f32>,
        counts: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let of = |(chunk, values): (usize, &[i16])| {
            let mut out = Self::new(hu);
            for (n, &value) in values.iter().enumerate() {
                let value = f32::from(value);
                if hu.contains(&value) && counts(chunk * CHUNK + n) {
                    out.add(value);
                }
            }
            out
        };
        let chunks = values.par_chunks(CHUNK).enumerate().map(of);
        chunks.reduce(|| Self::new(hu), Self::with)
    }

    /// Counts a value; those out of the range do not count.
    #[inline]
    pub(crate) fn add(&mut self, value: f32) {
        let bin = ((value - self.from) / BIN_HU).floor();
        if bin >= 0.0 && (bin as usize) < self.counts.len() {
            self.counts[bin as usize] += 1.0;
        }
    }

    /// What both counted.
    pub(crate) fn with(mut self, other: Self) -> Self {
        self.counts.iter_mut().zip(other.counts).for_each(|(a, b)| *a += b);
        self
    }

    /// Middle of the top after smoothing, HU: of the bins about the highest that hold nearly as
    /// much. The highest one alone jumps about where the top is flat (measured: by 10 HU on a real
    /// CT of fatty muscle).
    pub(crate) fn mode(&self) -> f32 {
        let kernel = slice_kernel(SMOOTH_BINS);
        let last = self.counts.len() as isize - 1;
        let at = |n: isize| self.counts[n.clamp(0, last) as usize];
        let smooth = |n: isize| {
            let sides = kernel.iter().zip(0..).skip(1);
            sides.fold(kernel[0] * at(n), |sum, (w, d)| sum + w * (at(n - d) + at(n + d)))
        };
        let smoothed: Vec<f32> = (0..=last).map(smooth).collect();
        let mut best = 0;
        for (n, value) in smoothed.iter().enumerate() {
            if *value > smoothed[best] {
                best = n;
            }
        }
        let low = |n: &&f32| **n < TOP * smoothed[best];
        let before = smoothed[..best].iter().rev().take_while(|n| !low(n)).count();
        let after = smoothed[best..].iter().take_while(|n| !low(n)).count();
        self.from + BIN_HU * 0.5 * (2 * best + after - before) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_of_a_noisy_peak() {
        let counts: Vec<f32> = (0..55)
            .map(|n| (-0.5 * ((f64::from(n) - 28.0) / 5.0).powi(2)).exp() as f32 * 100.0)
            .enumerate()
            .map(|(n, v)| v + if n % 2 == 0 { 10.0 } else { 0.0 })
            .collect();
        let mode = Histogram { from: -160.0, counts }.mode();
        assert!((mode + 103.0).abs() < 3.0, "{mode}");
    }

    #[test]
    fn the_middle_of_a_flat_top_does_not_follow_its_ripples() {
        let with = |ripple: usize| {
            let height = |n: usize| if (20..31).contains(&n) { 100.0 } else { 30.0 };
            let counts = (0..50).map(|n| height(n) + if n == ripple { 8.0 } else { 0.0 });
            Histogram { from: 0.0, counts: counts.collect() }.mode()
        };
        for ripple in [22, 25, 28] {
            assert!((with(ripple) - 51.0).abs() <= 1.0, "{ripple}: {}", with(ripple));
        }
    }

    #[test]
    fn only_values_of_the_range_and_of_the_place_count() {
        let values = [-200, -100, -100, -99, 0, -100, 300];
        let counted = Histogram::of(&values, &(-160.0..-50.0), |n| n != 5);
        assert_eq!(counted.counts.iter().sum::<f32>(), 3.0);
        assert_eq!(counted.mode(), -99.0);
    }
}

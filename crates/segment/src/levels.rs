//! The levels of fat and muscle in this scan.

use crate::Error;
use crate::band::{Band, height};
use crate::radial_map::{RAYS, Rays};
use rayon::prelude::*;
use supine_volume::slice_kernel;

/// Search ranges of the two modes, HU. Measured: fat -97 to -111, muscle 46 to 54, 32 beside an effusion
/// (reference, sections 4 and 9).
const FAT_HU: (i32, i32) = (-160, -50);
const MUSCLE_HU: (i32, i32) = (15, 110);
/// Least difference that allows to tell them apart, HU. Chosen, not measured.
pub(crate) const MIN_CONTRAST_HU: f32 = 60.0;

/// No muscle is denser than its mode by more than this, HU (reference, section 4, step 6).
const DENSEST_HU: f32 = 60.0;

/// From muscle to gland, HU (the same).
const SPAN_HU: f32 = 10.0;
/// Tissue nearer to muscle than this share of the way from fat is not fat in part. Measured: at 0.5 a thin pectoralis
/// counts as gland, at 0.9 gland as muscle.
const DENSE_SHARE: f32 = 0.8;

/// Levels of this scan, HU.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Levels {
    pub(crate) fat: f32,
    pub(crate) muscle: f32,
}

impl Levels {
    /// Fat: mode in front of the shell. Muscle: mode of the back muscles, for in front thin muscle
    /// and effusion drag the mode down.
    pub(crate) fn measure(band: &Band, rays: &Rays) -> Result<Self, Error> {
        let pick = |wanted: &(dyn Fn(usize, f32, f32) -> bool + Sync), range: (i32, i32)| {
            let none = || vec![0.0f32; ((range.1 - range.0) / 2) as usize];
            let levels = band.levels();
            let count = |mut bins: Vec<f32>, (n, (hu, depth)): (usize, (&[f32], &[f32]))| {
                for (level, (&v, &depth)) in hu.iter().zip(depth).enumerate() {
                    if !wanted(n % RAYS, height(level), depth) {
                        continue;
                    }
                    let bin = ((v - range.0 as f32) / 2.0).floor();
                    if bin >= 0.0 && (bin as usize) < bins.len() {
                        bins[bin as usize] += 1.0;
                    }
                }
                bins
            };
            let (hu, depth) = (&band.hu.values, &band.depth.values);
            let rays = hu.par_chunks(levels).zip(depth.par_chunks(levels)).enumerate();
            mode(&rays.fold(none, count).reduce(none, added), range.0 as f32)
        };
        let front = |p: usize, _h: f32, depth: f32| rays.to_back[p] < 0.1 && depth > 4.0;
        let back = |p: usize, h: f32, depth: f32| {
            rays.to_back[p] > 0.5 && h > 0.0 && h < 25.0 && depth > 6.0
        };
        let levels = Self { fat: pick(&front, FAT_HU), muscle: pick(&back, MUSCLE_HU) };
        if levels.muscle - levels.fat < MIN_CONTRAST_HU {
            return Err(Error::NoContrast {
                fat_hu: levels.fat.into(),
                muscle_hu: levels.muscle.into(),
            });
        }
        Ok(levels)
    }

    /// Half-way between fat and muscle, HU.
    pub(crate) fn middle(self) -> f32 {
        0.5 * (self.fat + self.muscle)
    }

    /// 0 for fat, 1 for muscle, linear between.
    pub(crate) fn likeness(self, hu: f32) -> f32 {
        ((hu - self.fat) / (self.muscle - self.fat)).clamp(0.0, 1.0)
    }

    /// HU of dense soft tissue: no bone, and no fat in part.
    pub(crate) fn dense(self) -> std::ops::Range<i16> {
        let least = self.fat + DENSE_SHARE * (self.muscle - self.fat);
        least as i16..(self.muscle + DENSEST_HU) as i16
    }

    /// Whether tissue of this mean HU is muscle: 1 within `below`..+60 HU of the muscle, falling to 0 at 10 HU less.
    pub(crate) fn true_muscle(self, hu: f32, below: f32) -> f32 {
        if hu < self.muscle + DENSEST_HU {
            ((hu - self.muscle + below) / SPAN_HU + 1.0).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Whether it is gland: what is too soft for muscle.
    pub(crate) fn gland(self, hu: f32, below: f32) -> f32 {
        ((self.muscle - below - hu) / SPAN_HU).clamp(0.0, 1.0)
    }
}

/// Mode of the fat among the values (HU) whose place `counts`.
pub(crate) fn fat_mode(values: &[i16], counts: impl Fn(usize) -> bool + Sync) -> f32 {
    let none = || vec![0.0f32; ((FAT_HU.1 - FAT_HU.0) / 2) as usize];
    let count = |(chunk, values): (usize, &[i16])| {
        let mut bins = none();
        for (n, &value) in values.iter().enumerate() {
            let off = i32::from(value) - FAT_HU.0;
            if (0..FAT_HU.1 - FAT_HU.0).contains(&off) && counts(chunk * CHUNK + n) {
                bins[(off / 2) as usize] += 1.0;
            }
        }
        bins
    };
    let bins = values.par_chunks(CHUNK).enumerate().map(count).reduce(none, added);
    mode(&bins, FAT_HU.0 as f32)
}

/// Values that one thread counts at a time.
const CHUNK: usize = 1 << 16;

/// The sums of counts: whole numbers, exact in any order.
fn added(mut a: Vec<f32>, b: Vec<f32>) -> Vec<f32> {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
    a
}

/// Centre of the highest bin (2 HU) after smoothing by 3 bins.
fn mode(bins: &[f32], from: f32) -> f32 {
    let kernel = slice_kernel(3.0);
    let at = |n: isize| bins[n.clamp(0, bins.len() as isize - 1) as usize];
    let smooth = |n: usize| {
        kernel.iter().enumerate().skip(1).fold(kernel[0] * bins[n], |sum, (d, w)| {
            sum + w * (at(n as isize - d as isize) + at(n as isize + d as isize))
        })
    };
    let mut best = (0, f32::NEG_INFINITY);
    for n in 0..bins.len() {
        let value = smooth(n);
        if value > best.1 {
            best = (n, value);
        }
    }
    from + 2.0 * best.0 as f32 + 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mode_of_a_noisy_peak() {
        let bins: Vec<f32> = (0..55)
            .map(|n| (-0.5 * ((f64::from(n) - 28.0) / 5.0).powi(2)).exp() as f32 * 100.0)
            .enumerate()
            .map(|(n, v)| v + if n % 2 == 0 { 10.0 } else { 0.0 })
            .collect();
        assert!((mode(&bins, -160.0) + 103.0).abs() < 3.0);
    }
}

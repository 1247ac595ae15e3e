//! One number per ray: a surface round the axis of the thorax, or any other fact about its rays.

use crate::frame::Frame;
use rayon::prelude::*;
use supine_volume::{median, ranked, slice_kernel, weigh};

/// Rays per turn (docs/SEGMENTATION.md, Why a surface).
pub(crate) const RAYS: usize = 360;

/// Radii searched: from `START_MM` in steps of 1 mm (the same, step 4); the ends were chosen, not
/// measured.
pub(crate) const START_MM: f32 = 30.0;
pub(crate) const RADII: usize = 210;

/// A value per (slice, ray), ray fastest; the rays close a ring.
#[derive(Clone, Debug)]
pub(crate) struct RadialMap {
    pub(crate) values: Vec<f32>,
}

impl RadialMap {
    pub(crate) fn new(slices: usize, value: f32) -> Self {
        Self { values: vec![value; slices * RAYS] }
    }

    pub(crate) fn slices(&self) -> usize {
        self.values.len() / RAYS
    }

    #[inline]
    pub(crate) fn at(&self, k: usize, p: usize) -> f32 {
        self.values[k * RAYS + p]
    }

    /// A map of `f(k, p)`.
    pub(crate) fn from_fn(slices: usize, f: impl Fn(usize, usize) -> f32 + Sync) -> Self {
        let values = (0..slices * RAYS).into_par_iter().map(|n| f(n / RAYS, n % RAYS)).collect();
        Self { values }
    }

    /// The sum with another map.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self { values: self.values.iter().zip(&other.values).map(|(a, b)| a + b).collect() }
    }

    /// The known (not NaN) values within `dk` slices and `dp` rays.
    fn around(&self, k: usize, p: usize, dk: usize, dp: usize, out: &mut Vec<f32>) {
        out.clear();
        // Two stretches where the window goes over the end of the ring.
        let (first, count) = ((p + RAYS - dp) % RAYS, 2 * dp + 1);
        let before = count.min(RAYS - first);
        for row in k.saturating_sub(dk)..(k + dk + 1).min(self.slices()) {
            let ring = &self.values[row * RAYS..(row + 1) * RAYS];
            let window = ring[first..first + before].iter().chain(&ring[..count - before]);
            out.extend(window.filter(|value| !value.is_nan()));
        }
    }

    /// `of` the known values in the window of 2 dk + 1 slices and 2 dp + 1 rays; NaN where there
    /// are none.
    pub(crate) fn window(
        &self,
        dk: usize,
        dp: usize,
        of: impl Fn(&mut [f32]) -> f32 + Sync,
    ) -> Self {
        let mut out = Self::new(self.slices(), f32::NAN);
        out.values.par_chunks_mut(RAYS).enumerate().for_each(|(k, out)| {
            let mut near = Vec::new();
            for (p, out) in out.iter_mut().enumerate() {
                self.around(k, p, dk, dp, &mut near);
                *out = if near.is_empty() { f32::NAN } else { of(&mut near) };
            }
        });
        out
    }

    /// Median over the window of 2 dk + 1 slices and 2 dp + 1 rays.
    pub(crate) fn median(&self, dk: usize, dp: usize) -> Self {
        self.window(dk, dp, |near| median(near).unwrap_or(f32::NAN))
    }

    /// Largest value within `dk` slices and `dp(k, p)` rays.
    pub(crate) fn widened(&self, dk: usize, dp: impl Fn(usize, usize) -> usize + Sync) -> Self {
        Self::from_fn(self.slices(), |k, p| {
            let dp = dp(k, p).min(RAYS / 2);
            let rows = k.saturating_sub(dk)..(k + dk + 1).min(self.slices());
            let ring = |d: usize| (p + RAYS + d - dp) % RAYS;
            rows.flat_map(|row| (0..2 * dp + 1).map(move |d| self.at(row, ring(d))))
                .fold(f32::NEG_INFINITY, f32::max)
        })
    }

    /// Taken as radii (mm): length of a turn by one ray, mm.
    pub(crate) fn arc(&self, k: usize, p: usize) -> f32 {
        self.at(k, p).max(1.0) * std::f32::consts::TAU / RAYS as f32
    }

    /// Gaussian (sigma in slices and rays); the first and last slice continue outside.
    pub(crate) fn smooth(&self, slices: f32, rays: f32) -> Self {
        let (kz, kp) = (slice_kernel(slices), slice_kernel(rays));
        let nz = self.slices();
        let ring = |k: usize| k * RAYS..(k + 1) * RAYS;
        let mut along = Self::new(nz, 0.0);
        along.values.par_chunks_exact_mut(RAYS).enumerate().for_each(|(k, out)| {
            // The ring goes on over both ends, so that the rays to both sides of all rays are
            // slices of memory.
            let reach = kp.len() - 1;
            let from = RAYS - reach % RAYS;
            let around = self.values[ring(k)].iter().cycle().skip(from);
            let around: Vec<f32> = around.take(RAYS + 2 * reach).copied().collect();
            weigh(out, &kp, |d| (&around[reach - d..], &around[reach + d..]));
        });
        let mut out = Self::new(nz, 0.0);
        out.values.par_chunks_exact_mut(RAYS).enumerate().for_each(|(k, out)| {
            let below = |d: usize| &along.values[ring(k.saturating_sub(d))];
            let above = |d: usize| &along.values[ring((k + d).min(nz - 1))];
            weigh(out, &kz, |d| (below(d), above(d)));
        });
        out
    }

    /// The 40th percentile of the known values within 10 mm of z and 5 degrees where a quarter of
    /// the window is known, spread over the rest by growing Gaussians; `fallback` when nothing is
    /// known at all.
    pub(crate) fn filled(&self, slice_mm: f32, fallback: f32) -> Self {
        let dk = ((10.0 / slice_mm) as usize).max(1);
        let dp = 5 * RAYS / 360;
        let nz = self.slices();
        let known = Self::from_fn(nz, |k, p| {
            let mut near = Vec::new();
            self.around(k, p, dk, dp, &mut near);
            if 4 * near.len() < (2 * dk + 1) * (2 * dp + 1) {
                return f32::NAN;
            }
            let rank = near.len() * 2 / 5;
            ranked(&mut near, rank).unwrap_or(f32::NAN)
        });
        let weight = Self { values: known.values.iter().map(|v| f32::from(!v.is_nan())).collect() };
        let value = Self {
            values: known.values.iter().map(|v| if v.is_nan() { 0.0 } else { *v }).collect(),
        };
        let mut out = Self::new(nz, f32::NAN);
        for rays in [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0f32] {
            if !out.values.iter().any(|v| v.is_nan()) {
                break;
            }
            let rays = rays * RAYS as f32 / 360.0;
            let slices = rays * 2.5 / slice_mm;
            let (w, v) = (weight.smooth(slices, rays), value.smooth(slices, rays));
            for n in 0..out.values.len() {
                if out.values[n].is_nan() && w.values[n] > 0.15 {
                    out.values[n] = v.values[n] / w.values[n];
                }
            }
        }
        let mut all: Vec<f32> = out.values.iter().copied().filter(|v| !v.is_nan()).collect();
        let rest = median(&mut all).unwrap_or(fallback);
        out.values.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = rest);
        out
    }
}

/// The rays: from the axis of the thorax within each slice.
#[derive(Clone, Debug)]
pub(crate) struct Rays {
    /// Where the axis meets each slice, mm.
    pub(crate) axis: Vec<[f32; 2]>,
    /// Direction of each ray within the slice; ray 0 to the left, a quarter turn on to the back.
    pub(crate) directions: Vec<[f32; 2]>,
    /// Sine of the angle: 1 to the back, -1 to the front.
    pub(crate) to_back: Vec<f32>,
    pixels_per_mm: [f32; 2],
    left: [f32; 2],
    back: [f32; 2],
}

impl Rays {
    pub(crate) fn new(frame: &Frame, axis: Vec<[f32; 2]>) -> Self {
        let angles = (0..RAYS).map(|p| std::f32::consts::TAU * p as f32 / RAYS as f32);
        let direction = |a: f32| [0, 1].map(|c| a.cos() * frame.left[c] + a.sin() * frame.back[c]);
        Self {
            axis,
            directions: angles.clone().map(direction).collect(),
            to_back: angles.map(f32::sin).collect(),
            pixels_per_mm: [1.0 / frame.spacing[0], 1.0 / frame.spacing[1]],
            left: frame.left,
            back: frame.back,
        }
    }

    /// Pixel coordinates of the point at radius r (mm) on a ray.
    #[inline]
    pub(crate) fn pixel(&self, k: usize, p: usize, r: f32) -> [f32; 2] {
        [0, 1].map(|c| (self.axis[k][c] + r * self.directions[p][c]) * self.pixels_per_mm[c])
    }

    /// Squared distance (mm²) of a position (mm) in a slice from the axis.
    #[inline]
    pub(crate) fn squared_radius(&self, k: usize, [x, y]: [f32; 2]) -> f32 {
        (x - self.axis[k][0]).powi(2) + (y - self.axis[k][1]).powi(2)
    }

    /// Radius (mm) and angle (in rays, 0..RAYS) of a position (mm) in a slice.
    #[inline]
    pub(crate) fn polar(&self, k: usize, [x, y]: [f32; 2]) -> (f32, f32) {
        let (x, y) = (x - self.axis[k][0], y - self.axis[k][1]);
        let l = x * self.left[0] + y * self.left[1];
        let b = x * self.back[0] + y * self.back[1];
        ((l * l + b * b).sqrt(), turn(l, b) * RAYS as f32)
    }
}

/// Angle of (x, y) in turns, 0..1, to 2e-6 of a turn: the same on every machine, and many times
/// faster than the library's.
///
/// Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.
#[inline]
fn turn(x: f32, y: f32) -> f32 {
    let (along, across) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    let t = across / along.max(f32::MIN_POSITIVE);
    let s = t * t;
    let series =
        0.999_866 + s * (-0.330_299_5 + s * (0.180_141 + s * (-0.085_133 + s * 0.020_835_1)));
    let eighth = t * series / std::f32::consts::TAU;
    let quarter = if y.abs() > x.abs() { 0.25 - eighth } else { eighth };
    let half = if x < 0.0 { 0.5 - quarter } else { quarter };
    let whole = if y < 0.0 { 1.0 - half } else { half };
    if whole < 1.0 { whole } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_agree_with_the_arc_tangent() {
        for n in 0..7200 {
            let (y, x) = (f64::from(n) * std::f64::consts::TAU / 7200.0).sin_cos();
            let got = f64::from(turn(40.0 * x as f32, 40.0 * y as f32));
            let off = (got - f64::from(n) / 7200.0 + 0.5).rem_euclid(1.0) - 0.5;
            assert!((0.0..1.0).contains(&got) && off.abs() < 3e-6, "{n}: {got}");
        }
        assert!(turn(0.0, 0.0) == 0.0 && turn(1.0, -1e-20) == 0.0);
    }

    #[test]
    fn a_gaussian_is_that_of_its_single_rays_to_the_bit() {
        let map = RadialMap::from_fn(7, |k, p| ((k * 31 + p * p) % 101) as f32 / 7.0);
        for (slices, rays) in [(0.0, 1.0), (3.0, 0.0), (2.5, 32.0), (1.0, 121.0)] {
            let (kz, kp) = (slice_kernel(slices), slice_kernel(rays));
            let ring = |p: usize, d: usize| [(p + 2 * RAYS - d) % RAYS, (p + d) % RAYS];
            let along = RadialMap::from_fn(7, |k, p| {
                kp.iter().enumerate().skip(1).fold(kp[0] * map.at(k, p), |sum, (d, w)| {
                    let [left, right] = ring(p, d);
                    sum + w * (map.at(k, left) + map.at(k, right))
                })
            });
            let both = RadialMap::from_fn(7, |k, p| {
                kz.iter().enumerate().skip(1).fold(kz[0] * along.at(k, p), |sum, (d, w)| {
                    sum + w * (along.at(k.saturating_sub(d), p) + along.at((k + d).min(6), p))
                })
            });
            assert!(map.smooth(slices, rays).values == both.values, "{slices} {rays}");
        }
    }

    #[test]
    fn gaps_are_filled_from_their_surroundings_and_the_ring_closes() {
        let full = RadialMap::from_fn(20, |_, p| {
            10.0 + 3.0 * (p as f32 / RAYS as f32 * std::f32::consts::TAU).sin()
        });
        let mut holed = full.clone();
        for k in 0..20 {
            for p in (0..20).chain(RAYS - 20..RAYS) {
                holed.values[k * RAYS + p] = f32::NAN;
            }
        }
        let filled = holed.filled(2.5, 0.0);
        for n in 0..full.values.len() {
            assert!((filled.values[n] - full.values[n]).abs() < 1.0, "{n}");
        }
        assert!(RadialMap::new(4, f32::NAN).filled(2.5, 8.0).values.iter().all(|&v| v == 8.0));
    }

    #[test]
    fn smoothing_keeps_a_constant_and_a_median_drops_a_spike() {
        let mut map = RadialMap::new(6, 4.0);
        assert!(map.smooth(1.5, 3.0).values.iter().all(|v| (v - 4.0).abs() < 1e-4));
        map.values[2 * RAYS] = 40.0;
        assert!(map.median(1, 2).values.iter().all(|&v| v == 4.0));
    }
}

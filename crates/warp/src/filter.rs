//! Values between voxels: how they are interpolated, and averages where tissue is squeezed.

use crate::kernel::Source;
use crate::predicate::Index;
use crate::pullback::Pullback;

/// How values between voxels are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Interpolation {
    /// Trilinear: of the 8 voxels around. Smooths edges and noise.
    Linear,
    /// Cubic convolution of 4 voxels along each axis, a = -1/2 (Keys, IEEE Trans. Acoust. Speech
    /// Signal Process. 29, 1981, 1153).
    #[default]
    Cubic,
    /// Windowed sinc of 6 voxels along each axis, with weights that sum to one (Duchon, J. Appl.
    /// Meteorol. 18, 1979, 1016).
    Lanczos3,
}

impl Interpolation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Linear, Self::Cubic, Self::Lanczos3];

    /// Name in case files, on the command line, in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Cubic => "cubic",
            Self::Lanczos3 => "lanczos3",
        }
    }
}

/// Voxels along an axis that the widest filter takes.
const WIDEST: usize = 6;
/// Most samples along an axis of a voxel.
const MAX_SAMPLES: f64 = 4.0;

impl Interpolation {
    /// Voxels along an axis.
    fn width(self) -> usize {
        match self {
            Self::Linear => 2,
            Self::Cubic => 4,
            Self::Lanczos3 => WIDEST,
        }
    }

    /// Weights of the voxels around a place `t` after the middle one to the left; they sum to one.
    fn weights(self, t: f64) -> [f64; WIDEST] {
        let mut weights = [0.0; WIDEST];
        let before = self.width() / 2 - 1;
        for (n, weight) in weights.iter_mut().enumerate().take(self.width()) {
            *weight = self.weight((t + before as f64 - n as f64).abs());
        }
        let sum: f64 = weights.iter().sum();
        weights.map(|weight| weight / sum)
    }

    /// Weight of a voxel at distance `x`.
    fn weight(self, x: f64) -> f64 {
        match self {
            Self::Linear => (1.0 - x).max(0.0),
            Self::Cubic if x < 1.0 => (1.5 * x - 2.5) * x * x + 1.0,
            Self::Cubic if x < 2.0 => ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0,
            Self::Lanczos3 if x < 3.0 => sinc(x) * sinc(x / 3.0),
            Self::Cubic | Self::Lanczos3 => 0.0,
        }
    }
}

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x < 1e-9 { 1.0 } else { x.sin() / x }
}

/// The value at a continuous index, held within the volume; beyond its edges the outermost voxels
/// go on.
///
/// Cubic and Lanczos filters overshoot beside edges: their values are held within those of the
/// voxels that they take, so that beside the skin no tissue is darker than air and none denser than
/// the densest near by.
pub(crate) fn value(source: &Source<'_>, interpolation: Interpolation, q: Index) -> f64 {
    let size = source.size();
    let width = interpolation.width();
    let (mut weights, mut places) = ([[0.0; WIDEST]; 3], [[0usize; WIDEST]; 3]);
    for a in 0..3 {
        let last = size[a] - 1;
        let x = q[a].clamp(0.0, last as f64);
        let cell = (x as usize).min(last - 1);
        weights[a] = interpolation.weights(x - cell as f64);
        let first = cell as isize - (width as isize / 2 - 1);
        for (n, place) in places[a].iter_mut().enumerate() {
            *place = (first + n as isize).clamp(0, last as isize) as usize;
        }
    }
    let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
    for (z, k) in weights[2].iter().zip(places[2]).take(width) {
        for (y, j) in weights[1].iter().zip(places[1]).take(width) {
            let row = (k * size[1] + j) * size[0];
            for (x, i) in weights[0].iter().zip(places[0]).take(width) {
                let value = f64::from(source.data()[row + i]);
                sum += z * y * x * value;
                low = value.min(low);
                high = value.max(high);
            }
        }
    }
    sum.clamp(low, high)
}

/// The HU of the voxel `p` of the deformed volume: the mean of `samples`³ values within it.
pub(crate) fn mean(
    source: &Source<'_>,
    interpolation: Interpolation,
    pullback: &Pullback,
    p: Index,
    samples: usize,
) -> i16 {
    let (centre, slopes) = (pullback.at(p), pullback.affine(p).1);
    // Samples may lie beyond the tetrahedron, where the tissue goes on; one that is flat has no
    // slopes.
    let places = offsets(samples).map(|d| {
        let aside = slopes.map(|s| s[0] * d[0] + s[1] * d[1] + s[2] * d[2]);
        let known = aside.iter().all(|v| v.abs() < WIDEST as f64);
        if known { [0, 1, 2].map(|a| centre[a] + aside[a]) } else { centre }
    });
    let sum: f64 = places.map(|q| value(source, interpolation, q)).sum();
    (sum / samples.pow(3) as f64).round_ties_even() as i16
}

/// Where the `samples`³ samples of a voxel lie, from its centre.
pub(crate) fn offsets(samples: usize) -> impl Iterator<Item = [f64; 3]> {
    let offset = move |n: usize| (n as f64 + 0.5) / samples as f64 - 0.5;
    (0..samples.pow(3))
        .map(move |n| [n % samples, n / samples % samples, n / (samples * samples)].map(offset))
}

/// Samples along each axis of a voxel in tissue of volume ratio `det`: one where it is at least
/// `below`, else as many as voxels of the CT are squeezed into one.
pub(crate) fn samples(det: f64, below: f64) -> usize {
    if det >= below {
        return 1;
    }
    // Tissue turned inside out has no ratio.
    let along = det.max(0.0).powf(-1.0 / 3.0).ceil();
    along.clamp(2.0, MAX_SAMPLES) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 3] = [9, 8, 7];

    fn volume(value: impl Fn([f64; 3]) -> f64) -> Vec<i16> {
        let of = |n: usize| {
            let place = [n % SIZE[0], n / SIZE[0] % SIZE[1], n / (SIZE[0] * SIZE[1])];
            value(place.map(|v| v as f64)).round() as i16
        };
        (0..SIZE.iter().product()).map(of).collect()
    }

    #[test]
    fn voxels_keep_their_values_and_constants_stay() {
        let data = volume(|[i, j, k]| (i * 7.0 + j * 13.0 + k * 29.0) % 17.0);
        let source = Source::new(&data, SIZE);
        let even = vec![37; data.len()];
        for interpolation in Interpolation::ALL {
            for (n, own) in data.iter().enumerate() {
                let place = [n % SIZE[0], n / SIZE[0] % SIZE[1], n / (SIZE[0] * SIZE[1])];
                let got = value(&source, interpolation, place.map(|v| v as f64));
                assert!((got - f64::from(*own)).abs() < 1e-9, "{interpolation:?} {place:?}");
            }
            let got = value(&Source::new(&even, SIZE), interpolation, [3.3, 2.7, 4.1]);
            assert!((got - 37.0).abs() < 1e-9);
        }
    }

    /// Cubic convolution is exact for polynomials of degree 2 (Keys 1981), the trilinear value for
    /// degree 1.
    #[test]
    fn polynomials_are_as_exact_as_the_filters_promise() {
        let data = volume(|[i, j, k]| 4.0 * i * i - 8.0 * j + 12.0 * j * k);
        let source = Source::new(&data, SIZE);
        let q = [4.25, 3.5, 2.75];
        let exact = 4.0 * q[0] * q[0] - 8.0 * q[1] + 12.0 * q[1] * q[2];
        assert!((value(&source, Interpolation::Cubic, q) - exact).abs() < 1e-9);
        // Between two voxels the chord of 4 x² is 4 t (1 - t) above it.
        let linear = value(&source, Interpolation::Linear, q);
        assert!((linear - exact - 4.0 * 0.25 * 0.75).abs() < 1e-9);
        assert!((value(&source, Interpolation::Lanczos3, q) - exact).abs() < 0.6);
    }

    #[test]
    fn beside_an_edge_nothing_overshoots() {
        let data = volume(|[i, ..]| if i < 4.0 { -1000.0 } else { 50.0 });
        let source = Source::new(&data, SIZE);
        for interpolation in Interpolation::ALL {
            for n in 0..=80 {
                let got = value(&source, interpolation, [f64::from(n) * 0.1, 3.4, 2.2]);
                assert!((-1000.0..=50.0).contains(&got), "{interpolation:?} {n}: {got}");
            }
        }
    }

    #[test]
    fn squeezed_tissue_is_averaged() {
        assert_eq!(
            [1.0, 0.7, 0.69, 0.126, 0.1, 0.0, -1.0].map(|d| samples(d, 0.7)),
            [1, 1, 2, 2, 3, 4, 4]
        );
        // A checkerboard at half its size: each voxel takes in two of each along every axis.
        let data = volume(|[i, j, k]| if (i + j + k) % 2.0 > 0.5 { 100.0 } else { 0.0 });
        let source = Source::new(&data, SIZE);
        let rest = [[0.0, 0.0, 0.0], [8.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 6.0]];
        let deformed = rest.map(|c: Index| c.map(|v| 0.5 * v));
        let pullback = Pullback::new(deformed, rest);
        let (p, linear) = ([1.0, 1.0, 0.5], Interpolation::Linear);
        assert_eq!(mean(&source, linear, &pullback, p, 1), 100);
        assert_eq!(mean(&source, linear, &pullback, p, 2), 50);
    }
}

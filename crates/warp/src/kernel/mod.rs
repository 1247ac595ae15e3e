//! Trilinear samples of many voxels of one tetrahedron, in f32 about points near by.
//!
//! [`scalar`] says what is to be computed, operation by operation; `avx2` does the same for eight voxels at
//! once. All give the same bits: products and sums are fused everywhere.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod scalar;

#[cfg(test)]
mod tests;

use crate::pullback::Pullback;
use crate::rows::{least, most};

/// Voxels are given in numbers that are a multiple of this.
pub(crate) const LANES: usize = 8;
/// Bits of the place of a voxel within a tetrahedron's part of a slab: along i, j and k.
const PLACE_BITS: [u32; 3] = [13, 13, 6];
/// Longest axis along i and j, voxels.
pub(crate) const LONGEST: usize = 1 << PLACE_BITS[0];

/// A volume that is sampled.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    data: &'a [i16],
    size: [usize; 3],
}

/// The affine map of a tetrahedron from whole places in its box to the volume's indices, relative to a voxel
/// of the volume.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Local {
    /// Of the sampled volume: the place of the voxel to which all is relative.
    start: usize,
    /// Steps of a row and of a slice.
    steps: [i32; 2],
    /// Index at place (0, 0, 0), and its change along i, j, k.
    constant: [f32; 3],
    slopes: [[f32; 3]; 3],
    /// Where results are held; within the volume.
    low: [f32; 3],
    high: [f32; 3],
    /// The last cell along each axis.
    last: [i32; 3],
}

/// A voxel that is to be sampled, relative to the origin of its [`Local`].
#[derive(Clone, Copy, Debug, Default)]
#[repr(transparent)]
pub(crate) struct Place(u32);

/// How samples are computed; the fastest that the machine has, or for tests any.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kernel {
    Scalar,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Kernel {
    /// The fastest.
    pub(crate) fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx2::is_there() {
            return Self::Avx2;
        }
        Self::Scalar
    }

    /// All that the machine has.
    #[cfg(test)]
    pub(crate) fn all() -> Vec<Self> {
        let mut all = vec![Self::Scalar];
        if Self::best() != Self::Scalar {
            all.push(Self::best());
        }
        all
    }

    /// The HU at `places`; their number and that of `values` is the same, a multiple of [`LANES`].
    #[inline]
    pub(crate) fn sample(
        self,
        source: &Source<'_>,
        local: &Local,
        places: &[Place],
        values: &mut [i16],
    ) {
        match self {
            Self::Scalar => scalar::sample(source, local, places, values),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::sample(source, local, places, values),
        }
    }
}

impl<'a> Source<'a> {
    /// `data` (i fastest) of `size` voxels, two or more along each axis.
    pub(crate) fn new(data: &'a [i16], size: [usize; 3]) -> Self {
        assert!(size.iter().all(|&n| n >= 2), "two voxels or more along each axis");
        assert_eq!(data.len(), size.iter().product::<usize>(), "as many values as voxels");
        Self { data, size }
    }

    /// Its values, i fastest.
    pub(crate) fn data(&self) -> &'a [i16] {
        self.data
    }

    /// Voxels along i, j, k.
    pub(crate) fn size(&self) -> [usize; 3] {
        self.size
    }
}

impl Local {
    /// `pullback` into `source`; places are relative to the voxel `origin`.
    #[inline(always)]
    pub(crate) fn new(pullback: &Pullback, origin: [u32; 3], source: &Source<'_>) -> Self {
        let [low, high] = pullback.hull();
        let (constant, slopes) = pullback.affine(origin.map(f64::from));
        let [ni, nj, _] = source.size;
        let mut local = Self {
            start: 0,
            steps: [ni as i32, (ni * nj) as i32],
            constant: [0.0; 3],
            slopes: [[0.0; 3]; 3],
            low: [0.0; 3],
            high: [0.0; 3],
            last: [0; 3],
        };
        let mut step = 1;
        for a in 0..3 {
            let within = |x: f64| least(most(x, 0.0), (source.size[a] - 1) as f64);
            let (low, high) = (within(low[a]), within(high[a]));
            let cell = (low as usize).min(source.size[a] - 2);
            let relative = |x: f64| (x - cell as f64) as f32;
            local.start += cell * step;
            step *= source.size[a];
            local.constant[a] = relative(constant[a]);
            (local.low[a], local.high[a]) = (relative(low), relative(high));
            local.last[a] = (source.size[a] - 2 - cell) as i32;
            for b in 0..3 {
                local.slopes[a][b] = slopes[a][b] as f32;
            }
        }
        local
    }
}

/// Asks the memory for `values`, which are soon to be written.
#[inline(always)]
pub(crate) fn prefetch(values: &[i16]) {
    #[cfg(target_arch = "x86_64")]
    avx2::prefetch(values);
    #[cfg(not(target_arch = "x86_64"))]
    let _ = values;
}

impl Place {
    /// The voxel (i, j, k) relative to the origin of its [`Local`].
    #[inline(always)]
    pub(crate) fn new([i, j, k]: [u32; 3]) -> Self {
        Self(i | j << PLACE_BITS[0] | k << (PLACE_BITS[0] + PLACE_BITS[1]))
    }

    /// The voxel `n` farther along i.
    #[inline(always)]
    pub(crate) fn beside(self, n: u32) -> Self {
        Self(self.0 + n)
    }

    /// (i, j, k).
    #[inline(always)]
    fn indices(self) -> [u32; 3] {
        let mask = |bits: u32| (1 << bits) - 1;
        let j = self.0 >> PLACE_BITS[0];
        [self.0 & mask(PLACE_BITS[0]), j & mask(PLACE_BITS[1]), j >> PLACE_BITS[1]]
    }
}

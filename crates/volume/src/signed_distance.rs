//! Signed distance to a surface that is known between the voxels.

use crate::{Volume, sample_trilinear_at};
use rayon::prelude::*;
use supine_space::{Grid, Point};

mod eikonal;
#[cfg(test)]
mod tests;

/// Signed distance of every voxel centre to the surface of a body, negative inside it.
///
/// Kept in 1/2000 mm; what is farther than a band is held at the band. Never 0, so that the sign
/// says on which side a voxel lies.
#[derive(Clone, Debug, PartialEq)]
pub struct SignedDistance {
    values: Volume<i16>,
}

impl SignedDistance {
    /// Units of [`Self::values`] per mm.
    pub const PER_MM: f64 = eikonal::PER_MM as f64;
    /// The widest band, mm.
    pub const WIDEST_MM: f64 = 16.0;

    /// The distance to the surface between the voxels where `inside` holds and the others, up to
    /// `band_mm`, which is held between twice the largest spacing and [`Self::WIDEST_MM`].
    ///
    /// Voxels are told by their place in memory. `crossing(n, m)` says where the surface lies
    /// between the centre of voxel n, which is inside, and that of its face neighbour m, which is
    /// not: as a share of the way from n, 0..=1.
    ///
    /// |grad d| = 1 on the grid with the crossings as boundary, solved by upwind differences:
    /// exact for planes. Source: Sethian, PNAS 93 (1996), with buckets in place of a heap. On a
    /// sphere of 30 mm radius in voxels of 1.4 x 1.4 x 5 mm the error is below 0.1 mm within one
    /// voxel of the surface and below 0.6 mm within the band. The same bits for any number of
    /// threads.
    pub fn new(
        grid: &Grid,
        band_mm: f64,
        inside: impl Fn(usize) -> bool + Sync,
        crossing: impl Fn(usize, usize) -> f32 + Sync,
    ) -> Self {
        let band_mm = band_mm.max(2.0 * grid.spacing().max()).min(Self::WIDEST_MM);
        let far = (band_mm * Self::PER_MM) as i16;
        let sign = |n: usize| if inside(n) { -far } else { far };
        let mut values: Vec<i16> = (0..grid.len()).into_par_iter().map(sign).collect();
        eikonal::solve(grid, far, &mut values, crossing);
        Self { values: Volume::from_parts(grid.clone(), values) }
    }

    /// Distances in units of 1/2000 mm, as [`Self::values`] gives them.
    pub fn from_values(values: Volume<i16>) -> Self {
        Self { values }
    }

    /// The distances in units of 1/2000 mm.
    pub fn values(&self) -> &Volume<i16> {
        &self.values
    }

    /// The distances in units of 1/2000 mm.
    pub fn into_values(self) -> Volume<i16> {
        self.values
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        self.values.grid()
    }

    /// Whether the voxel at a place in memory lies inside.
    #[inline]
    pub fn is_inside(&self, n: usize) -> bool {
        self.values.data()[n] < 0
    }

    /// Distance of the voxel at a place in memory, mm.
    #[inline]
    pub fn mm(&self, n: usize) -> f64 {
        f64::from(self.values.data()[n]) / Self::PER_MM
    }

    /// Distance at a position (LPS, mm), mm: trilinear, clamped to the volume.
    pub fn at(&self, p: &Point) -> f64 {
        f64::from(sample_trilinear_at(&self.values, p)) / Self::PER_MM
    }

    /// Where the surface crosses the way from the centre of voxel n to that of m, as a share of it;
    /// half-way where it does not cross.
    pub fn crossing(&self, n: usize, m: usize) -> f32 {
        let (a, b) = (self.values.data()[n], self.values.data()[m]);
        if (a < 0) == (b < 0) {
            return 0.5;
        }
        let (a, b) = (f32::from(a).abs(), f32::from(b).abs());
        a / (a + b)
    }
}

//! Samples on a grid.

use rayon::prelude::*;
use supine_space::{Failure, Grid, Matrix, Vector};

/// One value per voxel of a grid; i is fastest in memory, then j, then k.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume<T> {
    grid: Grid,
    data: Vec<T>,
}

/// CT in Hounsfield units after rescale.
pub type Ct = Volume<i16>;
/// One label per voxel: the numbers of the module `label`.
pub type LabelMap = Volume<u8>;

/// Why a volume cannot be.
#[derive(Debug, thiserror::Error)]
#[error("{values} values do not fill a grid of {voxels} voxels")]
pub struct VolumeError {
    values: usize,
    voxels: usize,
}

impl VolumeError {
    /// The kind of failure: values and grid do not belong together.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

impl<T> Volume<T> {
    /// A volume from its grid and values, i fastest.
    ///
    /// # Errors
    /// When the number of values is not the number of voxels.
    pub fn new(grid: Grid, data: Vec<T>) -> Result<Self, VolumeError> {
        if data.len() == grid.len() {
            Ok(Self { grid, data })
        } else {
            Err(VolumeError { values: data.len(), voxels: grid.len() })
        }
    }

    /// A volume whose values are known to fill the grid.
    pub(crate) fn from_parts(grid: Grid, data: Vec<T>) -> Self {
        debug_assert_eq!(grid.len(), data.len());
        Self { grid, data }
    }

    /// A volume of `f(voxel)`.
    pub fn from_fn(grid: Grid, mut f: impl FnMut([usize; 3]) -> T) -> Self {
        let data = (0..grid.len()).map(|n| f(grid.voxel(n))).collect();
        Self { grid, data }
    }

    /// A volume of `f(voxel)`, made by all threads.
    pub fn par_from_fn(grid: Grid, f: impl Fn([usize; 3]) -> T + Sync) -> Self
    where
        T: Send,
    {
        let data = (0..grid.len()).into_par_iter().map(|n| f(grid.voxel(n))).collect();
        Self { grid, data }
    }

    /// The grid.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// The values, i fastest.
    pub fn data(&self) -> &[T] {
        &self.data
    }

    /// The values, i fastest, to be changed in place.
    pub fn data_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// Grid and values.
    pub fn into_parts(self) -> (Grid, Vec<T>) {
        (self.grid, self.data)
    }

    /// The same voxels in the order of another grid, when they are the voxels of that grid in some
    /// order: axes exchanged or turned round, as programs store them that keep to one orientation.
    /// Else the volume as it is.
    #[must_use]
    pub fn in_order_of(self, other: &Grid) -> Self
    where
        T: Copy,
    {
        let Some(axes) = same_axes(&self.grid, other) else { return self };
        let place = |voxel: [usize; 3]| {
            let mut from = [0; 3];
            for (a, &(b, back)) in axes.iter().enumerate() {
                from[b] = if back { self.grid.size()[b] - 1 - voxel[a] } else { voxel[a] };
            }
            from
        };
        let size = axes.map(|(b, _)| self.grid.size()[b]);
        let spacing = Vector::from(axes.map(|(b, _)| self.grid.spacing()[b]));
        let columns = axes.map(|(b, back)| {
            let column = self.grid.direction().column(b).into_owned();
            if back { -column } else { column }
        });
        let origin = self.grid.centre(place([0; 3]));
        let turned = Grid::new(size, spacing, origin, Matrix::from_columns(&columns));
        match turned {
            Ok(grid) if grid.is_same(other) => {
                let value = |n: usize| self.data[self.grid.offset(place(grid.voxel(n)))];
                let data = (0..grid.len()).map(value).collect();
                Self { grid, data }
            }
            _ => self,
        }
    }

    /// The same on a larger grid of whose voxels its own are some, with the default value around
    /// them, as programs cut off what is empty. Else the volume as it is.
    #[must_use]
    pub fn placed_in(self, whole: &Grid) -> Self
    where
        T: Copy + Default,
    {
        let Some(start) = place_within(&self.grid, whole) else { return self };
        if whole.size() == self.grid.size() {
            return self;
        }
        let [ni, nj, nk] = self.grid.size();
        let mut data = vec![T::default(); whole.len()];
        for k in 0..nk {
            for j in 0..nj {
                let from = self.grid.offset([0, j, k]);
                let to = whole.offset([start[0], start[1] + j, start[2] + k]);
                data[to..to + ni].copy_from_slice(&self.data[from..from + ni]);
            }
        }
        Self { grid: whole.clone(), data }
    }

    /// The volume of `f(value)` on the same grid.
    pub fn map<U>(&self, f: impl FnMut(&T) -> U) -> Volume<U> {
        Volume { grid: self.grid.clone(), data: self.data.iter().map(f).collect() }
    }

    /// Another volume on the same grid.
    ///
    /// # Errors
    /// When the number of values is not the number of voxels.
    pub fn with_data<U>(&self, data: Vec<U>) -> Result<Volume<U>, VolumeError> {
        Volume::new(self.grid.clone(), data)
    }
}

impl<T: Copy> Volume<T> {
    /// The value of a voxel.
    #[inline]
    pub fn at(&self, voxel: [usize; 3]) -> T {
        self.data[self.grid.offset(voxel)]
    }
}
/// How far the voxels of a part may lie from those of the whole, voxels.
const PART_TOLERANCE: f64 = 1e-2;

/// The voxel of `whole` at which `part` begins, when the voxels of both coincide.
fn place_within(part: &Grid, whole: &Grid) -> Option<[usize; 3]> {
    let last = part.size().map(|n| n - 1);
    let ends = [whole.voxel_at(&part.origin())?, whole.voxel_at(&part.centre(last))?];
    for (voxel, point) in ends.iter().zip([part.origin(), part.centre(last)]) {
        let index = whole.index_from_patient(&point);
        if (0..3).any(|a| (index[a] - voxel[a] as f64).abs() > PART_TOLERANCE) {
            return None;
        }
    }
    let same_axes = (part.direction() - whole.direction()).abs().max() < 1e-4;
    let fits = (0..3).all(|a| ends[1][a].checked_sub(ends[0][a]) == Some(last[a]));
    (same_axes && fits).then_some(ends[0])
}

/// For each axis of `other` the axis of `grid` along it, and whether that runs back; nothing when
/// they differ in order not at all, or in more.
fn same_axes(grid: &Grid, other: &Grid) -> Option<[(usize, bool); 3]> {
    let along = |a: usize| {
        let axis = other.direction().column(a);
        let dots = [0, 1, 2].map(|b| grid.direction().column(b).dot(&axis));
        let b = (0..3).max_by(|&b, &c| dots[b].abs().total_cmp(&dots[c].abs()))?;
        Some((b, dots[b] < 0.0))
    };
    let axes = [along(0)?, along(1)?, along(2)?];
    let mut covered = [false; 3];
    axes.iter().for_each(|&(b, _)| covered[b] = true);
    let turned = axes.iter().enumerate().any(|(a, &axis)| axis != (a, false));
    (turned && covered == [true; 3]).then_some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_in_any_order_are_put_in_that_of_another_grid() {
        let (sin, cos) = 0.3f64.sin_cos();
        let turn = Matrix::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
        let spacing = Vector::new(0.7, 1.1, 2.5);
        let origin = supine_space::Point::new(-20.0, 5.0, 100.0);
        let grid = Grid::new([4, 5, 3], spacing, origin, turn).unwrap();
        let volume = Volume::from_fn(grid.clone(), |v| grid.offset(v) as u8);
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            for back in 0..8 {
                let back = [0, 1, 2].map(|a| back >> a & 1 == 1);
                let mut first = [0; 3];
                (0..3)
                    .filter(|&a| back[a])
                    .for_each(|a| first[order[a]] = grid.size()[order[a]] - 1);
                let columns = [0, 1, 2].map(|a| {
                    let column = turn.column(order[a]).into_owned();
                    if back[a] { -column } else { column }
                });
                let other = Grid::new(
                    order.map(|b| grid.size()[b]),
                    order.map(|b| spacing[b]).into(),
                    grid.centre(first),
                    Matrix::from_columns(&columns),
                );
                // Every voxel knows where it belongs.
                let stored = Volume::from_fn(other.unwrap(), |_| 0u8);
                let at = |v| grid.offset(grid.voxel_at(&stored.grid().centre(v)).unwrap()) as u8;
                let stored = Volume::from_fn(stored.grid().clone(), at);
                let found = stored.in_order_of(&grid);
                assert!(
                    found.data() == volume.data() && found.grid().is_same(&grid),
                    "{order:?} {back:?}"
                );
            }
        }
        let shifted = Grid::new([4, 5, 3], spacing, origin + Vector::x(), -turn).unwrap();
        let beside = Volume::from_fn(shifted, |_| 1u8);
        assert_eq!(beside.clone().in_order_of(&grid), beside);
    }
}

//! Samples on a grid.

use rayon::prelude::*;
use supine_space::{Failure, Grid};

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

//! Voxels that hold no measurement: outside the reconstruction circle, or marked as padding.

use rayon::prelude::*;
use std::ops::Range;
use supine_volume::Ct;

/// What such voxels are in the volume: air, HU.
pub(crate) const AIR_HU: i16 = -1000;
/// Nothing measured lies below this, HU: vacuum is -1000, noise and the 12-bit floor reach -1024.
pub(crate) const LOWEST_MEASURED_HU: i16 = -1024;

/// Voxels that one thread puts back at a time.
const PART: usize = 1 << 18;

/// Consecutive voxels without measurement and the HU that the file has for them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    start: usize,
    length: usize,
    hu: i16,
}

/// The voxels of a volume that hold no measurement.
///
/// In the volume they are air, so that nothing interpolates towards -3024 HU; an export gives them
/// the value of the source back, so that it repeats the source where nothing moved.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Padding {
    runs: Vec<Run>,
}

impl Padding {
    /// Takes the padding out of one slice that starts at voxel `start` and makes it air.
    ///
    /// `marked` says whether a voxel (index within the slice) is padding by the file's own account.
    pub(crate) fn take(start: usize, hu: &mut [i16], marked: impl Fn(usize) -> bool) -> Self {
        let mut runs: Vec<Run> = Vec::new();
        for (n, value) in hu.iter_mut().enumerate() {
            if *value >= LOWEST_MEASURED_HU && !marked(n) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.start + run.length == start + n && run.hu == *value => {
                    run.length += 1
                }
                _ => runs.push(Run { start: start + n, length: 1, hu: *value }),
            }
            *value = AIR_HU;
        }
        Self { runs }
    }

    /// The padding of consecutive slices together.
    pub(crate) fn join(parts: impl IntoIterator<Item = Self>) -> Self {
        Self { runs: parts.into_iter().flat_map(|p| p.runs).collect() }
    }

    /// Runs of voxels that hold no measurement, and the HU that the files have for them.
    pub(crate) fn runs(&self) -> impl Iterator<Item = (Range<usize>, i16)> {
        self.runs.iter().map(|run| (run.start..run.start + run.length, run.hu))
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.runs.iter().map(|run| run.length).sum()
    }

    /// The volume with the source's values where padding still is air, those below
    /// [`LOWEST_MEASURED_HU`] raised to it when they are to be clipped.
    pub(crate) fn put_back(&self, ct: &Ct, clip: bool) -> Vec<i16> {
        let floor = if clip { LOWEST_MEASURED_HU } else { i16::MIN };
        let mut hu = vec![0; ct.data().len()];
        let parts = hu.par_chunks_mut(PART).zip(ct.data().par_chunks(PART)).enumerate();
        parts.for_each(|(n, (hu, given))| {
            hu.copy_from_slice(given);
            let (from, end) = (n * PART, n * PART + hu.len());
            // The runs are in order and do not overlap.
            let first = self.runs.partition_point(|run| run.start + run.length <= from);
            for run in self.runs[first..].iter().take_while(|run| run.start < end) {
                let run_end = (run.start + run.length).min(end);
                let within = &mut hu[run.start.max(from) - from..run_end - from];
                within.iter_mut().filter(|v| **v == AIR_HU).for_each(|v| *v = run.hu.max(floor));
            }
        });
        hu
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn padding_becomes_air_and_returns_where_nothing_moved() {
        let mut hu = vec![-2048, -2048, -1024, 40, -3024, -1000, 7, 7];
        let padding = Padding::take(0, &mut hu, |n| n == 6);
        assert_eq!(hu, [-1000, -1000, -1024, 40, -1000, -1000, -1000, 7]);
        assert_eq!(padding.len(), 4);
        hu[1] = 30;
        let grid = Grid::new([8, 1, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let ct = Ct::new(grid.unwrap(), hu).unwrap();
        assert_eq!(padding.put_back(&ct, false), [-2048, 30, -1024, 40, -3024, -1000, 7, 7]);
        assert_eq!(padding.put_back(&ct, true), [-1024, 30, -1024, 40, -1024, -1000, 7, 7]);
    }

    #[test]
    fn padding_returns_across_the_parts_that_threads_take() {
        let count = 3 * PART + 5;
        let marked = |n: usize| n.is_multiple_of(7) || n.abs_diff(PART) < 9 || n + 4 > 2 * PART;
        let before: Vec<i16> = (0..count).map(|n| if marked(n) { -3000 } else { 40 }).collect();
        let mut hu = before.clone();
        let padding = Padding::take(0, &mut hu, |_| false);
        let grid =
            Grid::new([count, 1, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let ct = Ct::new(grid.unwrap(), hu).unwrap();
        assert_eq!(padding.put_back(&ct, false), before);
    }
}

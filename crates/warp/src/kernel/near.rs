//! A part of a volume where it is quicker to read.

use super::Source;
use crate::predicate::Index;
use crate::rows::{max, min};
use rayon::prelude::*;
use std::ops::Range;

/// A copy of a box of voxels in which neighbours along j and k do not contend for the same lines of
/// a cache, as they do where a row has 512 voxels.
#[derive(Debug)]
pub(crate) struct Near {
    data: Vec<i16>,
    size: [usize; 3],
    first: [usize; 3],
    count: [usize; 3],
    steps: [usize; 3],
}

/// Voxels in a line of a cache.
const LINE: usize = 32;
/// Larger parts are read where they are.
const MAX_VOXELS: usize = 12 << 20;

impl Near {
    /// The voxels of `of` in a box, two or more along each axis; `None` when there are too many.
    pub(crate) fn new(of: &Source<'_>, [i, j, k]: [Range<usize>; 3]) -> Option<Self> {
        assert!([&i, &j, &k].iter().all(|axis| axis.len() >= 2), "two voxels along each axis");
        // An odd number of lines in a row, and in a slice.
        let odd = |lines: usize| lines | 1;
        let row = odd(i.len().div_ceil(LINE)) * LINE;
        let slice = odd(j.len() * row / LINE) * LINE;
        if k.len().checked_mul(slice)? > MAX_VOXELS {
            return None;
        }
        let mut data = vec![0; k.len() * slice];
        let [_, from_row, from_slice] = of.steps;
        data.par_chunks_mut(slice).zip(k.clone()).for_each(|(slice, k)| {
            for (row, j) in slice.chunks_exact_mut(row).zip(j.clone()) {
                let start = k * from_slice + j * from_row + i.start;
                row[..i.len()].copy_from_slice(&of.data[start..start + i.len()]);
            }
        });
        let (first, count) = ([i.start, j.start, k.start], [i.len(), j.len(), k.len()]);
        Some(Self { data, size: of.size, first, count, steps: [1, row, slice] })
    }

    /// To be sampled within the box.
    pub(crate) fn source(&self) -> Source<'_> {
        let Self { ref data, size, first, count, steps } = *self;
        Source { data, size, first, count, steps }
    }
}

/// The voxels of a volume of `size` that are read where places are among `vertices`, when the voxel
/// before each place and `wide` voxels on either side of that and the next are.
pub(crate) fn reach(vertices: &[Index], size: [usize; 3], wide: usize) -> [Range<usize>; 3] {
    [0, 1, 2].map(|a| {
        let along = || vertices.iter().map(|v| v[a].clamp(0.0, (size[a] - 1) as f64));
        let (low, high) = (along().fold(f64::INFINITY, min), along().fold(0.0, max));
        let low = (low as usize).min(size[a] - 2);
        let high = (high as usize + 2).clamp(low + 2, size[a]);
        low.saturating_sub(wide)..(high + wide).min(size[a])
    })
}

//! A part of a volume where it is quicker to read.

use super::Source;
use rayon::prelude::*;
use std::ops::Range;

/// A copy of a box of voxels in which neighbours along j and k do not contend for the same lines of a cache, as
/// they do where a row has 512 voxels.
#[derive(Debug)]
pub(crate) struct Near {
    data: Vec<i16>,
    size: [usize; 3],
    first: [usize; 3],
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
        let first = [i.start, j.start, k.start];
        Some(Self { data, size: of.size, first, steps: [1, row, slice] })
    }

    /// To be sampled within the box.
    pub(crate) fn source(&self) -> Source<'_> {
        Source { data: &self.data, size: self.size, first: self.first, steps: self.steps }
    }
}

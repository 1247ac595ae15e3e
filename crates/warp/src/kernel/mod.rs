//! What is done for each row and each voxel: where rows begin and end, where voxels come from, and
//! trilinear or cubic samples there, in f32 about points near by.
//!
//! [`scalar`] says what is to be computed, operation by operation; `avx2` does the same for eight
//! rows or voxels at once. All give the same bits: products and sums are fused everywhere.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod near;
mod scalar;

#[cfg(test)]
mod tests;

pub(crate) use near::{Near, reach};

use crate::batch::{Batch, Crossings, Triple, cross, dot, less, scaled};
use crate::sweep::{Extent, Swept};
use std::ops::Range;
use supine_space::Pack;

pub(crate) use supine_space::LANES;

/// Bits of the place of a voxel within a tetrahedron's part of a slab: along i, j and k.
const PLACE_BITS: [u32; 3] = [13, 13, 6];
/// Longest axis along i and j, voxels.
pub(crate) const LONGEST: usize = 1 << PLACE_BITS[0];
/// Highest slab, voxels.
pub(crate) const HIGHEST: usize = 1 << PLACE_BITS[2];

/// A volume that is sampled, or a part of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'a> {
    data: &'a [i16],
    /// Voxels of the whole volume.
    size: [usize; 3],
    /// The voxel with which the part begins.
    first: [usize; 3],
    /// How many voxels the part has.
    count: [usize; 3],
    /// Steps of a voxel, of a row and of a slice.
    steps: [usize; 3],
}

/// A voxel that is to be sampled, relative to where places of its [`Locals`] begin.
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

    /// Adds the spans of the tetrahedron of a lane in the rows of `extent`, and the rows that are
    /// unsure.
    #[inline(always)]
    pub(crate) fn sweep(
        self,
        crossings: &Crossings,
        lane: usize,
        extent: &Extent,
        swept: &mut Swept,
    ) {
        match self {
            Self::Scalar => scalar::sweep(crossings, lane, extent, swept),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::sweep(crossings, lane, extent, swept),
        }
    }

    /// Finds `places` of the tetrahedron of a lane in the volume; their number is a multiple of
    /// [`LANES`], and `spots` holds as many.
    #[inline(always)]
    pub(crate) fn locate(
        self,
        locals: &Locals,
        lane: usize,
        places: &[Place],
        spots: SpotsMut<'_>,
    ) {
        match self {
            Self::Scalar => scalar::locate(locals, lane, places, spots),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::locate(locals, lane, places, spots),
        }
    }

    /// As [`Self::blend`], by cubic convolution.
    pub(crate) fn cubic(self, source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
        match self {
            Self::Scalar => scalar::cubic(source, spots, 0..values.len(), values),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::cubic(source, spots, values),
        }
    }

    /// The trilinear HU at the first of `spots`, as many as there are `values`, a multiple of
    /// [`LANES`].
    pub(crate) fn blend(self, source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
        match self {
            Self::Scalar => scalar::blend(source, spots, values),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => avx2::blend(source, spots, values),
        }
    }
}

/// Places in a volume.
#[derive(Debug, Default)]
pub(crate) struct Spots {
    /// The voxel before each along i, j and k.
    cells: Vec<u32>,
    /// How far behind it, 0 to 1 along i, j, k.
    within: [Vec<f32>; 3],
    /// Those that are not known to lie two voxels or more from the edges of the volume.
    edges: Vec<Range<usize>>,
}

/// Some of [`Spots`], to be written; all of the same number.
pub(crate) struct SpotsMut<'a> {
    cells: &'a mut [u32],
    within: [&'a mut [f32]; 3],
}

impl Spots {
    /// How many there is room for.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// Says that some are near the edges of the volume.
    #[cold]
    pub(crate) fn near_edges(&mut self, some: Range<usize>) {
        self.edges.push(some);
    }

    /// Forgets which are near the edges of the volume.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.edges.clear();
    }

    /// Makes room.
    #[cold]
    pub(crate) fn grow(&mut self, len: usize) {
        self.cells.resize(len, 0);
        self.within.iter_mut().for_each(|axis| axis.resize(len, 0.0));
    }

    /// `count` of them from `at` on.
    #[inline(always)]
    pub(crate) fn some(&mut self, at: usize, count: usize) -> SpotsMut<'_> {
        let [x, y, z] = &mut self.within;
        let range = at..at + count;
        let within = [&mut x[range.clone()], &mut y[range.clone()], &mut z[range.clone()]];
        SpotsMut { cells: &mut self.cells[range], within }
    }

    /// Asks the memory for voxels around one of them; the others are asked for by neighbours,
    /// mostly.
    #[inline(always)]
    pub(crate) fn prefetch(&self, at: usize, source: &Source<'_>) {
        let (cell, [_, row, slice]) = (self.cells[at] as usize, source.steps);
        for beside in [0, slice + row] {
            if let Some(values) = source.data.get(cell + beside..) {
                prefetch(values);
            }
        }
    }
}

impl<'a> Source<'a> {
    /// `data` (i fastest) of `size` voxels, two or more along each axis.
    pub(crate) fn new(data: &'a [i16], size: [usize; 3]) -> Self {
        assert!(size.iter().all(|&n| n >= 2), "two voxels or more along each axis");
        assert_eq!(data.len(), size.iter().product::<usize>(), "as many values as voxels");
        let steps = [1, size[0], size[0] * size[1]];
        Self { data, size, first: [0; 3], count: size, steps }
    }

    /// Its values, i fastest.
    pub(crate) fn data(&self) -> &'a [i16] {
        self.data
    }

    /// Voxels along i, j, k of the whole volume.
    pub(crate) fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The last voxel that has others beside it along each axis.
    #[inline(always)]
    fn last_cell(&self) -> usize {
        self.data.len() - self.steps.iter().sum::<usize>() - 1
    }

    /// The last voxel with which a block of four along each axis may begin.
    #[inline(always)]
    fn last_block(&self) -> Option<usize> {
        self.data.len().checked_sub(3 * self.steps.iter().sum::<usize>() + 1)
    }
}

/// The affine maps of several tetrahedra from whole places in their boxes to the volume's indices,
/// each relative to a voxel of the volume near by.
pub(crate) struct Locals {
    /// Of the sampled volume: the place of the voxel to which all is relative.
    start: [u32; LANES],
    /// Steps of a row and of a slice.
    steps: [i32; 2],
    /// Index at place (0, 0, 0), and its change along i, j, k.
    constant: [[f32; LANES]; 3],
    slopes: [[[f32; LANES]; 3]; 3],
    /// Where results are held; within the volume.
    low: [[f32; LANES]; 3],
    high: [[f32; LANES]; 3],
    /// The last cell along each axis.
    last: [[i32; LANES]; 3],
    /// Ratio of the deformed volume to that in the CT, in voxels: det F where both have the same
    /// voxels.
    det: [f64; LANES],
}

impl Locals {
    /// The maps of the tetrahedra of `batch` onto those with the corners `rest`, into `source`.
    /// Places are relative to the first voxel of each box, but begin with slice `first` where the
    /// box is below.
    #[inline(always)]
    pub(crate) fn new(batch: &Batch, rest: [Triple; 4], first: usize, source: &Source<'_>) -> Self {
        let [o, edges @ ..] = rest;
        let mut edges = edges;
        let (mut low, mut high) = (o, o);
        for edge in &mut edges {
            for a in 0..3 {
                low[a] = low[a].min(edge[a]);
                high[a] = high[a].max(edge[a]);
            }
            *edge = less(*edge, o);
        }
        let rest_volume = dot(edges[0], cross(edges[1], edges[2]));
        let det = batch.volume / rest_volume.abs();
        let by = Pack::all(1.0) / batch.volume;
        let [_, s, t, u] = batch.normals;
        let slopes = [scaled(s, by), scaled(t, by), scaled(u, by)];
        let above = (Pack::all(first as f64) - batch.first[2]).max(Pack::ZERO);
        // From corner 0 to where places begin.
        let [i, j, k] = batch.corners[0];
        let from = [Pack::ZERO - i, Pack::ZERO - j, above - k];
        let zeros = [[0.0; LANES]; 3];
        let [_, row, slice] = source.steps;
        let mut all = Self {
            start: [0; LANES],
            steps: [row as i32, slice as i32],
            constant: zeros,
            slopes: [zeros; 3],
            low: zeros,
            high: zeros,
            last: [[0; LANES]; 3],
            det: det.0,
        };
        for a in 0..3 {
            let last = Pack::all((source.size[a] - 1) as f64);
            let within = |x: Pack| x.max(Pack::ZERO).min(last);
            let cell = within(low[a]).floor().min(last - Pack::all(1.0));
            let mut row = [Pack::ZERO; 3];
            for (edge, slope) in edges.iter().zip(&slopes) {
                for b in 0..3 {
                    row[b] += edge[a] * slope[b];
                }
            }
            let constant = o[a] + dot(row, from);
            all.constant[a] = (constant - cell).single();
            all.low[a] = (within(low[a]) - cell).single();
            all.high[a] = (within(high[a]) - cell).single();
            for b in 0..3 {
                all.slopes[a][b] = row[b].single();
            }
            for lane in 0..LANES {
                let cell = cell.0[lane] as i32;
                all.last[a][lane] = source.size[a] as i32 - 2 - cell;
                all.start[lane] +=
                    (cell as usize - source.first[a]) as u32 * source.steps[a] as u32;
            }
        }
        all
    }

    /// Whether all places that come from the tetrahedron of a lane have two voxels on either side
    /// along each axis of the volume `source`.
    #[inline(always)]
    pub(crate) fn within(&self, lane: usize, source: &Source<'_>) -> bool {
        (0..3).all(|a| {
            let last = self.last[a][lane];
            let first = source.size[a] as i32 - 2 - last;
            first >= 1 && self.high[a][lane] < last as f32
        })
    }

    /// Ratio of the deformed volume to that in the CT, in voxels.
    #[inline(always)]
    pub(crate) fn det(&self, lane: usize) -> f64 {
        self.det[lane]
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
    /// The voxel (i, j, k) relative to where places of its [`Locals`] begin.
    #[inline(always)]
    pub(crate) fn new([i, j, k]: [u32; 3]) -> Self {
        Self(i | j << PLACE_BITS[0] | k << (PLACE_BITS[0] + PLACE_BITS[1]))
    }

    /// [`LANES`] voxels of a row, from the one `n` farther along i on.
    #[inline(always)]
    pub(crate) fn row(self, n: u32, places: &mut [Self]) {
        for (place, lane) in places[..LANES].iter_mut().zip(n..) {
            *place = Self(self.0 + lane);
        }
    }

    /// (i, j, k).
    #[inline(always)]
    pub(crate) fn indices(self) -> [u32; 3] {
        let mask = |bits: u32| (1 << bits) - 1;
        let j = self.0 >> PLACE_BITS[0];
        [self.0 & mask(PLACE_BITS[0]), j & mask(PLACE_BITS[1]), j >> PLACE_BITS[1]]
    }
}

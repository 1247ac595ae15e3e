//! Tetrahedra in index space, sorted into slabs of slices, and the voxels that each owns.

use crate::batch::{Batch, gathered};
use crate::coverage::Window;
use crate::kernel::{HIGHEST, Kernel};
use crate::predicate::Index;
use crate::rows::{Rows, Span, max, min, range};
use crate::sweep::{Extent, Swept};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;
use supine_space::LANES;

/// Slices that are worked on together by one thread; every voxel has one writer.
pub(crate) const SLAB: usize = 16;
const _: () = assert!(SLAB <= HIGHEST, "places in a slab can be told");

/// Tetrahedra in index space, sorted into slabs of slices of a grid.
#[derive(Debug)]
pub(crate) struct Raster<'a> {
    vertices: &'a [Index],
    tets: &'a [[u32; 4]],
    size: [usize; 3],
    /// Tetrahedra of each slab, in ascending order, one slab after the other.
    members: Vec<u32>,
    /// Where each slab begins in `members`.
    starts: Vec<usize>,
    /// The box of all vertices.
    window: Window,
}

/// The tetrahedron that is worked on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Item {
    pub(crate) tet: usize,
    /// Its place among those looked at.
    pub(crate) lane: usize,
    /// First voxel of its box within the slab.
    pub(crate) first: [u32; 3],
}

/// Takes what tetrahedra own.
pub(crate) trait Paint {
    /// Some tetrahedra that lie, or may lie, in `slices` are looked at next.
    #[inline(always)]
    fn next(&mut self, _tets: &[u32; LANES], _batch: &Batch, _slices: &Range<usize>) {}

    /// The spans of a tetrahedron within the slab, at least one; they have no voxel in common.
    fn paint(&mut self, item: Item, spans: &[Span]);

    /// All of those that were looked at have been painted.
    #[inline(always)]
    fn done(&mut self) {}
}

impl<F: FnMut(usize, &[Span])> Paint for F {
    #[inline(always)]
    fn paint(&mut self, item: Item, spans: &[Span]) {
        self(item.tet, spans);
    }
}

impl<'a> Raster<'a> {
    /// Prepares `tets` over a grid of `size` voxels.
    pub(crate) fn new(vertices: &'a [Index], tets: &'a [[u32; 4]], size: [usize; 3]) -> Self {
        let slabs = size[2].div_ceil(SLAB);
        // First and last slab of each, if there are any.
        let reach = |tet: &[u32; 4]| {
            let [a, b, c, d] = *tet;
            let z = |v: u32| vertices[v as usize][2];
            let (low, high) = range([z(a), z(b), z(c), z(d)], size[2])?;
            Some([(low / SLAB) as u32, (high / SLAB) as u32])
        };
        let reaches: Vec<_> = tets.par_iter().with_min_len(4096).map(reach).collect();
        let mut starts = vec![0usize; slabs + 1];
        for [low, high] in reaches.iter().flatten() {
            starts[*low as usize + 1..=*high as usize + 1].iter_mut().for_each(|n| *n += 1);
        }
        for slab in 0..slabs {
            starts[slab + 1] += starts[slab];
        }
        let mut next = starts.clone();
        let mut members = vec![0u32; starts[slabs]];
        for (tet, reach) in reaches.into_iter().enumerate() {
            let Some([low, high]) = reach else { continue };
            for next in &mut next[low as usize..=high as usize] {
                members[*next] = tet as u32;
                *next += 1;
            }
        }
        Self { vertices, tets, size, members, starts, window: window(vertices, size) }
    }

    /// Corners of a tetrahedron.
    #[inline(always)]
    pub(crate) fn corners(&self, tet: usize) -> [Index; 4] {
        let [a, b, c, d] = self.tets[tet].map(|v| v as usize);
        [self.vertices[a], self.vertices[b], self.vertices[c], self.vertices[d]]
    }

    /// Vertices of a tetrahedron.
    #[inline(always)]
    pub(crate) fn vertices_of(&self, tet: usize) -> [usize; 4] {
        self.tets[tet].map(|v| v as usize)
    }

    /// The voxels in the box of all vertices.
    pub(crate) fn whole(&self) -> Window {
        self.window
    }

    /// The tetrahedra of a slab, in ascending order.
    pub(crate) fn members(&self, slab: usize) -> &[u32] {
        &self.members[self.starts[slab]..self.starts[slab + 1]]
    }

    /// The voxels of a slab that tetrahedra may own; empty where none reaches.
    pub(crate) fn window(&self, slab: usize) -> Window {
        if self.members(slab).is_empty() {
            return Window { first: [0; 3], end: [0; 3] };
        }
        self.window.slices(slab * SLAB, (slab + 1) * SLAB)
    }

    /// Gives what each tetrahedron owns within a slab to `paint`, tetrahedra in ascending order:
    /// where several own a voxel (a folded mesh), the first is to keep it.
    pub(crate) fn scan(&self, slab: usize, paint: &mut impl Paint) {
        self.scan_those(self.members(slab), slab, paint);
    }

    /// As [`Self::scan`], of some members of the slab in any order.
    pub(crate) fn scan_those(&self, members: &[u32], slab: usize, paint: &mut impl Paint) {
        Arch::new().dispatch(Scan { raster: self, members, slab, paint });
    }
}

/// The voxels in the box of `vertices`.
fn window(vertices: &[Index], size: [usize; 3]) -> Window {
    let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for vertex in vertices {
        for (reach, x) in reach.iter_mut().zip(vertex) {
            *reach = [min(reach[0], *x), max(reach[1], *x)];
        }
    }
    let mut window = Window { first: [0; 3], end: [0; 3] };
    for a in 0..3 {
        // Numbers below 0 become 0.
        window.first[a] = reach[a][0].ceil() as usize;
        window.end[a] = ((reach[a][1].floor() + 1.0) as usize).min(size[a]);
    }
    window
}

/// The work of [`Raster::scan_those`].
struct Scan<'a, P> {
    raster: &'a Raster<'a>,
    members: &'a [u32],
    slab: usize,
    paint: &'a mut P,
}

impl<P: Paint> WithSimd for Scan<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { raster, members, slab, paint } = self;
        let slices = slab * SLAB..((slab + 1) * SLAB).min(raster.size[2]);
        let within = slices.start as i32..slices.end as i32;
        let (kernel, mut swept) = (Kernel::best(), Swept::default());
        for own in members.chunks(LANES) {
            let mut tets = [own[0]; LANES];
            tets[..own.len()].copy_from_slice(own);
            let batch = Batch::new(gathered(raster.vertices, raster.tets, &tets), raster.size);
            let (crossings, extents) = (batch.crossings(), batch.extents());
            paint.next(&tets, &batch, &slices);
            for (lane, tet) in own.iter().enumerate() {
                let Some(extent) = Extent::new(&extents, lane, &within) else { continue };
                swept.clear();
                if crossings.known(lane) {
                    kernel.sweep(&crossings, lane, &extent, &mut swept);
                } else {
                    swept.unsure.extend(extent.rows());
                }
                if !swept.unsure.is_empty() {
                    raster.decide(*tet, &mut swept);
                }
                if !swept.spans.is_empty() {
                    let [i, j, k] = extent.first;
                    let first = [i as u32, j as u32, k as u32];
                    paint.paint(Item { tet: *tet as usize, lane, first }, &swept.spans);
                }
            }
            paint.done();
        }
    }
}

impl Raster<'_> {
    /// Adds what a tetrahedron owns in the rows that are unsure.
    #[cold]
    #[inline(never)]
    fn decide(&self, tet: u32, swept: &mut Swept) {
        if let Some(own) = Rows::new(self.corners(tet as usize), self.size) {
            for &[j, k] in &swept.unsure {
                own.row(j as usize, k as usize, &mut swept.spans);
            }
        }
    }
}

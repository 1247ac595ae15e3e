//! Tetrahedra in index space, sorted into slabs of slices, and the voxels that each owns.

use crate::coverage::Window;
use crate::predicate::Index;
use crate::rows::{Rows, Span, range};
use pulp::{Arch, Simd, WithSimd};

/// Slices that are worked on together by one thread; every voxel has one writer.
pub(crate) const SLAB: usize = 16;

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

/// Takes what a tetrahedron owns.
pub(crate) trait Paint {
    /// The spans of tetrahedron `tet` within the slab; they have no voxel in common.
    fn paint(&mut self, tet: usize, spans: &[Span]);
}

impl<F: FnMut(usize, &[Span])> Paint for F {
    #[inline(always)]
    fn paint(&mut self, tet: usize, spans: &[Span]) {
        self(tet, spans);
    }
}

impl<'a> Raster<'a> {
    /// Prepares `tets` over a grid of `size` voxels.
    pub(crate) fn new(vertices: &'a [Index], tets: &'a [[u32; 4]], size: [usize; 3]) -> Self {
        let slabs = size[2].div_ceil(SLAB);
        let reach = |tet: &[u32; 4]| {
            let z = tet.map(|v| vertices[v as usize][2]);
            range(z, size[2]).map(|(low, high)| low / SLAB..=high / SLAB)
        };
        let mut starts = vec![0usize; slabs + 1];
        for slab in tets.iter().filter_map(reach).flatten() {
            starts[slab + 1] += 1;
        }
        for slab in 0..slabs {
            starts[slab + 1] += starts[slab];
        }
        let mut next = starts.clone();
        let mut members = vec![0u32; starts[slabs]];
        for (tet, corners) in tets.iter().enumerate() {
            for slab in reach(corners).into_iter().flatten() {
                members[next[slab]] = tet as u32;
                next[slab] += 1;
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

    /// The voxels of a slab that tetrahedra may own; empty where none reaches.
    pub(crate) fn window(&self, slab: usize) -> Window {
        if self.starts[slab] == self.starts[slab + 1] {
            return Window { first: [0; 3], end: [0; 3] };
        }
        self.window.slices(slab * SLAB, (slab + 1) * SLAB)
    }

    /// Gives what each tetrahedron owns within a slab to `paint`, tetrahedra in ascending order: where
    /// several own a voxel (a folded mesh), the first is to keep it.
    pub(crate) fn scan(&self, slab: usize, paint: &mut impl Paint) {
        Arch::new().dispatch(Scan { raster: self, slab, paint });
    }
}

/// The voxels in the box of `vertices`.
fn window(vertices: &[Index], size: [usize; 3]) -> Window {
    let mut window = Window { first: [0; 3], end: [0; 3] };
    for a in 0..3 {
        let along = || vertices.iter().map(|v| v[a]);
        let low = along().fold(f64::INFINITY, f64::min).ceil().max(0.0);
        let high = along().fold(f64::NEG_INFINITY, f64::max).floor();
        // Numbers below 0 become 0.
        (window.first[a], window.end[a]) = (low as usize, ((high + 1.0) as usize).min(size[a]));
    }
    window
}

/// The work of [`Raster::scan`].
struct Scan<'a, P> {
    raster: &'a Raster<'a>,
    slab: usize,
    paint: &'a mut P,
}

impl<P: Paint> WithSimd for Scan<'_, P> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { raster, slab, paint } = self;
        let slices = slab * SLAB..((slab + 1) * SLAB).min(raster.size[2]);
        let mut spans = Vec::new();
        for &tet in &raster.members[raster.starts[slab]..raster.starts[slab + 1]] {
            let tet = tet as usize;
            let Some(rows) = Rows::new(raster.corners(tet), raster.size) else { continue };
            spans.clear();
            rows.scan(&slices, &mut spans);
            if !spans.is_empty() {
                paint.paint(tet, &spans);
            }
        }
    }
}

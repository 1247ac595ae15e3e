//! Which voxels each tetrahedron owns: exact spans of rows.

use crate::predicate::{FACES, Index, holds, orientation};

/// Slices that are worked on together by one thread; every voxel has one writer.
pub(crate) const SLAB: usize = 8;

/// A run of voxels `from..to` along i in row (j, k), owned by one tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Span {
    pub(crate) tet: usize,
    pub(crate) j: usize,
    pub(crate) k: usize,
    pub(crate) from: usize,
    pub(crate) to: usize,
}

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
        Self { vertices, tets, size, members, starts }
    }

    /// Corners of a tetrahedron.
    pub(crate) fn corners(&self, tet: usize) -> [Index; 4] {
        self.tets[tet].map(|v| self.vertices[v as usize])
    }

    /// Whether no tetrahedron reaches into a slab.
    pub(crate) fn is_empty(&self, slab: usize) -> bool {
        self.starts[slab] == self.starts[slab + 1]
    }

    /// Gives the spans within a slab to `paint`, tetrahedra in descending order: where several own
    /// a voxel (a folded mesh), the lowest comes last and stays.
    pub(crate) fn scan(&self, slab: usize, mut paint: impl FnMut(Span)) {
        let slices = slab * SLAB..((slab + 1) * SLAB).min(self.size[2]);
        for &tet in self.members[self.starts[slab]..self.starts[slab + 1]].iter().rev() {
            let tet = tet as usize;
            if let Some(rows) = Rows::new(self.corners(tet), self.size) {
                rows.scan(&slices, |j, k, from, to| paint(Span { tet, j, k, from, to }));
            }
        }
    }
}

/// Whole numbers within 0..n that lie in the hull of `values`.
fn range(values: [f64; 4], n: usize) -> Option<(usize, usize)> {
    let low = values.into_iter().fold(f64::INFINITY, f64::min).ceil().max(0.0);
    let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max).floor().min((n - 1) as f64);
    (low <= high).then_some((low as usize, high as usize))
}

/// One tetrahedron, prepared for the rows of its box.
struct Rows {
    corners: [Index; 4],
    sign: f64,
    /// Lowest and highest voxel of the box along i, j, k.
    bounds: [(usize, usize); 3],
    /// Integer point near the corners; the faces are taken relative to it to keep digits.
    origin: Index,
    faces: [Face; 4],
    /// Bound of the rounding error of a face's value anywhere in the box.
    error: f64,
    /// Bound of |coordinate| relative to `origin` in the box.
    reach: f64,
}

/// normal·x + offset, positive inside, coordinates relative to the origin of [`Rows`].
#[derive(Clone, Copy)]
struct Face {
    normal: Index,
    offset: f64,
}

/// Rounding error of a face's value in units of (reach)³: about 40 operations of half an ulp,
/// rounded up generously, since a larger value only sends more voxels to the exact test.
const ERROR: f64 = 128.0 * f64::EPSILON;

impl Rows {
    /// `None` when the tetrahedron is flat or owns nothing in the grid.
    fn new(corners: [Index; 4], size: [usize; 3]) -> Option<Self> {
        let mut bounds = [(0, 0); 3];
        for a in 0..3 {
            bounds[a] = range(corners.map(|c| c[a]), size[a])?;
        }
        let sign = orientation(corners);
        if sign == 0.0 {
            return None;
        }
        let origin = [0, 1, 2].map(|a| bounds[a].0 as f64);
        let local = corners.map(|c| [c[0] - origin[0], c[1] - origin[1], c[2] - origin[2]]);
        let extent = (0..3).map(|a| (bounds[a].1 - bounds[a].0) as f64).fold(1.0, f64::max);
        let reach = local.iter().flatten().fold(extent, |m, x| m.max(x.abs()));
        let faces = FACES.map(|f| Face::new(f.map(|v| local[v]), sign));
        Some(Self { corners, sign, bounds, origin, faces, error: ERROR * reach.powi(3), reach })
    }

    fn scan(
        &self,
        slices: &std::ops::Range<usize>,
        mut paint: impl FnMut(usize, usize, usize, usize),
    ) {
        let [_, rows, bounds] = self.bounds;
        for k in bounds.0.max(slices.start)..(bounds.1 + 1).min(slices.end) {
            for j in rows.0..=rows.1 {
                if let Some((from, to)) = self.row(j, k) {
                    paint(j, k, from, to);
                }
            }
        }
    }

    /// The owned voxels `from..to` of a row.
    fn row(&self, j: usize, k: usize) -> Option<(usize, usize)> {
        let (first, last) = self.bounds[0];
        let (y, z) = (j as f64 - self.origin[1], k as f64 - self.origin[2]);
        // Surely inside: above `low.1` and below `high.0`; surely outside: below `low.0` or above
        // `high.1`; what is between is decided exactly.
        let extent = (last - first) as f64;
        let (mut low, mut high) = ((0.0f64, 0.0f64), (extent, extent));
        let mut unsure = false;
        for face in &self.faces {
            let rest = face.normal[1] * y + face.normal[2] * z + face.offset;
            let slope = face.normal[0];
            let blur = self.error / slope.abs();
            if blur < 0.25 {
                let cross = -rest / slope;
                let blur = blur + 1e-9 * (1.0 + cross.abs());
                if slope > 0.0 {
                    low = (low.0.max(cross - blur), low.1.max(cross + blur));
                } else {
                    high = (high.0.min(cross - blur), high.1.min(cross + blur));
                }
            } else {
                // (Nearly) parallel to the row: the whole row is inside, outside or unsure.
                let margin = self.error + slope.abs() * self.reach;
                if rest < -margin {
                    return None;
                }
                unsure |= rest <= margin;
            }
        }
        if low.0 > high.1 {
            return None;
        }
        let (maybe, sure) = ((low.0.ceil(), high.1.floor()), (low.1.ceil(), high.0.floor()));
        if maybe.0 > maybe.1 {
            return None;
        }
        let (mut from, mut to) = (first + maybe.0 as usize, first + maybe.1 as usize + 1);
        let (sure_from, sure_to) = if unsure || sure.0 > sure.1 {
            (to, from)
        } else {
            (first + sure.0 as usize, first + sure.1 as usize + 1)
        };
        let inside = |i: usize| holds(&self.corners, self.sign, [i as f64, j as f64, k as f64]);
        while from < to && from < sure_from && !inside(from) {
            from += 1;
        }
        while to > from && to > sure_to && !inside(to - 1) {
            to -= 1;
        }
        (from < to).then_some((from, to))
    }
}

impl Face {
    fn new([a, b, c]: [Index; 3], sign: f64) -> Self {
        let u = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        let w = [c[0] - a[0], c[1] - a[1], c[2] - a[2]];
        let normal = [
            sign * (u[2] * w[1] - u[1] * w[2]),
            sign * (u[0] * w[2] - u[2] * w[0]),
            sign * (u[1] * w[0] - u[0] * w[1]),
        ];
        let offset = -(normal[0] * a[0] + normal[1] * a[1] + normal[2] * a[2]);
        Self { normal, offset }
    }
}

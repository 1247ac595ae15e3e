//! The voxels that one tetrahedron owns in a row, exactly; what [`crate::sweep`] is tested against.

use crate::predicate::{FACES, Index, holds, orientation};

/// A run of voxels `from..to` along i in row (j, k).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub(crate) struct Span {
    pub(crate) j: u32,
    pub(crate) k: u32,
    pub(crate) from: u32,
    pub(crate) to: u32,
}

impl Span {
    /// Its voxels, one by one.
    #[inline]
    pub(crate) fn voxels(&self) -> impl Iterator<Item = Self> + use<> {
        let span = *self;
        (span.from..span.to).map(move |from| Self { from, to: from + 1, ..span })
    }
}

/// Rounding error of a face's value in units of (reach)³: about 40 operations of half an ulp,
/// rounded up generously, since a larger value only sends more voxels to the exact test.
pub(crate) const ERROR: f64 = 128.0 * f64::EPSILON;
/// Where a face crosses a row is known to this share of its distance.
pub(crate) const CROSSING_ERROR: f64 = 1e-9;

/// One tetrahedron, prepared for the rows of its box.
pub(crate) struct Rows {
    corners: [Index; 4],
    sign: f64,
    /// Lowest and highest voxel of the box along i, j, k.
    pub(crate) bounds: [(usize, usize); 3],
    /// Integer point near the corners; the faces are taken relative to it to lose less to rounding.
    origin: Index,
    faces: [Face; 4],
    /// Bound of the rounding error of a face's value anywhere in the box.
    error: f64,
    /// Bound of |coordinate| relative to `origin` in the box.
    reach: f64,
}

/// normal·x + offset, positive inside, coordinates relative to the origin of [`Rows`].
#[derive(Clone, Copy, Default)]
struct Face {
    normal: Index,
    offset: f64,
}

impl Rows {
    /// `None` when the tetrahedron is flat or owns nothing in a grid of `size` voxels.
    pub(crate) fn new(corners: [Index; 4], size: [usize; 3]) -> Option<Self> {
        let [p, q, r, s] = &corners;
        let mut bounds = [(0, 0); 3];
        for a in 0..3 {
            bounds[a] = range([p[a], q[a], r[a], s[a]], size[a])?;
        }
        let sign = orientation(corners);
        if sign == 0.0 {
            return None;
        }
        let (mut origin, mut reach) = ([0.0; 3], 1.0);
        let mut local = corners;
        for a in 0..3 {
            origin[a] = bounds[a].0 as f64;
            reach = max(reach, (bounds[a].1 - bounds[a].0) as f64);
            for corner in &mut local {
                corner[a] -= origin[a];
                reach = max(reach, corner[a].abs());
            }
        }
        let mut faces = [Face::default(); 4];
        for (face, [a, b, c]) in faces.iter_mut().zip(FACES) {
            *face = Face::new([local[a], local[b], local[c]], sign);
        }
        let error = ERROR * reach * reach * reach;
        Some(Self { corners, sign, bounds, origin, faces, error, reach })
    }

    /// Adds the owned voxels of a row.
    pub(crate) fn row(&self, j: usize, k: usize, spans: &mut Vec<Span>) {
        if let Some((from, to)) = self.owned(j, k) {
            let [j, k, from, to] = [j, k, from, to].map(|n| n as u32);
            spans.push(Span { j, k, from, to });
        }
    }

    /// The owned voxels `from..to` of a row.
    fn owned(&self, j: usize, k: usize) -> Option<(usize, usize)> {
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
                let blur = blur + CROSSING_ERROR * (1.0 + cross.abs());
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

/// Whole numbers within 0..n that lie in the hull of `values`.
#[inline(always)]
pub(crate) fn range(values: [f64; 4], n: usize) -> Option<(usize, usize)> {
    let [a, b, c, d] = values;
    let low = min(min(a, b), min(c, d)).ceil();
    let high = max(max(a, b), max(c, d)).floor();
    let (low, high) = (max(low, 0.0), min(high, (n - 1) as f64));
    (low <= high).then_some((low as usize, high as usize))
}

/// The smaller; not that of the library, which asks for NaN.
#[inline(always)]
pub(crate) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater.
#[inline(always)]
pub(crate) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl Face {
    #[inline(always)]
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

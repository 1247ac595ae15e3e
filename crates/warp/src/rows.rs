//! The rows of voxels that one tetrahedron owns.

use crate::predicate::{FACES, Index, holds, orientation};
use std::ops::Range;

/// A run of voxels `from..to` along i in row (j, k).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

/// Rows looked at together.
const ROWS: usize = 8;
/// Rounding error of a face's value in units of (reach)³: about 40 operations of half an ulp,
/// rounded up generously, since a larger value only sends more voxels to the exact test.
const ERROR: f64 = 128.0 * f64::EPSILON;
/// Where a face crosses a row is known to this share of its distance.
const CROSSING_ERROR: f64 = 1e-9;
/// Faces whose crossings are known worse than this, voxels, are looked at one row at a time.
const SHARP: f64 = 1e-5;

/// One tetrahedron, prepared for the rows of its box.
pub(crate) struct Rows {
    corners: [Index; 4],
    sign: f64,
    /// Lowest and highest voxel of the box along i, j, k.
    pub(crate) bounds: [(usize, usize); 3],
    /// Integer point near the corners; the faces are taken relative to it to keep digits.
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

/// Where faces cross the rows of a tetrahedron: x = constant + y slope[0] + z slope[1].
#[derive(Clone, Copy, Default)]
struct Crossing {
    constant: f64,
    slopes: [f64; 2],
}

/// All crossings of a tetrahedron none of whose faces is (nearly) parallel to the rows.
struct Crossings {
    /// The first `lows` bound the rows from below, the others from above.
    of_faces: [Crossing; 4],
    lows: usize,
    /// How well they are known, voxels.
    blur: f64,
}

impl Rows {
    /// `None` when the tetrahedron is flat or owns nothing in a grid of `size` voxels.
    #[inline(always)]
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
            reach = most(reach, (bounds[a].1 - bounds[a].0) as f64);
            for corner in &mut local {
                corner[a] -= origin[a];
                reach = most(reach, corner[a].abs());
            }
        }
        let mut faces = [Face::default(); 4];
        for (face, [a, b, c]) in faces.iter_mut().zip(FACES) {
            *face = Face::new([local[a], local[b], local[c]], sign);
        }
        let error = ERROR * reach * reach * reach;
        Some(Self { corners, sign, bounds, origin, faces, error, reach })
    }

    /// Adds the spans within `slices` to `spans`.
    #[inline(always)]
    pub(crate) fn scan(&self, slices: &Range<usize>, spans: &mut Vec<Span>) {
        let [_, _, bounds] = self.bounds;
        let slices = bounds.0.max(slices.start)..(bounds.1 + 1).min(slices.end);
        match self.crossings() {
            Some(crossings) if crossings.lows == 1 => self.blocks::<1>(&crossings, slices, spans),
            Some(crossings) if crossings.lows == 2 => self.blocks::<2>(&crossings, slices, spans),
            Some(crossings) => self.blocks::<3>(&crossings, slices, spans),
            None => {
                for k in slices {
                    for j in self.bounds[1].0..=self.bounds[1].1 {
                        self.row(j, k, spans);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn crossings(&self) -> Option<Crossings> {
        let extent = (self.bounds[0].1 - self.bounds[0].0) as f64;
        let mut of_faces = [Crossing::default(); 4];
        let (mut lows, mut highs) = (0, 4);
        let mut steepest = f64::INFINITY;
        for face in &self.faces {
            let slope = face.normal[0];
            steepest = least(steepest, slope.abs());
            let by = -1.0 / slope;
            let slopes = [face.normal[1] * by, face.normal[2] * by];
            let crossing = Crossing { constant: face.offset * by, slopes };
            if slope > 0.0 {
                of_faces[lows] = crossing;
                lows += 1;
            } else {
                highs -= 1;
                of_faces[highs] = crossing;
            }
        }
        // A crossing beyond the box is known worse, but it need only be known to lie there.
        let blur = self.error / steepest + CROSSING_ERROR * (1.0 + extent);
        (blur < SHARP && (1..4).contains(&lows)).then_some(Crossings { of_faces, lows, blur })
    }

    /// Spans of all rows of the box within `slices`, several rows at once; `L` faces bound them from
    /// below.
    #[inline(always)]
    fn blocks<const L: usize>(
        &self,
        crossings: &Crossings,
        slices: Range<usize>,
        spans: &mut Vec<Span>,
    ) {
        let [(first, last), (low_j, high_j), _] = self.bounds;
        let extent = (last - first) as f64;
        let (lows, highs) = crossings.of_faces.split_at(L);
        for k in slices {
            let z = k as f64 - self.origin[2];
            let mut of_faces = [0.0; 4];
            for (at, crossing) in of_faces.iter_mut().zip(&crossings.of_faces) {
                *at = crossing.constant + z * crossing.slopes[1];
            }
            for block in (low_j..=high_j).step_by(ROWS) {
                let y: [f64; ROWS] = std::array::from_fn(|r| (block - low_j + r) as f64);
                let (mut low, mut high) = ([f64::NEG_INFINITY; ROWS], [f64::INFINITY; ROWS]);
                for (at, crossing) in of_faces.iter().zip(lows) {
                    for r in 0..ROWS {
                        let x = at + y[r] * crossing.slopes[0];
                        low[r] = most(x, low[r]);
                    }
                }
                for (at, crossing) in of_faces[L..].iter().zip(highs) {
                    for r in 0..ROWS {
                        let x = at + y[r] * crossing.slopes[0];
                        high[r] = least(x, high[r]);
                    }
                }
                let ends = Ends::new(&low, &high, crossings.blur, extent);
                let rows = ROWS.min(high_j + 1 - block);
                if ends.unsure {
                    (block..block + rows).for_each(|j| self.row(j, k, spans));
                } else {
                    ends.put(rows, [first, block, k].map(|n| n as u32), spans);
                }
            }
        }
    }

    /// Adds the owned voxels of a row, looked at by itself.
    #[cold]
    #[inline(never)]
    fn row(&self, j: usize, k: usize, spans: &mut Vec<Span>) {
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

/// First voxels and those after the last of several rows, relative to the box.
struct Ends {
    from: [u32; ROWS],
    to: [u32; ROWS],
    /// A face passes so near to a voxel centre that only exact signs tell.
    unsure: bool,
}

/// Adding this to a small whole number leaves the number in the lowest bits.
const WHOLE: f64 = (1u64 << 52) as f64;

impl Ends {
    /// From where faces cross, known to `blur`, in a box `extent` voxels long.
    #[inline(always)]
    fn new(low: &[f64; ROWS], high: &[f64; ROWS], blur: f64, extent: f64) -> Self {
        let within = |x: f64, end: f64| least(most(x, 0.0), end);
        let whole = |x: f64| (x + WHOLE).to_bits() as u32;
        let (mut from, mut to) = ([0; ROWS], [0; ROWS]);
        let mut unsure = 0;
        for r in 0..ROWS {
            let first = within((low[r] - blur).ceil(), extent + 1.0);
            let sure_first = within((low[r] + blur).ceil(), extent + 1.0);
            let end = within((high[r] + blur).floor() + 1.0, extent + 1.0);
            let sure_end = within((high[r] - blur).floor() + 1.0, extent + 1.0);
            (from[r], to[r]) = (whole(first), whole(end));
            unsure |= (whole(sure_first) ^ from[r]) | (whole(sure_end) ^ to[r]);
        }
        Self { from, to, unsure: unsure != 0 }
    }

    /// Adds the spans of the first `rows` rows, which begin at `(i, j)` in slice k.
    #[inline(always)]
    fn put(&self, rows: usize, [i, j, k]: [u32; 3], spans: &mut Vec<Span>) {
        let mut own = [Span::default(); ROWS];
        let mut n = 0;
        for r in 0..rows {
            own[n % ROWS] = Span { j: j + r as u32, k, from: i + self.from[r], to: i + self.to[r] };
            n += usize::from(self.from[r] < self.to[r]);
        }
        spans.extend_from_slice(&own[..n.min(ROWS)]);
    }
}

/// Whole numbers within 0..n that lie in the hull of `values`.
#[inline(always)]
pub(crate) fn range(values: [f64; 4], n: usize) -> Option<(usize, usize)> {
    let [a, b, c, d] = values;
    let low = least(least(a, b), least(c, d)).ceil();
    let high = most(most(a, b), most(c, d)).floor();
    let (low, high) = (most(low, 0.0), least(high, (n - 1) as f64));
    (low <= high).then_some((low as usize, high as usize))
}

/// The lesser; not that of the library, which asks for NaN.
#[inline(always)]
pub(crate) fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater.
#[inline(always)]
pub(crate) fn most(a: f64, b: f64) -> f64 {
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

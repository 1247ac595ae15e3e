//! Several tetrahedra at once: their boxes, faces, volumes, and where faces cross rows of voxels.
//!
//! The same as in [`crate::rows`], which looks at single rows of single tetrahedra with exact signs
//! and is asked where what is known here is not enough.

use crate::predicate::{FACES, Index};
use crate::rows::{CROSSING_ERROR, ERROR};
use supine_space::{LANES, Pack};

/// A vector of each of several tetrahedra.
pub(crate) type Triple = [Pack; 3];

/// Up to [`LANES`] tetrahedra in the index space of a grid.
pub(crate) struct Batch {
    /// Lowest and highest voxel of each box along i, j, k; the lowest is above the highest where
    /// there is none.
    pub(crate) first: Triple,
    pub(crate) last: Triple,
    /// Corners relative to `first`.
    pub(crate) corners: [Triple; 4],
    /// normal·x + offset of face f, x relative to `first`, is positive inside and `volume` at
    /// corner f.
    pub(crate) normals: [Triple; 4],
    offsets: [Pack; 4],
    /// Six times the volume of each in voxels, not negative.
    pub(crate) volume: Pack,
    /// Bound of the rounding error of a face's value anywhere in the box.
    error: Pack,
}

/// Where the faces of several tetrahedra cross rows: x = constant + y slopes\[0\] + z slopes\[1\],
/// all relative to the first voxel of the box.
pub(crate) struct Crossings {
    /// Constant, slope along j, slope along k of each face.
    pub(crate) faces: [[[f32; LANES]; 3]; 4],
    /// What is added where a face bounds rows from below, and from above: nothing, or where it does
    /// not, so much that it does not count.
    pub(crate) low: [[f32; LANES]; 4],
    pub(crate) high: [[f32; LANES]; 4],
    /// The last voxel of each box along i, relative to its first.
    pub(crate) last: [f32; LANES],
    /// How well crossings are known, voxels.
    pub(crate) blur: [f32; LANES],
}

/// Roundings of one f32 in a crossing come to this share of its largest term at most; four units of
/// the last digit, twice.
const SINGLE_ERROR: f64 = 8.0 * f32::EPSILON as f64;
/// Crossings known worse than this, voxels, are not worth looking at.
const SHARP: f32 = 1.0 / 64.0;
/// Farther than anything that is known well enough, voxels.
const FAR: f32 = 1e9;

impl Batch {
    /// Of tetrahedra with these corners, over a grid of `size` voxels.
    #[inline(always)]
    pub(crate) fn new(corners: [Triple; 4], size: [usize; 3]) -> Self {
        let mut local = corners;
        let (mut first, mut last) = ([Pack::ZERO; 3], [Pack::ZERO; 3]);
        let mut reach = Pack::all(1.0);
        for a in 0..3 {
            let [p, q, r, s] = [local[0][a], local[1][a], local[2][a], local[3][a]];
            let low = p.min(q).min(r.min(s)).ceil().max(Pack::ZERO);
            let high = p.max(q).max(r.max(s)).floor();
            (first[a], last[a]) = (low, high.min(Pack::all((size[a] - 1) as f64)));
            reach = reach.max(last[a] - first[a]);
            for corner in &mut local {
                corner[a] = corner[a] - first[a];
                reach = reach.max(corner[a].abs());
            }
        }
        let (mut normals, mut offsets) = ([[Pack::ZERO; 3]; 4], [Pack::ZERO; 4]);
        for ((normal, offset), [a, b, c]) in normals.iter_mut().zip(&mut offsets).zip(FACES) {
            let [a, b, c] = [local[a], local[b], local[c]];
            *normal = cross(less(c, a), less(b, a));
            *offset = Pack::ZERO - dot(*normal, a);
        }
        let volume = dot(normals[0], local[0]) + offsets[0];
        let sign = volume.sign();
        for (normal, offset) in normals.iter_mut().zip(&mut offsets) {
            *normal = scaled(*normal, sign);
            *offset = *offset * sign;
        }
        let error = Pack::all(ERROR) * reach * reach * reach;
        Self { first, last, corners: local, normals, offsets, volume: volume * sign, error }
    }

    /// The boxes: first voxel and number of voxels along i, j, k, which is below 1 where there is
    /// none.
    #[inline(always)]
    pub(crate) fn extents(&self) -> [[[i32; LANES]; 3]; 2] {
        let [mut first, mut count] = [[[0; LANES]; 3]; 2];
        for a in 0..3 {
            for lane in 0..LANES {
                first[a][lane] = self.first[a].0[lane] as i32;
                count[a][lane] = self.last[a].0[lane] as i32 + 1 - first[a][lane];
            }
        }
        [first, count]
    }

    /// Where faces cross rows.
    #[inline(always)]
    pub(crate) fn crossings(&self) -> Crossings {
        let mut faces = [[[0.0; LANES]; 3]; 4];
        let (mut low, mut high) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
        let [x, y, z] = less(self.last, self.first);
        let (mut steepest, mut largest) = (Pack::all(f64::INFINITY), Pack::ZERO);
        for (f, (normal, offset)) in self.normals.iter().zip(self.offsets).enumerate() {
            let by = Pack::all(-1.0) / normal[0];
            let terms = [offset * by, normal[1] * by, normal[2] * by];
            steepest = steepest.min(normal[0].abs());
            largest = largest.max(terms[0].abs() + terms[1].abs() * y + terms[2].abs() * z);
            for lane in 0..LANES {
                let below = normal[0].0[lane] > 0.0;
                low[f][lane] = if below { 0.0 } else { -FAR };
                high[f][lane] = if below { FAR } else { 0.0 };
            }
            for n in 0..3 {
                faces[f][n] = terms[n].single();
            }
        }
        // A crossing beyond the box is known worse, but it need only be known to lie there.
        let own = self.error / steepest + Pack::all(CROSSING_ERROR) * (Pack::all(1.0) + x);
        let blur = own + Pack::all(SINGLE_ERROR) * largest;
        // Where the sign of the volume is not known, nothing is.
        let mut blur = (blur * Pack::all(1.0 + f64::from(f32::EPSILON))).single();
        for lane in 0..LANES {
            let known = self.volume.0[lane] > self.error.0[lane];
            blur[lane] = if known { blur[lane] } else { f32::INFINITY };
        }
        Crossings { faces, low, high, last: x.single(), blur }
    }
}

impl Crossings {
    /// Whether enough is known of one. Then there are faces of both kinds: where rounding makes all
    /// of one kind, the steepest is not known at all.
    #[inline(always)]
    pub(crate) fn known(&self, lane: usize) -> bool {
        self.blur[lane] < SHARP
    }
}

/// The corners of some of `tets`.
#[inline(always)]
pub(crate) fn gathered(vertices: &[Index], tets: &[[u32; 4]], some: &[u32; LANES]) -> [Triple; 4] {
    let mut all = [[Pack::ZERO; 3]; 4];
    for (lane, tet) in some.iter().enumerate() {
        for (v, corner) in tets[*tet as usize].iter().enumerate() {
            let corner = &vertices[*corner as usize];
            for a in 0..3 {
                all[v][a].0[lane] = corner[a];
            }
        }
    }
    all
}

#[inline(always)]
pub(crate) fn scaled(a: Triple, by: Pack) -> Triple {
    [a[0] * by, a[1] * by, a[2] * by]
}

#[inline(always)]
pub(crate) fn less(a: Triple, b: Triple) -> Triple {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot(a: Triple, b: Triple) -> Pack {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross(a: Triple, b: Triple) -> Triple {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

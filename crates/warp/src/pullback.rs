//! The affine map of one tetrahedron in index space, and sampling through it.

use crate::predicate::Index;
use crate::rows::{max, min};

/// Takes a deformed position to its place in the CT, both as continuous indices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pullback {
    /// Barycentric coordinates are `slope * (p - anchor)`, of corners 1, 2, 3.
    slope: [Index; 3],
    anchor: Index,
    /// Corners of the CT side.
    source: [Index; 4],
    low: Index,
    high: Index,
}

impl Pullback {
    /// The map of the tetrahedron `deformed` onto the tetrahedron `source`.
    ///
    /// Nearly flat tetrahedra give results that are far off in floating point; they are held
    /// within the box of `source`.
    #[inline(always)]
    pub(crate) fn new(deformed: [Index; 4], source: [Index; 4]) -> Self {
        let anchor = deformed[0];
        let (u, v, w) =
            (less(deformed[1], anchor), less(deformed[2], anchor), less(deformed[3], anchor));
        let normals = [cross(v, w), cross(w, u), cross(u, v)];
        let volume = dot(u, normals[0]);
        let (mut slope, mut low, mut high) = (normals, source[0], source[0]);
        for a in 0..3 {
            for normal in &mut slope {
                normal[a] /= volume;
            }
            for corner in &source[1..] {
                low[a] = min(low[a], corner[a]);
                high[a] = max(high[a], corner[a]);
            }
        }
        Self { slope, anchor, source, low, high }
    }

    /// The place in the CT of `origin`, and its change along i, j, k (a row for each axis of the
    /// CT), not held within the hull.
    #[inline(always)]
    pub(crate) fn affine(&self, origin: Index) -> (Index, [Index; 3]) {
        let [o, s, t, u] = self.source;
        let from = less(origin, self.anchor);
        let (mut constant, mut rows) = (o, [[0.0; 3]; 3]);
        for a in 0..3 {
            let edges = [s[a] - o[a], t[a] - o[a], u[a] - o[a]];
            for (edge, slope) in edges.iter().zip(&self.slope) {
                for b in 0..3 {
                    rows[a][b] += edge * slope[b];
                }
            }
            constant[a] += dot(rows[a], from);
        }
        (constant, rows)
    }

    /// Barycentric coordinates of a voxel.
    #[inline]
    pub(crate) fn weights(&self, p: Index) -> [f64; 4] {
        let from = [0, 1, 2].map(|a| p[a] - self.anchor[a]);
        let [b, c, d] = self.slope.map(|s| dot(s, from));
        [1.0 - b - c - d, b, c, d]
    }

    /// The place in the CT of a deformed position.
    #[inline]
    pub(crate) fn at(&self, p: Index) -> Index {
        let [_, b, c, d] = self.weights(p);
        let [o, s, t, u] = self.source;
        // max and min also turn a NaN of a nearly flat tetrahedron into a place in the box.
        [0, 1, 2].map(|a| {
            let q = o[a] + (b * (s[a] - o[a]) + c * (t[a] - o[a]) + d * (u[a] - o[a]));
            q.max(self.low[a]).min(self.high[a])
        })
    }
}

#[inline(always)]
fn less(a: Index, b: Index) -> Index {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: Index, b: Index) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn cross(a: Index, b: Index) -> Index {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Trilinear sample in f64 at a continuous index, clamped to the volume; `size` is 2 or more along
/// each axis. The cell along an axis is `min(floor q, n - 2)`.
#[inline]
pub(crate) fn trilinear(data: &[i16], size: [usize; 3], q: Index) -> f64 {
    let mut cell = [0usize; 3];
    let mut t = [0f64; 3];
    for a in 0..3 {
        let x = q[a].clamp(0.0, (size[a] - 1) as f64);
        cell[a] = (x as usize).min(size[a] - 2);
        t[a] = x - cell[a] as f64;
    }
    let row = size[0];
    let start = (cell[2] * size[1] + cell[1]) * row + cell[0];
    let along = |n: usize| {
        let (a, b) = (f64::from(data[n]), f64::from(data[n + 1]));
        (1.0 - t[0]) * a + t[0] * b
    };
    let plane = |n: usize| (1.0 - t[1]) * along(n) + t[1] * along(n + row);
    (1.0 - t[2]) * plane(start) + t[2] * plane(start + row * size[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_takes_corners_to_corners_and_flat_ones_stay_in_the_box() {
        let p = [[0.5, 0.0, 0.0], [3.0, 0.5, 0.0], [0.0, 4.0, 1.0], [1.0, 1.0, 5.0]];
        let q = [[1.0, 2.0, 3.0], [4.0, 2.5, 3.5], [1.5, 7.0, 3.0], [0.0, 2.0, 9.0]];
        let map = Pullback::new(p, q);
        for v in 0..4 {
            let at = map.at(p[v]);
            assert!((0..3).all(|a| (at[a] - q[v][a]).abs() < 1e-12), "{v}: {at:?}");
        }
        let flat = Pullback::new([p[0], p[1], p[2], p[0]], q);
        let at = flat.at([1.0; 3]);
        assert!((0..3).all(|a| at[a] >= flat.low[a] && at[a] <= flat.high[a]), "{at:?}");
    }
}

//! The affine map of one tetrahedron in index space, and sampling through it.

use crate::predicate::Index;

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
    pub(crate) fn new(deformed: [Index; 4], source: [Index; 4]) -> Self {
        let anchor = deformed[0];
        let edge = |v: usize| [0, 1, 2].map(|a| deformed[v][a] - anchor[a]);
        let (u, v, w) = (edge(1), edge(2), edge(3));
        let volume = dot(u, cross(v, w));
        let slope = [cross(v, w), cross(w, u), cross(u, v)].map(|n| n.map(|c| c / volume));
        let corner = |f: fn(f64, f64) -> f64| {
            [0, 1, 2].map(|a| source.iter().skip(1).fold(source[0][a], |m, s| f(m, s[a])))
        };
        Self { slope, anchor, source, low: corner(f64::min), high: corner(f64::max) }
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

fn dot(a: Index, b: Index) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

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

/// Nearest i16, halves to even, saturated.
#[inline]
pub(crate) fn to_hu(value: f64) -> i16 {
    value.round_ties_even() as i16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_go_to_even_and_large_values_saturate() {
        assert_eq!([0.5, 1.5, -0.5, -1.5, -2.5].map(to_hu), [0, 2, 0, -2, -2]);
        assert_eq!([4e4, -4e4].map(to_hu), [i16::MAX, i16::MIN]);
    }

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

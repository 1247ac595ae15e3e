//! The surface on which a function on layers of pixels is 0.

use std::collections::HashMap;
use supine_space::Point;

/// Values on a box of points: i fastest, then j, then layers.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Points along i and j.
    pub size: [usize; 2],
    /// One plane of values per layer, negative inside.
    pub values: &'a [Vec<f32>],
}

/// Corners of a cube, as bits i, j, k, on the six ways from one corner to the opposite one. Each is
/// a tetrahedron with the same orientation as the axes.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The surface, triangles counter-clockwise from outside when i, j, layers are right-handed in
/// space, as points that `place(i, j, layer)` puts between two neighbours, linearly.
///
/// Marching tetrahedra on cubes cut the same way everywhere, so that the surface is closed when the
/// outer values are all positive. Source: Doi and Koide, IEICE Trans. E74, 1991.
///
/// # Panics
/// When a layer has fewer values than `size` says.
pub fn isosurface(
    layers: &Layers<'_>,
    place: impl Fn([usize; 3]) -> Point,
) -> (Vec<Point>, Vec<[u32; 3]>) {
    let [ni, nj] = layers.size;
    let mut surface = Surface {
        size: layers.size,
        place,
        points: vec![],
        triangles: vec![],
        known: HashMap::new(),
    };
    for k in 1..layers.values.len() {
        let planes = [&layers.values[k - 1], &layers.values[k]];
        // Points of the layer below the last two are never asked for again.
        surface.known.retain(|&(_, last), _| last >= ni * nj * (k - 1));
        for j in 1..nj {
            for i in 1..ni {
                let corner = |bits: usize| {
                    let (i, j) = (i - 1 + (bits & 1), j - 1 + (bits >> 1 & 1));
                    let value = planes[bits >> 2][j * ni + i];
                    (((k - 1 + (bits >> 2)) * nj + j) * ni + i, value)
                };
                let corners: [(usize, f32); 8] = std::array::from_fn(corner);
                let inside = corners.iter().filter(|c| c.1 < 0.0).count();
                if inside > 0 && inside < 8 {
                    TETRAHEDRA.iter().for_each(|t| surface.cut(t.map(|c| corners[c])));
                }
            }
        }
    }
    (surface.points, surface.triangles)
}

struct Surface<P> {
    size: [usize; 2],
    place: P,
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    /// Points by the two neighbours that they lie between.
    known: HashMap<(usize, usize), u32>,
}

impl<P: Fn([usize; 3]) -> Point> Surface<P> {
    /// The part of the surface in a tetrahedron of right-handed corners.
    fn cut(&mut self, corners: [(usize, f32); 4]) {
        let mut order = [0, 1, 2, 3];
        // The inner ones first; the orientation stays when an even number of pairs is exchanged.
        order.sort_by_key(|&c| corners[c].1 >= 0.0);
        let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        if pairs.iter().filter(|&&(a, b)| order[a] > order[b]).count() % 2 == 1 {
            // Among the outer ones, or the inner ones where only one is outside.
            let (a, b) = if corners[order[2]].1 >= 0.0 { (2, 3) } else { (0, 1) };
            order.swap(a, b);
        }
        let [a, b, c, d] = order.map(|n| corners[n]);
        match corners.iter().filter(|c| c.1 < 0.0).count() {
            1 => {
                let triangle = [(a, b), (a, c), (a, d)].map(|(p, q)| self.between(p, q));
                self.triangles.push(triangle);
            }
            2 => {
                let [p, q, r, s] =
                    [(a, c), (a, d), (b, d), (b, c)].map(|(p, q)| self.between(p, q));
                self.triangles.extend([[p, q, r], [p, r, s]]);
            }
            3 => {
                let triangle = [(a, d), (b, d), (c, d)].map(|(p, q)| self.between(p, q));
                self.triangles.push(triangle);
            }
            _ => {}
        }
    }

    /// The point between an inner and an outer corner.
    fn between(&mut self, inner: (usize, f32), outer: (usize, f32)) -> u32 {
        let key = (inner.0.min(outer.0), inner.0.max(outer.0));
        let [ni, nj] = self.size;
        *self.known.entry(key).or_insert_with(|| {
            let [p, q] =
                [inner.0, outer.0].map(|n| (self.place)([n % ni, n / ni % nj, n / (ni * nj)]));
            let share = f64::from(inner.1) / (f64::from(inner.1) - f64::from(outer.1));
            self.points.push(p + (q - p) * share);
            (self.points.len() - 1) as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_closed_and_winds_counter_clockwise_from_outside() {
        let from_centre = |n: usize, k: usize| {
            let from =
                Point::new((n % 13) as f64, (n / 13) as f64, k as f64) - Point::from([6.0; 3]);
            from.norm() as f32 - 4.5
        };
        let values: Vec<Vec<f32>> =
            (0..13).map(|k| (0..169).map(|n| from_centre(n, k)).collect()).collect();
        let layers = Layers { size: [13, 13], values: &values };
        let (points, triangles) = isosurface(&layers, |ijk| ijk.map(|c| 2.0 * c as f64).into());
        assert!(points.iter().all(|p| ((p - Point::from([12.0; 3])).norm() - 9.0).abs() < 0.2));
        let mut edges = HashMap::new();
        for [a, b, c] in &triangles {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                *edges.entry((p.min(q), p.max(q))).or_insert(0) += if p < q { 1 } else { -1 };
            }
        }
        assert!(edges.values().all(|&turns| turns == 0));
        let part = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|p| points[p as usize].coords);
            a.dot(&b.cross(&c)) / 6.0
        };
        let volume: f64 = triangles.iter().map(part).sum();
        assert!(
            (volume / (4.0 / 3.0 * std::f64::consts::PI * 729.0) - 1.0).abs() < 0.04,
            "{volume}"
        );
    }
}

//! Changes of connection without change of vertices: edge removal and the 2-3 flip.

use crate::complex::EDGES;
use crate::mesher::Mesher;
use crate::shape::{det, shape};
use std::ops::RangeInclusive;
use supine_space::Vector;

/// Longest ring of an edge that is tried.
const LONGEST_RING: usize = 8;
/// Least gain in quality of a swap.
const GAIN: f64 = 1e-3;

/// The vertices around an edge ab in order, and the tetrahedra between them: tetrahedron i lies
/// between vertex i and i + 1; all (a, b, i, i + 1) are positive.
struct Ring {
    vertices: Vec<u32>,
    tets: Vec<u32>,
    /// The tag of the edge when it is on the boundary: then the ring is open.
    tag: Option<u8>,
}

/// A way to fill a ring without its edge: for i < j the best vertex between them.
struct Filling {
    between: Vec<Vec<usize>>,
    quality: f64,
}

impl Mesher<'_> {
    /// Removes the edge ab when that betters the worst tetrahedron at it by more than `gain` and
    /// changes the count by a number in `delta`. On the boundary this flips the edge.
    ///
    /// The best filling of the ring is found by dynamic programming (Shewchuk 2002, "Two discrete
    /// optimization algorithms for the topological improvement of tetrahedral meshes").
    pub(crate) fn remove_edge(
        &mut self,
        a: u32,
        b: u32,
        gain: f64,
        delta: &RangeInclusive<i64>,
    ) -> bool {
        let Some(ring) = self.ordered_ring(a, b) else { return false };
        let n = ring.vertices.len();
        let change = 2 * (n as i64 - 2) - ring.tets.len() as i64;
        if n < 3 || !delta.contains(&change) {
            return false;
        }
        if ring.tag.is_some() && !self.may_flip(a, b, &ring) {
            return false;
        }
        let lowest = self.mesh.worst_of(&ring.tets) + gain;
        self.replace(a, b, &ring, lowest)
    }

    /// Flips the boundary edge ab when all its new tetrahedra are better than `least` of the worst
    /// old one, the count changes by a number in `delta`, and `wanted` says so: tag, the two faces
    /// before and the two after, corners outwards.
    pub(crate) fn flip_edge(
        &mut self,
        [a, b]: [u32; 2],
        delta: &RangeInclusive<i64>,
        lowest: impl Fn(f64) -> f64,
        wanted: impl Fn(&Self, u8, [[Vector; 3]; 2], [[Vector; 3]; 2]) -> bool,
    ) -> bool {
        let Some(ring) = self.ordered_ring(a, b) else { return false };
        let Some(tag) = ring.tag else { return false };
        let change = ring.vertices.len() as i64 - 3;
        if !delta.contains(&change) {
            return false;
        }
        let [before, after] = self.flipped_faces(a, b, &ring);
        if !wanted(self, tag, before, after) || !self.may_flip(a, b, &ring) {
            return false;
        }
        let lowest = lowest(self.mesh.worst_of(&ring.tets));
        self.replace(a, b, &ring, lowest)
    }

    /// Fills the ring of ab without that edge when all is better than `least`.
    fn replace(&mut self, a: u32, b: u32, ring: &Ring, lowest: f64) -> bool {
        let Some(filling) = self.fill(a, b, ring, lowest.max(0.0)) else { return false };
        debug_assert!(filling.quality > lowest);
        self.refill(a, b, ring, &filling);
        true
    }

    /// The two faces at the boundary edge ab and the two that would be in their place, corners
    /// outwards.
    fn flipped_faces(&self, a: u32, b: u32, ring: &Ring) -> [[[Vector; 3]; 2]; 2] {
        let (first, last) = (ring.vertices[0], ring.vertices[ring.vertices.len() - 1]);
        // (a, b, first, ...) is positive: seen from outside, a, first, b turn counter-clockwise
        // around the first face.
        let faces = [[[a, first, b], [a, b, last]], [[a, first, last], [b, last, first]]];
        faces.map(|pair| pair.map(|face| face.map(|v| self.mesh.points[v as usize])))
    }

    fn ordered_ring(&self, a: u32, b: u32) -> Option<Ring> {
        let mesh = &self.mesh;
        let ids = mesh.ring(a, b);
        if ids.len() < 2 || ids.len() > LONGEST_RING {
            return None;
        }
        let (class, faces) = mesh.edge_class(&ids, a, b);
        let tag = match (faces, class.count_ones()) {
            (0, _) => None,
            (2, 1) => Some(class.trailing_zeros() as u8 + 1),
            _ => return None,
        };
        let mut steps = Vec::with_capacity(ids.len());
        for &id in &ids {
            let mut rest = mesh.tets[id as usize].into_iter().filter(|&v| v != a && v != b);
            let (c, d) = (rest.next()?, rest.next()?);
            let positive = det(&mesh.corners([a, b, c, d])) > 0.0;
            steps.push(if positive { (c, d, id) } else { (d, c, id) });
        }
        let first = match tag {
            Some(_) => steps.iter().find(|s| steps.iter().all(|t| t.1 != s.0))?.0,
            None => steps.iter().map(|s| s.0).min()?,
        };
        let mut ring = Ring { vertices: vec![first], tets: Vec::new(), tag };
        let mut here = first;
        for _ in 0..steps.len() {
            let step = steps.iter().find(|s| s.0 == here)?;
            here = step.1;
            ring.vertices.push(here);
            ring.tets.push(step.2);
        }
        if tag.is_none() && ring.vertices.pop() != Some(first) {
            return None;
        }
        Some(ring)
    }

    /// Whether the boundary edge ab may be flipped to the ends of its ring.
    fn may_flip(&self, a: u32, b: u32, ring: &Ring) -> bool {
        let (first, last) = (ring.vertices[0], ring.vertices[ring.vertices.len() - 1]);
        let Some(tag) = ring.tag else { return true };
        if self.mesh.neighbours(first).binary_search(&last).is_ok() {
            return false;
        }
        if !self.bridges_no_more([first, last], [a, b]) {
            return false;
        }
        let faults = |faces: [[Vector; 3]; 2]| {
            faces.map(|f| self.face_fault(tag, &f)).into_iter().fold(0.0, f64::max)
        };
        let [before, after] = self.flipped_faces(a, b, ring);
        let fault = faults(after);
        fault == 0.0 || fault <= faults(before)
    }

    /// The best filling, if it is better than `least` everywhere.
    fn fill(&self, a: u32, b: u32, ring: &Ring, lowest: f64) -> Option<Filling> {
        let n = ring.vertices.len();
        let p: Vec<Vector> = ring.vertices.iter().map(|&v| self.mesh.points[v as usize]).collect();
        let (pa, pb) = (self.mesh.points[a as usize], self.mesh.points[b as usize]);
        let mut best = vec![vec![f64::INFINITY; n]; n];
        let mut between = vec![vec![0; n]; n];
        for span in 2..n {
            for i in 0..n - span {
                let j = i + span;
                let mut top = -1.0f64;
                for k in i + 1..j {
                    let mut quality = best[i][k].min(best[k][j]);
                    if quality <= top.max(lowest) {
                        continue;
                    }
                    quality = quality.min(shape(&[p[i], p[k], p[j], pb]));
                    if quality <= top.max(lowest) {
                        continue;
                    }
                    quality = quality.min(shape(&[p[i], p[j], p[k], pa]));
                    if quality > top {
                        top = quality;
                        between[i][j] = k;
                    }
                }
                best[i][j] = top;
            }
        }
        let quality = best[0][n - 1];
        (quality > lowest).then_some(Filling { between, quality })
    }

    fn refill(&mut self, a: u32, b: u32, ring: &Ring, filling: &Filling) {
        let mesh = &mut self.mesh;
        let n = ring.vertices.len();
        // Tags of the outer faces on the side of a (opposite b) and of b.
        let outer = |apex: u32| -> Vec<u8> {
            let opposite = if apex == a { b } else { a };
            let tag = |&id: &u32| mesh.tags[id as usize][mesh.corner_of(id, opposite)];
            ring.tets.iter().map(tag).collect()
        };
        let (side_a, side_b) = (outer(a), outer(b));
        let tag = |side: &[u8], i: usize, j: usize| {
            if j == i + 1 {
                side[i]
            } else if i == 0 && j == n - 1 {
                ring.tag.unwrap_or_else(|| side[n - 1])
            } else {
                0
            }
        };
        let mut new = Vec::with_capacity(2 * n);
        let mut open = vec![(0, n - 1)];
        while let Some((i, j)) = open.pop() {
            if j < i + 2 {
                continue;
            }
            let k = filling.between[i][j];
            let [vi, vj, vk] = [i, j, k].map(|x| ring.vertices[x]);
            let (b_tags, a_tags) = (&side_b, &side_a);
            new.push((
                [vi, vk, vj, b],
                [tag(b_tags, k, j), tag(b_tags, i, j), tag(b_tags, i, k), 0],
            ));
            new.push((
                [vi, vj, vk, a],
                [tag(a_tags, k, j), tag(a_tags, i, k), tag(a_tags, i, j), 0],
            ));
            open.extend([(i, k), (k, j)]);
        }
        ring.tets.iter().for_each(|&id| mesh.remove(id));
        for (tet, tags) in new {
            mesh.add(tet, tags);
        }
    }

    /// Replaces tetrahedron `id` and its neighbour across `corner` by three around a new edge,
    /// when all three are better than `least`.
    pub(crate) fn flip_face(&mut self, id: u32, corner: usize, lowest: f64) -> bool {
        let mesh = &mut self.mesh;
        if mesh.tags[id as usize][corner] != 0 {
            return false;
        }
        let Some(other) = mesh.across(id, corner) else { return false };
        let below = mesh.tets[id as usize][corner];
        let face = mesh.face(id, corner);
        let Some(above) = mesh.tets[other as usize].into_iter().find(|v| !face.contains(v)) else {
            return false;
        };
        // The face is counter-clockwise seen from above: (below, above, p, q) is positive.
        let sides = [[0, 1], [1, 2], [2, 0]].map(|e| e.map(|c: usize| face[c]));
        let tets = sides.map(|[p, q]| [below, above, p, q]);
        if tets.iter().any(|t| shape(&mesh.corners(*t)) <= lowest) {
            return false;
        }
        if mesh.star[below as usize].iter().any(|&t| mesh.tets[t as usize].contains(&above)) {
            return false;
        }
        let tags = sides.map(|side| {
            let third = face.into_iter().find(|v| !side.contains(v)).unwrap_or(below);
            let of = |t: u32| mesh.tags[t as usize][mesh.corner_of(t, third)];
            // Opposite below lies the face with above, which was the other tetrahedron's.
            [of(other), of(id), 0, 0]
        });
        mesh.remove(id);
        mesh.remove(other);
        for (tet, tags) in tets.into_iter().zip(tags) {
            mesh.add(tet, tags);
        }
        true
    }

    /// One swap that betters tetrahedron `id`, if there is one.
    pub(crate) fn swap_at(&mut self, id: u32, delta: &RangeInclusive<i64>) -> bool {
        let tet = self.mesh.tets[id as usize];
        if EDGES.iter().any(|&[p, q]| self.remove_edge(tet[p], tet[q], GAIN, delta)) {
            return true;
        }
        delta.contains(&1) && (0..4).any(|corner| self.flip_if_better(id, corner))
    }

    fn flip_if_better(&mut self, id: u32, corner: usize) -> bool {
        let Some(other) = self.mesh.across(id, corner) else { return false };
        let worst = self.mesh.worst_of(&[id, other]);
        self.flip_face(id, corner, worst + GAIN)
    }

    /// Swaps at all tetrahedra worse than `threshold`, worst first; returns how many.
    pub(crate) fn swap_all(&mut self, threshold: f64, delta: &RangeInclusive<i64>) -> usize {
        let mut swaps = 0;
        for id in self.bad(threshold) {
            let n = id as usize;
            if self.mesh.live[n] && self.mesh.quality[n] < threshold && self.swap_at(id, delta) {
                swaps += 1;
            }
        }
        swaps
    }
}

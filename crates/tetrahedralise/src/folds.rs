//! Rims that double back on themselves.
//!
//! Where two surfaces meet at a small angle the cut can leave vertices of their rim out of order.
//! No move of a single vertex betters such a fold, and every tetrahedron at it stays bad.

use crate::collapse::CollapseRule;
use crate::complex::Class;
use crate::mesher::Mesher;
use std::collections::BTreeMap;

/// Tetrahedra may be this bad after a fold is taken out, or as bad as before.
const FLOOR: f64 = 0.02;

impl Mesher<'_> {
    /// Merges vertices at which a rim turns back by more than a right angle into the nearer of
    /// their neighbours along it; returns how many.
    pub(crate) fn unfold_rims(&mut self) -> usize {
        let mut unfolded = 0;
        for (v, near) in self.rim_neighbours() {
            let [a, b] = near[..] else { continue };
            let there = |w: u32| !self.mesh.star[w as usize].is_empty();
            if ![v, a, b].into_iter().all(there) || !self.turns_back(v, [a, b]) {
                continue;
            }
            let mut edges = [[v, a], [v, b]];
            edges.sort_by(|p, q| self.mesh.length(*p).total_cmp(&self.mesh.length(*q)));
            let rule = CollapseRule { floor: FLOOR, longest: f64::INFINITY };
            let done = edges.into_iter().any(|[v, w]| {
                let at = self.mesh.points[w as usize];
                self.collapse(v, w, at, rule)
            });
            unfolded += usize::from(done);
        }
        unfolded
    }

    /// Draws the vertices of rims towards the middle of their neighbours along it, as far as the
    /// tetrahedra bear it.
    pub(crate) fn relax_rims(&mut self) {
        for (v, near) in self.rim_neighbours() {
            let [a, b] = near[..] else { continue };
            let Some(to) = self.project(v, self.mesh.middle([a, b])) else { continue };
            self.draw(v, to);
        }
    }

    fn turns_back(&self, v: u32, [a, b]: [u32; 2]) -> bool {
        let p = |v: u32| self.mesh.points[v as usize];
        (p(a) - p(v)).dot(&(p(b) - p(v))) > 0.0
    }

    /// The vertices joined to each vertex of a rim by edges of the rim.
    fn rim_neighbours(&self) -> BTreeMap<u32, Vec<u32>> {
        let mut near: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for [a, b] in self.rim_edges().into_keys() {
            near.entry(a).or_default().push(b);
            near.entry(b).or_default().push(a);
        }
        near
    }

    /// The edges between two tags, lower vertex first, with the class of both.
    pub(crate) fn rim_edges(&self) -> BTreeMap<[u32; 2], Class> {
        let mesh = &self.mesh;
        let both = |[a, b]: [u32; 2]| mesh.class[a as usize] & mesh.class[b as usize];
        let edges = self.surface_edges().into_iter().filter(|&e| both(e).count_ones() > 1);
        let class = |[a, b]: [u32; 2]| mesh.edge_class(&mesh.ring(a, b), a, b).0;
        edges.map(|e| (e, class(e))).filter(|(_, class)| class.count_ones() > 1).collect()
    }
}

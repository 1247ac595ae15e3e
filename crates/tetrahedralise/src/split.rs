//! Splitting an edge.

use crate::mesher::Mesher;
use crate::shape::shape;

impl Mesher<'_> {
    /// Splits the edge ab in its middle (on the surface or rim it lies on) and returns the new
    /// vertex; refused when a part would be worse than `floor`.
    pub(crate) fn split(&mut self, a: u32, b: u32, floor: f64) -> Option<u32> {
        let ring = self.mesh.ring(a, b);
        if ring.is_empty() {
            return None;
        }
        let (class, faces) = self.mesh.edge_class(&ring, a, b);
        let class = if faces == 2 { class } else { 0 };
        let mut level = [0.0; 3];
        for f in (0..3).filter(|f| class >> f & 1 == 1) {
            let at = |v: u32| self.mesh.level[v as usize][f];
            level[f] = 0.5 * (at(a) + at(b));
        }
        let middle = self.fields().project(class, self.mesh.middle([a, b]), &level)?;
        for &id in &ring {
            let tet = self.mesh.tets[id as usize];
            for gone in [a, b] {
                let mut part = self.mesh.corners(tet);
                part[self.mesh.corner_of(id, gone)] = middle;
                if shape(&part) < floor {
                    return None;
                }
            }
        }
        let v = self.mesh.bisect([a, b], middle, class);
        self.mesh.level[v as usize] = level;
        Some(v)
    }
}

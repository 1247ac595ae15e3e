//! The edges of a mesh, which carry the mid-side nodes of quadratic elements.

use crate::TetMesh;

/// Corners of the edges of a tetrahedron, in the order of the mid-side nodes of a quadratic one.
pub const TET_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// The unique edges of a mesh, sorted by (lower, higher) point.
#[derive(Clone, Debug)]
pub struct Edges {
    ends: Vec<[u32; 2]>,
    of_tets: Vec<[u32; 6]>,
}

impl Edges {
    /// The edges of `mesh`.
    pub fn new(mesh: &TetMesh) -> Self {
        let edge = |tet: &[u32; 4], [a, b]: [usize; 2]| {
            let (a, b) = (tet[a], tet[b]);
            [a.min(b), a.max(b)]
        };
        // The higher ends of each point's edges, one point after the other.
        let points = mesh.points().len();
        let mut next = vec![0usize; points + 1];
        for [low, _] in mesh.tets().iter().flat_map(|t| TET_EDGES.map(|e| edge(t, e))) {
            next[low as usize + 1] += 1;
        }
        (0..points).for_each(|p| next[p + 1] += next[p]);
        let mut high = vec![0; next[points]];
        let first = next.clone();
        for [low, other] in mesh.tets().iter().flat_map(|t| TET_EDGES.map(|e| edge(t, e))) {
            high[next[low as usize]] = other;
            next[low as usize] += 1;
        }
        let (mut ends, mut starts) = (Vec::new(), vec![0u32]);
        for (low, range) in first.windows(2).enumerate() {
            let own = &mut high[range[0]..range[1]];
            own.sort_unstable();
            let mut last = None;
            for &other in own.iter() {
                if last.replace(other) != Some(other) {
                    ends.push([low as u32, other]);
                }
            }
            starts.push(ends.len() as u32);
        }
        let index = |[low, high]: [u32; 2]| {
            let own = starts[low as usize] as usize..starts[low as usize + 1] as usize;
            (own.start + ends[own].partition_point(|e| e[1] < high)) as u32
        };
        let of_tets = mesh.tets().iter().map(|t| TET_EDGES.map(|e| index(edge(t, e)))).collect();
        Self { ends, of_tets }
    }

    /// The two points of each edge, lower first.
    pub fn ends(&self) -> &[[u32; 2]] {
        &self.ends
    }

    /// The six edges of each tetrahedron, in the order of [`TET_EDGES`].
    pub fn of_tets(&self) -> &[[u32; 6]] {
        &self.of_tets
    }

    /// The edge between two points, if there is one.
    pub fn between(&self, a: u32, b: u32) -> Option<u32> {
        self.ends.binary_search(&[a.min(b), a.max(b)]).ok().map(|n| n as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet_mesh::tests::cube;

    #[test]
    fn a_cube_has_nineteen_edges() {
        let mesh = cube();
        let edges = Edges::new(&mesh);
        assert_eq!(edges.ends().len(), 12 + 6 + 1);
        assert!(edges.ends().is_sorted());
        for (tet, of) in mesh.tets().iter().zip(edges.of_tets()) {
            for ([a, b], e) in TET_EDGES.iter().zip(of) {
                assert_eq!(edges.between(tet[*a], tet[*b]), Some(*e));
            }
        }
        assert_eq!(edges.between(1, 6), None);
    }
}

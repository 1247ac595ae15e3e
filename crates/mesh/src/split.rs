//! Each tetrahedron as eight, so that a quadratic displacement becomes a linear one of the same
//! nodes.

use crate::{BoundaryFace, Edges, MeshError, Order, TET_EDGES, TetMesh};
use supine_space::{Point, Vector};

/// A mesh whose tetrahedra are eighths of those of another one.
///
/// Its points are the nodes of a quadratic displacement of the other mesh, in their order: points,
/// then the middles of the edges. The values of such a displacement are those of a linear one here;
/// between the nodes the two differ.
#[derive(Debug)]
pub struct Split {
    /// The eighths.
    pub mesh: TetMesh,
    edges: Vec<[u32; 2]>,
    points: usize,
}

impl Split {
    /// Splits a mesh.
    ///
    /// # Errors
    /// When rounding leaves an eighth of a very flat tetrahedron without volume.
    pub fn new(mesh: &TetMesh, edges: &Edges) -> Result<Self, MeshError> {
        let rest = mesh.points();
        let middle = |&[a, b]: &[u32; 2]| {
            let (a, b) = (rest[a as usize], rest[b as usize]);
            a + (b - a) / 2.0
        };
        let points: Vec<Point> =
            rest.iter().copied().chain(edges.ends().iter().map(middle)).collect();
        let mut tets = Vec::with_capacity(8 * mesh.tets().len());
        for (corners, of_tet) in mesh.tets().iter().zip(edges.of_tets()) {
            tets.extend(eighths(corners, &of_tet.map(|edge| rest.len() as u32 + edge)));
        }
        let mut boundary = Vec::with_capacity(4 * mesh.boundary().len());
        for face in mesh.boundary() {
            let [a, b, c] = face.points;
            // Every side of a face is an edge of its tetrahedron.
            let side = |p, q| edges.between(p, q).map_or(p, |edge| rest.len() as u32 + edge);
            let [ab, bc, ca] = [side(a, b), side(b, c), side(c, a)];
            let four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
            boundary.extend(four.map(|points| BoundaryFace { points, tag: face.tag }));
        }
        let (edges, count) = (edges.ends().to_vec(), rest.len());
        Ok(Self { mesh: TetMesh::new(points, tets, boundary)?, edges, points: count })
    }

    /// The displacement of the eighths' points, mm, from the nodes' values of a displacement of the
    /// other mesh.
    pub fn values(&self, order: Order, values: &[Vector]) -> Vec<Vector> {
        match order {
            Order::Quadratic => values.to_vec(),
            Order::Linear => {
                let middle = |[a, b]: &[u32; 2]| (values[*a as usize] + values[*b as usize]) / 2.0;
                values[..self.points].iter().copied().chain(self.edges.iter().map(middle)).collect()
            }
        }
    }
}

/// Four eighths at the corners, and four round a diagonal of the octahedron that is left: with the
/// orientation of the whole.
fn eighths(corners: &[u32; 4], middles: &[u32; 6]) -> [[u32; 4]; 8] {
    let m = |a: usize, b: usize| {
        let edge = TET_EDGES.iter().position(|e| *e == [a, b] || *e == [b, a]);
        middles[edge.unwrap_or(0)]
    };
    let [a, b, c, d] = *corners;
    let [ab, ac, ad, bc, bd, cd] = [m(0, 1), m(0, 2), m(0, 3), m(1, 2), m(1, 3), m(2, 3)];
    [
        [a, ab, ac, ad],
        [ab, b, bc, bd],
        [ac, bc, c, cd],
        [ad, bd, cd, d],
        [ab, cd, ac, ad],
        [ab, cd, ad, bd],
        [ab, cd, bd, bc],
        [ab, cd, bc, ac],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BoundaryTag, Displacement, Locator};
    use std::sync::Arc;

    /// Two tetrahedra of a skew box.
    fn mesh() -> TetMesh {
        let points =
            [[0.0, 0.0, 0.0], [9.0, 1.0, 0.0], [1.0, 8.0, 2.0], [2.0, 1.0, 7.0], [9.0, 9.0, 9.0]];
        let points = points.map(Point::from).to_vec();
        let tets = vec![[0, 1, 2, 3], [1, 4, 2, 3]];
        let face = |points, tag| BoundaryFace { points, tag };
        let boundary = vec![
            face([0, 2, 1], BoundaryTag::ChestWall),
            face([0, 1, 3], BoundaryTag::Skin),
            face([0, 3, 2], BoundaryTag::Skin),
            face([1, 2, 4], BoundaryTag::Cut),
            face([1, 4, 3], BoundaryTag::Skin),
            face([2, 3, 4], BoundaryTag::Skin),
        ];
        TetMesh::new(points, tets, boundary).unwrap()
    }

    #[test]
    fn eighths_fill_the_whole_and_bear_its_tags() {
        let whole = mesh();
        let split = Split::new(&whole, &Edges::new(&whole)).unwrap();
        assert_eq!(split.mesh.tets().len(), 16);
        for tet in 0..2 {
            for part in 0..8 {
                let share = split.mesh.volume(8 * tet + part) / whole.volume(tet);
                assert!((share - 0.125).abs() < 1e-12, "{share}");
            }
        }
        for tag in BoundaryTag::ALL {
            assert!((split.mesh.area(tag) - whole.area(tag)).abs() < 1e-9);
        }
    }

    #[test]
    fn a_linear_displacement_is_the_same_and_a_quadratic_one_at_the_nodes() {
        let whole = mesh();
        let edges = Edges::new(&whole);
        let split = Split::new(&whole, &edges).unwrap();
        let square = |p: &Point| Vector::new(p.x * p.y, p.z * p.z, p.x - 2.0 * p.z) / 50.0;
        let quadratic: Vec<Vector> = split.mesh.points().iter().map(square).collect();
        assert!(split.values(Order::Quadratic, &quadratic) == quadratic);
        let linear: Vec<Vector> = whole.points().iter().map(|p| p.coords * 0.1).collect();
        let values = split.values(Order::Linear, &linear);
        let mesh = Arc::new(split.mesh);
        let displacement = Displacement::new(&mesh, &Edges::new(&mesh), values).unwrap();
        let locator = Locator::new(Arc::clone(&mesh));
        let place = Point::new(3.0, 3.0, 2.5);
        let at = locator.locate(&place).unwrap();
        let found = displacement.at(&mesh, &Edges::new(&mesh), at.tet, at.weights);
        assert!((found - place.coords * 0.1).norm() < 1e-12, "{found}");
    }
}

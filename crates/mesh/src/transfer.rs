//! The displacement of one mesh given to another in the same place.

use crate::{Deformation, Displacement, DisplacementError, Edges, Locator, Order, TetMesh};
use std::sync::Arc;
use supine_space::{Point, Vector};

/// The displacement `from` at the nodes of `to`, which lies in the same place in the CT: a mesh
/// coarsened from it, or the finer one it was coarsened to. The order stays.
///
/// Nodes of `to` outside `from`, as by the chords of a coarse surface, take the field of the
/// tetrahedron they lie least outside of, carried on.
///
/// # Errors
/// When a carried vector is not finite.
pub fn transfer(from: &Deformation, to: Arc<TetMesh>) -> Result<Deformation, DisplacementError> {
    let (mesh, displacement) = (from.mesh(), from.displacement());
    let edges = Edges::new(mesh);
    let locator = Locator::new(mesh.clone());
    let at = |p: &Point| {
        let near = locator.nearest(p);
        displacement.at(mesh, &edges, near.tet, near.weights)
    };
    let mut values: Vec<Vector> = to.points().iter().map(at).collect();
    let own = Edges::new(&to);
    if displacement.order() == Order::Quadratic {
        let middle =
            |[a, b]: &[u32; 2]| middle_of(&to.points()[*a as usize], &to.points()[*b as usize]);
        values.extend(own.ends().iter().map(|ends| at(&middle(ends))));
    }
    let displacement = Displacement::new(&to, &own, values)?;
    Deformation::new(to, displacement)
}

fn middle_of(a: &Point, b: &Point) -> Point {
    a + 0.5 * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet_mesh::tests::cube;

    fn quadratic(mesh: &TetMesh, field: impl Fn(&Point) -> Vector) -> Displacement {
        let edges = Edges::new(mesh);
        let mut values: Vec<Vector> = mesh.points().iter().map(&field).collect();
        let middle = |[a, b]: &[u32; 2]| {
            field(&middle_of(&mesh.points()[*a as usize], &mesh.points()[*b as usize]))
        };
        values.extend(edges.ends().iter().map(middle));
        Displacement::new(mesh, &edges, values).unwrap()
    }

    #[test]
    fn a_quadratic_field_is_carried_to_a_shifted_mesh() {
        let fine = cube();
        let field = |p: &Point| Vector::new(p.x * p.y, 0.3 * p.z, p.z * p.z - p.x);
        let u = quadratic(&fine, field);
        // A little larger than the first: some nodes lie outside it.
        let points = fine.points().iter().map(|p| p + 0.05 * (p - Point::new(1.0, 1.0, 1.0)));
        let other =
            TetMesh::new(points.collect(), fine.tets().to_vec(), fine.boundary().to_vec()).unwrap();
        let want = quadratic(&other, field);
        let fine = Deformation::new(Arc::new(fine), u).unwrap();
        let carried = transfer(&fine, Arc::new(other)).unwrap();
        let carried = carried.displacement();
        assert_eq!(carried.order(), Order::Quadratic);
        for (a, b) in carried.values().iter().zip(want.values()) {
            assert!((a - b).norm() < 1e-12, "{a} {b}");
        }
    }
}

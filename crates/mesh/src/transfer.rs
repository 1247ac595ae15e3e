//! The displacement of one mesh given to another in the same place.

use crate::{Displacement, DisplacementError, Edges, Locator, Order, TetMesh};
use supine_space::{Point, Vector};

/// The displacement of `from` at the nodes of `to`, which lies in the same place in the CT: a mesh
/// coarsened from it, or the finer one it was coarsened to. The order stays.
///
/// Nodes of `to` outside `from`, as by the chords of a coarse surface, take the field of the
/// tetrahedron they lie least outside of, carried on.
///
/// # Errors
/// When the displacement is not one of `from`.
pub fn transfer(
    from: &TetMesh,
    displacement: &Displacement,
    to: &TetMesh,
) -> Result<Displacement, DisplacementError> {
    let edges = Edges::new(from);
    Displacement::new(from, &edges, displacement.values().to_vec())?;
    let locator = Locator::new(from);
    let at = |p: &Point| {
        let near = locator.nearest(p);
        displacement.at(from, &edges, near.tet, near.weights)
    };
    let mut values: Vec<Vector> = to.points().iter().map(at).collect();
    let own = Edges::new(to);
    if displacement.order() == Order::Quadratic {
        let middle =
            |[a, b]: &[u32; 2]| middle_of(&to.points()[*a as usize], &to.points()[*b as usize]);
        values.extend(own.ends().iter().map(|ends| at(&middle(ends))));
    }
    Displacement::new(to, &own, values)
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
        let carried = transfer(&fine, &u, &other).unwrap();
        let want = quadratic(&other, field);
        assert_eq!(carried.order(), Order::Quadratic);
        for (a, b) in carried.values().iter().zip(want.values()) {
            assert!((a - b).norm() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn a_displacement_of_another_mesh_is_refused() {
        let mesh = cube();
        let edges = Edges::new(&mesh);
        let u = quadratic(&mesh, |p| p.coords);
        let corner = TetMesh::new(
            [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(Point::from).to_vec(),
            vec![[0, 1, 2, 3]],
            crate::TET_FACES
                .map(|f| crate::BoundaryFace {
                    points: f.map(|c| c as u32),
                    tag: crate::BoundaryTag::Skin,
                })
                .to_vec(),
        )
        .unwrap();
        assert!(transfer(&corner, &u, &mesh).is_err(), "{}", edges.ends().len());
    }
}

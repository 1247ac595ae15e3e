//! Points carried along.

use crate::{Error, Params, map::Prepared};
use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};
use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Locator, Order, TetMesh};
use supine_space::{Point, Vector};

/// Points of the CT (LPS, mm) at the operating position (LPS, mm).
///
/// Exact within a tetrahedron for linear and quadratic displacements. A point up to
/// `params.collar_mm` outside the skin of the mesh, like a nipple or a mark on the skin, moves with
/// the nearest point of that skin, as the CT does. `None` for all other points: they do not move.
/// `displacement` as the solver gave it, the fade is applied within.
///
/// # Errors
/// When the displacement belongs to another mesh or a parameter is out of range.
pub fn carry_points(
    mesh: &TetMesh,
    displacement: &Displacement,
    params: &Params,
    points: &[Point],
) -> Result<Vec<Option<Point>>, Error> {
    let prepared = Prepared::new(mesh, displacement, params)?;
    let locator = Locator::new(mesh);
    let skin = Skin::new(mesh);
    let carry = |p: &Point| {
        let inside = locator
            .locate(p)
            .map(|at| prepared.displacement.at(mesh, &prepared.edges, at.tet, at.weights));
        let moved = inside.or_else(|| {
            let (face, weights) = skin.as_ref()?.beside(p, params.collar_mm)?;
            Some(on_face(mesh, &prepared, face, weights))
        })?;
        Some(p + moved)
    };
    Ok(points.iter().map(carry).collect())
}

/// The skin of a mesh in the CT.
struct Skin<'a> {
    faces: Vec<&'a BoundaryFace>,
    surface: TriMesh,
}

impl<'a> Skin<'a> {
    fn new(mesh: &'a TetMesh) -> Option<Self> {
        let faces: Vec<&BoundaryFace> =
            mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Skin).collect();
        let points = mesh.points().iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        let surface = TriMesh::new(points, faces.iter().map(|f| f.points).collect()).ok()?;
        Some(Self { faces, surface })
    }

    /// The face nearest to a point on the outer side, and the barycentric coordinates of its
    /// nearest point, when that is no farther than `reach_mm`.
    fn beside(&self, p: &Point, reach_mm: f64) -> Option<(&'a BoundaryFace, [f64; 3])> {
        let at = Vec3::new(p.x, p.y, p.z);
        let (nearest, (face, location)) =
            self.surface.project_local_point_and_get_location(at, false);
        let away = at - nearest.point;
        let triangle = self.surface.triangle(face);
        let outward = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
        if away.length() > reach_mm || away.dot(outward) <= 0.0 {
            return None;
        }
        let weights = match location {
            TrianglePointLocation::OnVertex(v) => [0, 1, 2].map(|c| f64::from(u8::from(c == v))),
            other => other.barycentric_coordinates()?,
        };
        Some((self.faces[face as usize], weights))
    }
}

/// Displacement on a face at barycentric coordinates `l`: Σ l_a u_a, or for quadratic order
/// Σ l_a (2 l_a - 1) u_a + Σ 4 l_a l_b u_ab.
fn on_face(mesh: &TetMesh, prepared: &Prepared, face: &BoundaryFace, l: [f64; 3]) -> Vector {
    let values = prepared.displacement.values();
    let corner = |a: usize| values[face.points[a] as usize];
    if prepared.displacement.order() == Order::Linear {
        return (0..3).map(|a| corner(a) * l[a]).sum();
    }
    let corners: Vector = (0..3).map(|a| corner(a) * (l[a] * (2.0 * l[a] - 1.0))).sum();
    let sides = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(a, b)| {
        let side = prepared.edges.between(face.points[a], face.points[b])?;
        Some(values[mesh.points().len() + side as usize] * (4.0 * l[a] * l[b]))
    });
    corners + sides.sum::<Vector>()
}

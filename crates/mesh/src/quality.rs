//! Shape of tetrahedra.

use crate::{TET_EDGES, TetMesh, tet_mesh::signed_volume};
use supine_space::{Point, Vector};

/// Shape of one tetrahedron.
#[derive(Clone, Copy, Debug)]
pub struct TetQuality {
    /// Smallest dihedral angle, degrees.
    pub min_dihedral_deg: f64,
    /// Largest dihedral angle, degrees.
    pub max_dihedral_deg: f64,
    /// 3 r_in / R_circ: 1 for the regular tetrahedron, 0 for a flat one.
    pub radius_ratio: f64,
}

/// Shape of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// Smallest dihedral angle, degrees.
    pub min_dihedral_deg: f64,
    /// Largest dihedral angle, degrees.
    pub max_dihedral_deg: f64,
    /// Smallest radius ratio.
    pub min_radius_ratio: f64,
    /// Mean radius ratio.
    pub mean_radius_ratio: f64,
    /// The tetrahedron with the smallest dihedral angle.
    pub worst: usize,
    /// Mean edge length over all tetrahedra, mm.
    pub mean_edge: f64,
}

/// How the shapes of a mesh's tetrahedra are spread.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Dihedral angles, six per tetrahedron, by classes of 5 degrees from 0 to 180.
    pub dihedral: [usize; 36],
    /// Radius ratios by classes of 0.05 from 0 to 1.
    pub radius_ratio: [usize; 20],
    /// The tetrahedra with the smallest dihedral angles, worst first.
    pub worst: Vec<usize>,
}

/// Width of a class of [`Spread::dihedral`], degrees.
pub const DIHEDRAL_CLASS_DEG: f64 = 5.0;
/// Width of a class of [`Spread::radius_ratio`].
pub const RADIUS_RATIO_CLASS: f64 = 0.05;

/// Vectors along the normals of the faces, outwards.
fn normals([a, b, c, d]: &[Point; 4]) -> [Vector; 4] {
    [
        (c - b).cross(&(d - b)),
        (d - a).cross(&(c - a)),
        (b - a).cross(&(d - a)),
        (c - a).cross(&(b - a)),
    ]
}

/// The dihedral angles of a tetrahedron, degrees.
fn dihedral_angles(normals: &[Vector; 4]) -> [f64; 6] {
    TET_EDGES.map(|[i, j]| {
        let cosine = -normals[i].dot(&normals[j]) / (normals[i].norm() * normals[j].norm());
        cosine.clamp(-1.0, 1.0).acos().to_degrees()
    })
}

/// Shape of a positive tetrahedron.
pub fn tet_quality(corners: &[Point; 4]) -> TetQuality {
    let [a, b, c, d] = corners;
    let normals = normals(corners);
    let angles = dihedral_angles(&normals);
    let low = angles.into_iter().fold(f64::INFINITY, f64::min);
    let high = angles.into_iter().fold(0.0, f64::max);
    let volume = signed_volume(corners);
    let inradius = 6.0 * volume / normals.iter().map(|n| n.norm()).sum::<f64>();
    // Circumradius from the products of opposite edges: 24 V R = sqrt(s(s-p)(s-q)(s-r)) * 4.
    let p = (b - a).norm() * (d - c).norm();
    let q = (c - a).norm() * (d - b).norm();
    let r = (d - a).norm() * (c - b).norm();
    let product = (p + q + r) * (p + q - r) * (p + r - q) * (q + r - p);
    let circumradius = product.max(0.0).sqrt() / (24.0 * volume);
    TetQuality {
        min_dihedral_deg: low,
        max_dihedral_deg: high,
        radius_ratio: 3.0 * inradius / circumradius,
    }
}

/// Shape of a mesh.
pub fn quality(mesh: &TetMesh) -> Quality {
    let n = mesh.tets().len();
    let mut q = Quality {
        min_dihedral_deg: f64::INFINITY,
        max_dihedral_deg: 0.0,
        min_radius_ratio: f64::INFINITY,
        mean_radius_ratio: 0.0,
        worst: 0,
        mean_edge: 0.0,
    };
    for tet in 0..n {
        let corners = mesh.corners(tet);
        let t = tet_quality(&corners);
        if t.min_dihedral_deg < q.min_dihedral_deg {
            (q.min_dihedral_deg, q.worst) = (t.min_dihedral_deg, tet);
        }
        q.max_dihedral_deg = q.max_dihedral_deg.max(t.max_dihedral_deg);
        q.min_radius_ratio = q.min_radius_ratio.min(t.radius_ratio);
        q.mean_radius_ratio += t.radius_ratio / n as f64;
        let length = |[a, b]: [usize; 2]| (corners[a] - corners[b]).norm();
        q.mean_edge += TET_EDGES.map(length).iter().sum::<f64>() / (6 * n) as f64;
    }
    q
}

/// How the shapes are spread, and the `worst` worst tetrahedra.
pub fn spread(mesh: &TetMesh, worst: usize) -> Spread {
    let class = |value: f64, width: f64, last: usize| ((value / width) as usize).min(last);
    let (mut dihedral, mut radius_ratio) = ([0; 36], [0; 20]);
    let mut by_angle = Vec::with_capacity(mesh.tets().len());
    for tet in 0..mesh.tets().len() {
        let corners = mesh.corners(tet);
        for angle in dihedral_angles(&normals(&corners)) {
            dihedral[class(angle, DIHEDRAL_CLASS_DEG, 35)] += 1;
        }
        let shape = tet_quality(&corners);
        radius_ratio[class(shape.radius_ratio, RADIUS_RATIO_CLASS, 19)] += 1;
        by_angle.push((shape.min_dihedral_deg, tet));
    }
    by_angle.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let worst = by_angle.into_iter().take(worst).map(|(_, tet)| tet).collect();
    Spread { dihedral, radius_ratio, worst }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_regular_tetrahedron_is_perfect() {
        let p = |x, y, z| Point::new(x, y, z);
        let q = tet_quality(&[
            p(1.0, 1.0, 1.0),
            p(-1.0, -1.0, 1.0),
            p(1.0, -1.0, -1.0),
            p(-1.0, 1.0, -1.0),
        ]);
        let ideal = (1.0f64 / 3.0).acos().to_degrees();
        assert!((q.radius_ratio.abs() - 1.0).abs() < 1e-12, "{q:?}");
        assert!((q.min_dihedral_deg - ideal).abs() < 1e-9, "{q:?}");
        assert!((q.max_dihedral_deg - ideal).abs() < 1e-9, "{q:?}");
    }

    #[test]
    fn the_corner_of_a_cube_has_right_angles() {
        let p = |x, y, z| Point::new(x, y, z);
        let q =
            tet_quality(&[p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0), p(0.0, 0.0, 1.0)]);
        assert!((q.max_dihedral_deg - 90.0).abs() < 1e-9, "{q:?}");
        assert!((q.min_dihedral_deg - (1.0 / 3.0f64.sqrt()).acos().to_degrees()).abs() < 1e-9);
        // r_in = (3 - sqrt 3) / 6, R = sqrt 3 / 2
        let want = 3.0 * (3.0 - 3f64.sqrt()) / 6.0 / (3f64.sqrt() / 2.0);
        assert!((q.radius_ratio - want).abs() < 1e-12, "{q:?}");
    }

    #[test]
    fn every_angle_and_every_tetrahedron_has_its_class() {
        let mesh = crate::tet_mesh::tests::cube();
        let found = spread(&mesh, 3);
        let n = mesh.tets().len();
        assert_eq!(found.dihedral.iter().sum::<usize>(), 6 * n);
        assert_eq!(found.radius_ratio.iter().sum::<usize>(), n);
        let q = quality(&mesh);
        assert_eq!(found.worst[0], q.worst);
        assert_eq!(found.worst.len(), 3);
        let lowest = found.dihedral.iter().position(|&n| n > 0).unwrap();
        assert_eq!(lowest, (q.min_dihedral_deg / DIHEDRAL_CLASS_DEG) as usize);
    }
}

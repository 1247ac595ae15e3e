//! Shape of tetrahedra.

use crate::{TetMesh, tet_mesh::signed_volume};
use supine_space::Point;

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

/// Shape of a positive tetrahedron.
pub fn tet_quality(corners: &[Point; 4]) -> TetQuality {
    let [a, b, c, d] = corners;
    let normals = [
        (c - b).cross(&(d - b)),
        (d - a).cross(&(c - a)),
        (b - a).cross(&(d - a)),
        (c - a).cross(&(b - a)),
    ];
    let (mut low, mut high) = (f64::INFINITY, 0.0f64);
    for i in 0..4 {
        for j in i + 1..4 {
            let cosine = -normals[i].dot(&normals[j]) / (normals[i].norm() * normals[j].norm());
            let angle = cosine.clamp(-1.0, 1.0).acos().to_degrees();
            low = low.min(angle);
            high = high.max(angle);
        }
    }
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
        q.mean_edge += crate::TET_EDGES.map(length).iter().sum::<f64>() / (6 * n) as f64;
    }
    q
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
}

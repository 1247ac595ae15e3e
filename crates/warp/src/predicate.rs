//! Exact decisions about points and tetrahedra.
//!
//! A voxel centre p counts as p + (e, e², e³) with e -> 0+. No point is then ever on a face: two
//! tetrahedra that share a face see opposite signs, and a conforming mesh owns each voxel once.

use robust::{Coord, Coord3D};

/// A position as continuous voxel index (i, j, k).
pub(crate) type Index = [f64; 3];

/// Face f of a tetrahedron lies opposite corner f; on the side of corner f the sign of
/// [`side`] is the sign of the tetrahedron.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

fn orient(a: Index, b: Index, c: Index, p: Index) -> f64 {
    let at = |v: Index| Coord3D { x: v[0], y: v[1], z: v[2] };
    robust::orient3d(at(a), at(b), at(c), at(p))
}

/// Exact sign of a tetrahedron's volume in index space, as 1 or -1; 0 when it is flat.
pub(crate) fn orientation([a, b, c, d]: [Index; 4]) -> f64 {
    sign(orient(b, c, d, a))
}

/// Exact sign of -N·(p - a), N = (b - a) x (c - a), for the perturbed p; 0 only when a, b, c lie
/// on one line.
fn side(a: Index, b: Index, c: Index, p: Index) -> f64 {
    let here = orient(a, b, c, p);
    if here != 0.0 {
        return here;
    }
    // The derivatives of the sign along x, y, z are the components of -N: areas of projections.
    for (u, v) in [(1, 2), (2, 0), (0, 1)] {
        let at = |q: Index| Coord { x: q[u], y: q[v] };
        let slope = -robust::orient2d(at(a), at(b), at(c));
        if slope != 0.0 {
            return slope;
        }
    }
    0.0
}

/// Whether the perturbed voxel centre `p` lies in a tetrahedron of orientation `sign` (not 0).
pub(crate) fn holds(corners: &[Index; 4], sign: f64, p: Index) -> bool {
    FACES.iter().all(|f| side(corners[f[0]], corners[f[1]], corners[f[2]], p) * sign > 0.0)
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shared_corner_has_one_owner_around_it() {
        // The six tetrahedra around the diagonal of a cube, in all eight cubes around a voxel.
        let mut owners = 0;
        for corner in 0..8 {
            let origin = [0, 1, 2].map(|a| 4.0 - f64::from(corner >> a & 1));
            for path in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                let mut tet = [origin; 4];
                for step in 0..3 {
                    tet[step + 1] = tet[step];
                    tet[step + 1][path[step]] += 1.0;
                }
                owners += usize::from(holds(&tet, orientation(tet), [4.0; 3]));
            }
        }
        assert_eq!(owners, 1);
    }

    #[test]
    fn a_flat_tetrahedron_has_no_orientation() {
        let flat = [[0.1, 0.1, 0.1], [0.2, 0.2, 0.2], [0.3, 0.7, 0.9], [0.3, 0.7, 0.9]];
        assert_eq!(orientation(flat), 0.0);
    }
}

//! Which tetrahedron holds a point.

use crate::{TetMesh, tet_mesh::signed_volume};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vec3;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use std::sync::Arc;
use supine_space::Point;

/// A tetrahedron and the barycentric coordinates of a point in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// The tetrahedron.
    pub tet: usize,
    /// Barycentric coordinates of the point, one per corner, summing to 1.
    pub weights: [f64; 4],
}

/// Finds the tetrahedron of a mesh in its CT shape that holds a point.
pub struct Locator {
    mesh: Arc<TetMesh>,
    tree: Bvh,
    /// Lowest and highest coordinates of the mesh.
    extent: (Point, Point),
}

impl std::fmt::Debug for Locator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Locator({} tetrahedra)", self.mesh.tets().len())
    }
}

/// How far outside, in barycentric units, a point on a face may seem through rounding.
const ON_FACE: f64 = 1e-9;

impl Locator {
    /// Prepares the search in `mesh`.
    pub fn new(mesh: Arc<TetMesh>) -> Self {
        let boxes: Vec<Aabb> = (0..mesh.tets().len()).map(|t| bounds(&mesh, t)).collect();
        let (tree, extent) = (Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), mesh.bounds());
        Self { mesh, tree, extent }
    }

    /// The lowest tetrahedron that holds the point (LPS, mm); `None` outside the mesh.
    pub fn locate(&self, p: &Point) -> Option<Located> {
        let at = Vec3::new(p.x, p.y, p.z);
        let mut tets: Vec<u32> = self.tree.intersect_aabb(&Aabb::new(at, at)).collect();
        tets.sort_unstable();
        tets.into_iter().find_map(|tet| {
            let tet = tet as usize;
            let weights = barycentric(&self.mesh.corners(tet), p);
            weights.iter().all(|&w| w >= -ON_FACE).then_some(Located { tet, weights })
        })
    }

    /// The tetrahedron that holds the point (LPS, mm), or the one it lies least outside of: by its
    /// most negative barycentric coordinate, among those near.
    pub fn nearest(&self, p: &Point) -> Located {
        if let Some(found) = self.locate(p) {
            return found;
        }
        let (low, high) = self.extent;
        // Boxes round the point grow until they meet a tetrahedron, and once more, for the nearest
        // need not be the first.
        let mut reach = (1e-3 * (high - low).norm()).max(1e-9);
        let mut met = false;
        while reach.is_finite() {
            let around = Aabb::new(
                Vec3::new(p.x - reach, p.y - reach, p.z - reach),
                Vec3::new(p.x + reach, p.y + reach, p.z + reach),
            );
            let mut tets: Vec<u32> = self.tree.intersect_aabb(&around).collect();
            tets.sort_unstable();
            let candidates = tets.into_iter().map(|tet| {
                let tet = tet as usize;
                Located { tet, weights: barycentric(&self.mesh.corners(tet), p) }
            });
            let outside = |l: &Located| l.weights.iter().copied().fold(f64::INFINITY, f64::min);
            let best = candidates.reduce(|a, b| if outside(&b) > outside(&a) { b } else { a });
            match best {
                Some(best) if met => return best,
                best => met = best.is_some(),
            }
            reach *= 2.0;
        }
        // Only a point that is not finite comes here.
        Located { tet: 0, weights: barycentric(&self.mesh.corners(0), p) }
    }
}

fn bounds(mesh: &TetMesh, tet: usize) -> Aabb {
    let corners = mesh.corners(tet);
    let low = corners.iter().skip(1).fold(corners[0], |a, b| a.inf(b));
    let high = corners.iter().skip(1).fold(corners[0], |a, b| a.sup(b));
    let grow = 1e-9 * (high - low).norm();
    Aabb::new(
        Vec3::new(low.x - grow, low.y - grow, low.z - grow),
        Vec3::new(high.x + grow, high.y + grow, high.z + grow),
    )
}

/// Barycentric coordinates of `p`: the share of the volume opposite each corner.
fn barycentric(corners: &[Point; 4], p: &Point) -> [f64; 4] {
    let whole = signed_volume(corners);
    std::array::from_fn(|a| {
        let mut part = *corners;
        part[a] = *p;
        signed_volume(&part) / whole
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet_mesh::tests::cube;
    use supine_space::Vector;

    #[test]
    fn points_inside_are_found_and_outside_are_not() {
        let mesh = Arc::new(cube());
        let locator = Locator::new(mesh.clone());
        for (x, y, z) in [(0.3, 0.9, 1.7), (1.0, 1.0, 1.0), (0.0, 2.0, 0.5), (2.0, 2.0, 2.0)] {
            let p = Point::new(x, y, z);
            let found = locator.locate(&p).unwrap();
            let back = mesh
                .corners(found.tet)
                .iter()
                .zip(found.weights)
                .fold(Point::origin(), |s, (c, w)| s + c.coords * w);
            assert!((back - p).norm() < 1e-12, "{found:?}");
        }
        let outside = Point::new(2.1, 1.2, 0.9);
        assert!(locator.locate(&outside).is_none());
        let near = locator.nearest(&outside);
        let corners = mesh.corners(near.tet);
        let back: Vector = corners.iter().zip(near.weights).map(|(c, w)| c.coords * w).sum();
        assert!((back - outside.coords).norm() < 1e-12);
        assert!(near.weights.iter().all(|&w| w > -0.2), "{near:?}");
        assert!(locator.nearest(&Point::new(900.0, 0.0, 0.0)).tet < mesh.tets().len());
    }
}

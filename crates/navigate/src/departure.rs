//! What is left when a cavity has been cut.

use std::collections::BTreeMap;
use supine_mesh::{BoundaryFace, BoundaryTag, Edges, MeshError, TetMesh};
use supine_space::{Matrix, Point, Vector};
use supine_volume::Ct;

/// Value of a cavity, HU.
const AIR_HU: i16 = -1000;
/// Weights of a place in a tetrahedron that are so little below 0 are rounding.
const ROUNDED: f64 = 1e-9;

/// The faces of the tetrahedra that are left that border no other one, outwards. The wall of the
/// cavity counts as chest wall: nothing beyond it goes with it.
///
/// # Errors
/// None is known: no face of a mesh is of more than two tetrahedra.
pub(crate) fn boundary(
    mesh: &TetMesh,
    bears: impl Fn(usize) -> bool,
) -> Result<Vec<BoundaryFace>, MeshError> {
    let key = |mut points: [u32; 3]| {
        points.sort_unstable();
        points
    };
    let tags: BTreeMap<_, _> =
        mesh.boundary().iter().map(|face| (key(face.points), face.tag)).collect();
    let tagged = |(key, points)| {
        let tag = tags.get(&key).copied().unwrap_or(BoundaryTag::ChestWall);
        BoundaryFace { points, tag }
    };
    Ok(mesh.open_faces(bears)?.into_iter().map(tagged).collect())
}

/// The tetrahedra that are left as a mesh of their own, and which nodes of the whole one are its
/// nodes: points, then the middles of edges.
///
/// # Errors
/// When none is left.
pub(crate) fn left(
    mesh: &TetMesh,
    bears: impl Fn(usize) -> bool,
) -> Result<(TetMesh, Vec<u32>), MeshError> {
    let kept = mesh.tets().iter().enumerate().filter(|(t, _)| bears(*t));
    let mut tets: Vec<[u32; 4]> = kept.map(|(_, tet)| *tet).collect();
    let mut faces = boundary(mesh, &bears)?;
    let mut own = vec![u32::MAX; mesh.points().len()];
    tets.iter().flatten().for_each(|p| own[*p as usize] = 0);
    let points: Vec<u32> = (0..own.len() as u32).filter(|p| own[*p as usize] == 0).collect();
    points.iter().enumerate().for_each(|(n, p)| own[*p as usize] = n as u32);
    let renumber = |p: &mut u32| *p = own[*p as usize];
    tets.iter_mut().flatten().for_each(renumber);
    faces.iter_mut().flat_map(|face| &mut face.points).for_each(renumber);
    let places = points.iter().map(|p| mesh.points()[*p as usize]).collect();
    let (left, whole) = (TetMesh::new(places, tets, faces)?, Edges::new(mesh));
    let own = Edges::new(&left);
    let first = mesh.points().len() as u32;
    // Each edge that is left is one of the whole.
    let middles = own.ends().iter().filter_map(|ends| {
        let [a, b] = ends.map(|p| points[p as usize]);
        Some(first + whole.between(a, b)?)
    });
    let nodes = points.iter().copied().chain(middles).collect();
    Ok((left, nodes))
}

/// The CT with air where tissue was cut out of the mesh.
pub(crate) fn hollow(ct: &Ct, mesh: &TetMesh, bears: &[bool]) -> Ct {
    let mut hollow = ct.clone();
    for t in (0..bears.len()).filter(|t| !bears[*t]) {
        empty(&mut hollow, mesh.corners(t));
    }
    hollow
}

/// Air in the voxels whose centre lies in a tetrahedron.
fn empty(ct: &mut Ct, corners: [Point; 4]) {
    let grid = ct.grid().clone();
    let [first, rest @ ..] = corners;
    let sides = Matrix::from_columns(&rest.map(|corner| corner - first));
    let Some(weights) = sides.try_inverse() else { return };
    let at = corners.map(|corner| grid.index_from_patient(&corner));
    // Of each axis the voxels between the corners.
    let spans = [0, 1, 2].map(|axis| {
        let along = at.map(|index| index[axis]);
        let low = along.iter().copied().fold(f64::INFINITY, f64::min).ceil().max(0.0);
        let high = along.iter().copied().fold(f64::NEG_INFINITY, f64::max).floor();
        low as usize..(high + 1.0).clamp(0.0, grid.size()[axis] as f64) as usize
    });
    let [across, down, along] = spans;
    for k in along {
        for j in down.clone() {
            for i in across.clone() {
                let from: Vector = weights * (grid.centre([i, j, k]) - first);
                if from.min() >= -ROUNDED && from.sum() <= 1.0 + ROUNDED {
                    ct.data_mut()[grid.offset([i, j, k])] = AIR_HU;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Grid;

    /// Two tetrahedra on both sides of the face 1, 2, 3.
    fn pair() -> TetMesh {
        let points =
            [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0], [4.0, 4.0, 4.0]];
        let tets = vec![[0, 1, 2, 3], [1, 2, 3, 4]];
        let open = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 4], [1, 3, 4], [2, 3, 4]];
        let faces = open.map(|points| BoundaryFace { points, tag: BoundaryTag::Skin });
        TetMesh::new(points.map(Point::from).to_vec(), tets, faces.to_vec()).unwrap()
    }

    #[test]
    fn what_is_left_is_bounded_by_its_skin_and_by_the_cut() {
        let whole = pair();
        assert_eq!(boundary(&whole, |_| true).unwrap().len(), 6);
        let (left, nodes) = left(&whole, |t| t == 1).unwrap();
        let (points, middles) = nodes.split_at(4);
        assert_eq!((left.tets().len(), points), (1, &[1, 2, 3, 4][..]));
        // Edges of the whole in order: 01 02 03, then 12 13 14 23 24 34.
        assert_eq!(middles, [8, 9, 10, 11, 12, 13]);
        let walls = left.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall);
        let walls: Vec<_> = walls.map(|face| face.points).collect();
        assert_eq!(walls.len(), 1);
        assert!(!walls[0].contains(&3), "its points are 0, 1, 2: the cut {walls:?}");
        assert!(super::left(&whole, |_| false).is_err());
    }

    #[test]
    fn the_ct_is_air_where_tissue_was_cut_out_and_there_alone() {
        let (mesh, spacing) = (pair(), Vector::repeat(0.25));
        let grid = Grid::new([20; 3], spacing, Point::new(-0.4, -0.4, -0.4), Matrix::identity());
        let ct = Ct::from_fn(grid.unwrap(), |_| 40);
        let hollow = hollow(&ct, &mesh, &[false, true]);
        let mut emptied = 0;
        for n in 0..ct.grid().len() {
            let place = ct.grid().centre(ct.grid().voxel(n)).coords;
            let inside = place.min() >= 0.0 && place.sum() <= 4.0;
            assert_eq!(hollow.data()[n] == AIR_HU, inside, "{place:?}");
            emptied += usize::from(inside);
        }
        // 32/3 mm3 of 1/64 mm3 each, to within the voxels on its surface.
        assert!((500..900).contains(&emptied), "{emptied}");
    }
}

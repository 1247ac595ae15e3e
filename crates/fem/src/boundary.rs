//! The boundary of a body, face by face.

use std::collections::BTreeSet;
use supine_mesh::{BoundaryTag, TET_EDGES, TET_FACES, TetMesh};

/// A face of the boundary.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Its tetrahedron.
    pub(crate) element: usize,
    /// Its number among [`TET_FACES`].
    pub(crate) side: usize,
    /// The same as points of the mesh.
    pub(crate) points: [u32; 3],
    /// Area of the flat triangle, mm².
    pub(crate) area_mm2: f64,
}

impl Face {
    /// Its corners among those of the tetrahedron.
    pub(crate) fn own(&self) -> [usize; 3] {
        TET_FACES[self.side]
    }

    /// Its nodes among those of an element with `N`: corners, then mid-sides.
    pub(crate) fn nodes<const N: usize>(&self) -> Vec<usize> {
        nodes_on::<N>(self.own())
    }
}

/// The nodes of an element with `N` on its face with these corners, in rising order: corners, then
/// mid-sides.
pub(crate) fn nodes_on<const N: usize>(corners: [usize; 3]) -> Vec<usize> {
    let on = |a: &usize| match a.checked_sub(4) {
        None => corners.contains(a),
        Some(edge) => TET_EDGES[edge].iter().all(|corner| corners.contains(corner)),
    };
    (0..N).filter(on).collect()
}

/// The faces of a part of the boundary, in the order of their tetrahedra.
pub(crate) fn faces_on(mesh: &TetMesh, tag: BoundaryTag) -> Vec<Face> {
    let sorted = |mut points: [u32; 3]| {
        points.sort_unstable();
        points
    };
    let part = mesh.boundary().iter().filter(|face| face.tag == tag);
    let part: BTreeSet<[u32; 3]> = part.map(|face| sorted(face.points)).collect();
    let mut faces = Vec::with_capacity(part.len());
    for (element, tet) in mesh.tets().iter().enumerate() {
        for (side, own) in TET_FACES.into_iter().enumerate() {
            let points = own.map(|corner| tet[corner]);
            if part.contains(&sorted(points)) {
                let [a, b, c] = points.map(|p| mesh.points()[p as usize]);
                let area_mm2 = (b - a).cross(&(c - a)).norm() / 2.0;
                faces.push(Face { element, side, points, area_mm2 });
            }
        }
    }
    faces
}

/// The numbers that elements have when only those of `keep` are left.
pub(crate) fn renumbered(keep: &[bool]) -> Vec<usize> {
    let mut number = vec![0; keep.len()];
    (1..keep.len()).for_each(|e| number[e] = number[e - 1] + usize::from(keep[e - 1]));
    number
}

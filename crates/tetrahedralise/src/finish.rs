//! From the mesh under work to the result in patient space.

use crate::Error;
use crate::complex::Complex;
use crate::frame::Frame;
use supine_mesh::{BoundaryFace, BoundaryTag, TetMesh};

/// The mesh in patient space (LPS, mm), checked.
pub(crate) fn to_patient(mesh: &Complex, frame: &Frame) -> Result<TetMesh, Error> {
    let points = mesh.points.iter().map(|p| frame.to_patient(p)).collect();
    // A left-handed grid turns positive tetrahedra over.
    let mirrored = frame.axes.determinant() < 0.0;
    let mut tets = Vec::with_capacity(mesh.count());
    for id in mesh.ids() {
        let mut tet = mesh.tets[id as usize];
        if mirrored {
            tet.swap(2, 3);
        }
        tets.push(tet);
    }
    Ok(TetMesh::new(points, tets, outer_faces(mesh))?)
}

/// The tagged faces, outwards in the mesher's frame.
pub(crate) fn outer_faces(mesh: &Complex) -> Vec<BoundaryFace> {
    let mut faces = Vec::new();
    for id in mesh.ids() {
        for corner in 0..4 {
            if let Some(tag) = BoundaryTag::from_number(mesh.tags[id as usize][corner]) {
                faces.push(BoundaryFace { points: mesh.face(id, corner), tag });
            }
        }
    }
    faces
}

/// Length of the edges where two tags meet, mm.
pub(crate) fn rim_length(mesh: &Complex) -> f64 {
    mesh.edges()
        .into_iter()
        .filter(|&[a, b]| {
            let both = mesh.class[a as usize] & mesh.class[b as usize];
            both.count_ones() > 1 && mesh.edge_class(&mesh.ring(a, b), a, b).0.count_ones() > 1
        })
        .map(|e| mesh.length(e))
        .sum()
}

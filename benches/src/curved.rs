//! Curved elements of a reference mesh, whose own surface is only known by the finest of the
//! meshes.

use crate::reference::Reference;
use anyhow::{Context, Result};
use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use supine_mesh::{BoundaryTag, Displacement, Edges, TetMesh};
use supine_space::{Point, Vector};

/// The mesh whose skin and chest wall count as the true ones.
const FINEST: &str = "100k";

/// Offsets of the nodes of quadratic elements that follow skin and chest wall: the mid-sides there
/// move to the nearest place of the finest mesh's surface of the same kind. The cut stays as it is.
pub(crate) fn offsets(reference: &Reference, mesh: &TetMesh) -> Result<Displacement> {
    let finest = reference.mesh(FINEST)?;
    let edges = Edges::new(mesh);
    let mut offsets = vec![Vector::zeros(); mesh.points().len() + edges.ends().len()];
    for tag in [BoundaryTag::Skin, BoundaryTag::ChestWall] {
        let surface = surface(&finest, tag)?;
        for face in mesh.boundary().iter().filter(|face| face.tag == tag) {
            let [a, b, c] = face.points;
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let [p, q] = [a, b].map(|n| mesh.points()[n as usize]);
                let middle = nalgebra::center(&p, &q);
                let here = Vec3::new(middle.x, middle.y, middle.z);
                let there = surface.project_local_point(here, false).point;
                let edge = edges.between(a, b).context("a face without an edge")? as usize;
                let there = Point::new(there.x, there.y, there.z);
                offsets[mesh.points().len() + edge] = there - middle;
            }
        }
    }
    Ok(Displacement::new(mesh, &edges, offsets)?)
}

/// The boundary triangles of that kind.
fn surface(mesh: &TetMesh, tag: BoundaryTag) -> Result<TriMesh> {
    let points = mesh.points().iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
    let faces = mesh.boundary().iter().filter(|face| face.tag == tag);
    Ok(TriMesh::new(points, faces.map(|face| face.points).collect())?)
}

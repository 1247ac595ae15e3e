//! What it costs to carry the CT by eighths of the tetrahedra.

use anyhow::Result;
use supine_mesh::{Deformation, Edges, Split};

/// How far a quadratic displacement lies from the one that is linear in the eighths of each tetrahedron: at most in the middles of the
/// eighths' edges, where it is farthest along them, mm.
pub(crate) fn off_mm(deformation: &Deformation) -> Result<f64> {
    let (mesh, displacement) = (deformation.mesh(), deformation.displacement());
    let edges = Edges::new(mesh);
    let split = Split::new(mesh, &edges)?;
    let values = split.values(displacement.order(), displacement.values());
    let mut off = 0.0f64;
    for (n, eighth) in split.mesh.tets().iter().enumerate() {
        let tet = n / 8;
        let corners = mesh.tets()[tet];
        // Points of the eighths are those of the mesh, then the middles of its edges.
        let weights = eighth.map(|point| match corners.iter().position(|p| *p == point) {
            Some(corner) => at_corner(corner),
            None => in_middle(point as usize - mesh.points().len(), &edges.of_tets()[tet]),
        });
        for [a, b] in supine_mesh::TET_EDGES {
            let middle = [0, 1, 2, 3].map(|k| 0.5 * (weights[a][k] + weights[b][k]));
            let linear = 0.5 * (values[eighth[a] as usize] + values[eighth[b] as usize]);
            off = off.max((displacement.at(mesh, &edges, tet, middle) - linear).norm());
        }
    }
    Ok(off)
}

fn at_corner(corner: usize) -> [f64; 4] {
    [0, 1, 2, 3].map(|k| f64::from(u8::from(k == corner)))
}

/// Of an edge of the mesh that is one of a tetrahedron's.
fn in_middle(edge: usize, of_tet: &[u32; 6]) -> [f64; 4] {
    let own = supine_mesh::TET_EDGES.iter().zip(of_tet).find(|(_, e)| **e as usize == edge);
    let ends = own.map_or([0; 2], |(ends, _)| *ends);
    [0, 1, 2, 3].map(|k| if ends.contains(&k) { 0.5 } else { 0.0 })
}

//! The gradient of a field as a continuous one, recovered from the tetrahedra around each point
//! (Zienkiewicz and Zhu, Int. J. Numer. Methods Eng. 33, 1992).

use crate::element::{parent_map, parent_slopes};
use crate::material::cofactor;
use supine_mesh::TetMesh;
use supine_space::{Matrix, Vector};

/// Gradients of a field at the corners of each tetrahedron: row = component, column = axis.
pub(crate) fn corner_gradients<const N: usize>(
    positions: &[Vector],
    elements: &[[u32; N]],
    field: &[Vector],
) -> Vec<[Matrix; 4]> {
    let corners: [[f64; 4]; 4] =
        std::array::from_fn(|a| std::array::from_fn(|b| f64::from(u8::from(a == b))));
    let slopes = corners.map(parent_slopes::<N>);
    let gradient = |element: &[u32; N], slopes: &[Vector; N]| {
        let map = parent_map(positions, element, slopes);
        let inverse_transpose = cofactor(&map) / map.determinant();
        let own = element.iter().zip(slopes);
        own.map(|(n, s)| field[*n as usize] * (inverse_transpose * s).transpose()).sum::<Matrix>()
    };
    elements.iter().map(|e| slopes.each_ref().map(|s| gradient(e, s))).collect()
}

/// The continuous gradient of a field at the points: the mean of those of the tetrahedra around, by
/// volume.
pub(crate) fn averaged(mesh: &TetMesh, own: &[[Matrix; 4]]) -> Vec<Matrix> {
    let mut sums = vec![(Matrix::zeros(), 0.0); mesh.points().len()];
    for (t, (tet, own)) in mesh.tets().iter().zip(own).enumerate() {
        let volume = mesh.volume(t);
        for (p, g) in tet.iter().zip(own) {
            let (sum, whole) = &mut sums[*p as usize];
            *sum += g * volume;
            *whole += volume;
        }
    }
    sums.into_iter().map(|(sum, whole)| sum / whole).collect()
}

/// The continuous gradient of a field at the points.
pub(crate) fn recovered<const N: usize>(
    positions: &[Vector],
    elements: &[[u32; N]],
    mesh: &TetMesh,
    field: &[Vector],
) -> Vec<Matrix> {
    averaged(mesh, &corner_gradients(positions, elements, field))
}

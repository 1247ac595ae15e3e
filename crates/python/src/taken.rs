//! Arrays that Python gives, as values of the flow. They are copied once: the flow owns what it
//! works on.

use crate::failure::refuse;
use numpy::{Element, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::sync::Arc;
use supine_mesh::{BoundaryFace, BoundaryTag, Deformation, Displacement, Edges, TetMesh};
use supine_space::{Grid, Matrix, Point, Vector};
use supine_volume::Volume;

/// Origin (LPS, mm), spacing (mm) and direction (row by row).
pub(crate) type Geometry = ([f64; 3], [f64; 3], [[f64; 3]; 3]);

/// A volume from an array indexed `[k, j, i]`.
///
/// # Errors
/// `SupineError` when the array and its geometry make no volume.
pub(crate) fn volume<T: Element + Copy>(
    array: &PyReadonlyArray3<'_, T>,
    (origin, spacing, direction): Geometry,
) -> PyResult<Volume<T>> {
    let py = array.py();
    let (nk, nj, ni) = array.as_array().dim();
    let direction = Matrix::from_fn(|row, column| direction[row][column]);
    let grid = Grid::new([ni, nj, nk], spacing.into(), origin.into(), direction);
    let grid = grid.map_err(|error| refuse(py, "geometry-unusable", &error.to_string()))?;
    let values = array.as_array().iter().copied().collect();
    Volume::new(grid, values).map_err(|e| refuse(py, "geometry-unusable", &e.to_string()))
}

/// Points (n, 3), tetrahedra (n, 4), boundary faces (n, 3) and their tags (n).
pub(crate) type MeshArrays<'py> = (
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray2<'py, u32>,
    PyReadonlyArray1<'py, u8>,
);

/// A mesh from its arrays.
///
/// # Errors
/// `SupineError` when they make no mesh: it says which point, tetrahedron or face is wrong.
pub(crate) fn mesh((points, tets, faces, tags): &MeshArrays<'_>) -> PyResult<TetMesh> {
    let py = points.py();
    let wrong = |message: &str| refuse(py, "mesh-unusable", message);
    let widths = [points.shape()[1], tets.shape()[1], faces.shape()[1]];
    if widths != [3, 4, 3] || faces.shape()[0] != tags.shape()[0] {
        return Err(wrong(
            "a mesh is points (n, 3), tetrahedra (n, 4), faces (n, 3) and a tag for each face: the arrays have other shapes",
        ));
    }
    let points = points.as_array();
    let points = points.rows().into_iter().map(|p| Point::new(p[0], p[1], p[2]));
    let tets = tets.as_array().rows().into_iter().map(|t| [t[0], t[1], t[2], t[3]]).collect();
    let (faces, tags) = (faces.as_array(), tags.as_array());
    let face = |(corners, number): (numpy::ndarray::ArrayView1<'_, u32>, &u8)| {
        let tag = BoundaryTag::from_number(*number);
        let tag = tag.ok_or_else(|| {
            wrong(&format!("a face has the tag {number}: 1 is skin, 2 chest wall, 3 cut"))
        })?;
        Ok(BoundaryFace { points: [corners[0], corners[1], corners[2]], tag })
    };
    let faces = faces.rows().into_iter().zip(tags).map(face).collect::<PyResult<_>>()?;
    TetMesh::new(points.collect(), tets, faces).map_err(|e| wrong(&e.to_string()))
}

/// A displacement of a mesh from its vectors, mm: of the points, or of the points and the edges.
///
/// # Errors
/// `SupineError` when their number fits neither.
pub(crate) fn deformation(
    mesh: Arc<TetMesh>,
    vectors: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Deformation> {
    let py = vectors.py();
    let wrong = |message: &str| refuse(py, "displacement-unusable", message);
    if vectors.shape()[1] != 3 {
        return Err(wrong("a displacement is an array (n, 3), mm"));
    }
    let rows = vectors.as_array();
    let vectors = rows.rows().into_iter().map(|u| Vector::new(u[0], u[1], u[2])).collect();
    let displacement = Displacement::new(&mesh, &Edges::new(&mesh), vectors);
    let displacement = displacement.map_err(|e| wrong(&e.to_string()))?;
    Deformation::new(mesh, displacement).map_err(|e| wrong(&e.to_string()))
}

//! VTK XML unstructured grids (`.vtu`): the mesh, its tagged boundary and its displacement.
//!
//! Points are always the CT shape (LPS, mm). The point data `displacement` (three components, mm)
//! lead from there to the deformed shape; a viewer warps by that vector. Cells are tetrahedra
//! (VTK type 10, or 24 with mid-side nodes) and the triangles of the boundary (5 or 22) with the
//! cell data `boundary`: 1 skin, 2 chest_wall, 3 cut, and 0 on tetrahedra.
//! Format: "VTK XML Formats", <https://docs.vtk.org/en/latest/vtk_file_formats/>.

mod array;
mod document;
mod mesh;
mod write;

use crate::{Error, Problem, file};
use std::path::Path;
use supine_mesh::{Displacement, TetMesh};

/// VTK's numbers of the cells that matter here.
mod cell {
    pub(super) const TRIANGLE: i64 = 5;
    pub(super) const TETRA: i64 = 10;
    pub(super) const QUADRATIC_TRIANGLE: i64 = 22;
    pub(super) const QUADRATIC_TETRA: i64 = 24;
}

/// Reads a mesh at the CT shape (LPS, mm) and, if the file holds the point data `displacement`,
/// its displacement from there (mm).
///
/// Inline and appended data are read, as text, base64 or raw, uncompressed or zlib: what meshio,
/// VTK and ParaView write. Quadratic tetrahedra (type 24) give a quadratic displacement; at the CT
/// shape their edges must be straight. Points of no tetrahedron and cells of points and lines are
/// left out; the order of the points is kept.
///
/// # Errors
/// When the file cannot be read or is malformed, a part is missing (cells, the cell data
/// `boundary`), cells are of another kind, or the mesh breaks an invariant of [`TetMesh`].
pub fn read_vtu(path: &Path) -> Result<(TetMesh, Option<Displacement>), Error> {
    let bytes = file::read(path)?;
    parse(&bytes).map_err(|p| p.of(path))
}

fn parse(bytes: &[u8]) -> Result<(TetMesh, Option<Displacement>), Problem> {
    mesh::assemble(&document::Document::parse(bytes)?)
}

pub(crate) use write::write;
pub use write::write_vtu;

#[cfg(test)]
mod tests;

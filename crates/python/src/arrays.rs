//! Values of the flow as numpy arrays that share their memory and cannot be written to.

#![expect(unsafe_code, reason = "memory of the flow is lent to numpy, with its owner")]

use numpy::ndarray::{ArrayView, ArrayView1, ArrayView2, Dimension};
use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayMethods, PyUntypedArray};
use pyo3::prelude::*;
use std::any::Any;
use std::sync::Arc;
use supine_mesh::{Displacement, TetMesh};
use supine_space::{Grid, Point, Vector};
use supine_volume::Volume;

/// What an array's memory belongs to.
#[pyclass(frozen)]
struct Owner {
    _of: Arc<dyn Any + Send + Sync>,
}

/// Three numbers, as a tuple of Python.
pub(crate) type Triple = (f64, f64, f64);

/// An array of voxels indexed `[k, j, i]`, or `[k, j, i, component]` of vectors, its origin (LPS,
/// mm), spacing (mm) and direction (row by row; columns are the axes i, j, k), as SimpleITK has
/// them.
pub(crate) type VolumeParts<'py> =
    (Bound<'py, PyUntypedArray>, Triple, Triple, (Triple, Triple, Triple));

/// A volume without a copy.
///
/// # Errors
/// When Python has no memory.
pub(crate) fn volume<T: Element + Send + Sync + 'static>(
    py: Python<'_>,
    volume: Arc<Volume<T>>,
) -> PyResult<VolumeParts<'_>> {
    held_volume(py, &volume, |volume| Some(volume))
}

/// A volume that a holder has, without a copy.
///
/// # Errors
/// When Python has no memory, or the holder has no such volume.
pub(crate) fn held_volume<'py, T: Element, H: Send + Sync + 'static>(
    py: Python<'py>,
    holder: &Arc<H>,
    of: impl FnOnce(&H) -> Option<&Volume<T>>,
) -> PyResult<VolumeParts<'py>> {
    let volume = of(holder).ok_or_else(nothing)?;
    let [ni, nj, nk] = volume.grid().size();
    let view = ArrayView::from_shape((nk, nj, ni), volume.data()).map_err(shape)?;
    Ok(with_place(lent(py, &view, holder)?, volume.grid()))
}

/// Vectors on a grid that a holder has, without a copy.
///
/// # Errors
/// When Python has no memory.
pub(crate) fn held_field<'py, H: Send + Sync + 'static>(
    py: Python<'py>,
    holder: &Arc<H>,
    of: impl FnOnce(&H) -> &Volume<[f32; 3]>,
) -> PyResult<VolumeParts<'py>> {
    let field = of(holder);
    let [ni, nj, nk] = field.grid().size();
    let components = field.data().as_flattened();
    let view = ArrayView::from_shape((nk, nj, ni, 3), components).map_err(shape)?;
    Ok(with_place(lent(py, &view, holder)?, field.grid()))
}

/// An array of what a holder has, which cannot be written to.
fn lent<'py, T: Element, D: Dimension, H: Send + Sync + 'static>(
    py: Python<'py>,
    view: &ArrayView<'_, T, D>,
    holder: &Arc<H>,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let owner = Bound::new(py, Owner { _of: Arc::clone(holder) as _ })?;
    // SAFETY: both callers make the view of a reference that was derived from the holder, or from
    // what lives for ever; nobody changes or moves what an `Arc` shares while the owner, which the
    // array holds, lives. The array is made read-only before Python sees it.
    let array = unsafe { PyArray::borrow_from_array(view, owner.into_any()) };
    array.readwrite().make_nonwriteable();
    Ok(array.as_untyped().clone())
}

/// The array of a grid's voxels with the grid's origin, spacing and direction.
fn with_place<'py>(array: Bound<'py, PyUntypedArray>, grid: &Grid) -> VolumeParts<'py> {
    let row = |n: usize| {
        let direction = grid.direction();
        (direction[(n, 0)], direction[(n, 1)], direction[(n, 2)])
    };
    let (origin, spacing) = (triple(grid.origin().coords), triple(grid.spacing()));
    (array, origin, spacing, (row(0), row(1), row(2)))
}

/// A vector as Python has it.
pub(crate) fn triple(vector: Vector) -> Triple {
    (vector.x, vector.y, vector.z)
}

/// Points (n, 3) of one's own.
pub(crate) fn points<'py>(
    py: Python<'py>,
    points: &[Point],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let held = Arc::new(points.to_vec());
    let owner = Bound::new(py, Owner { _of: Arc::clone(&held) as _ })?.into_any();
    rows(triples_of_points(&held), 3, owner)
}

/// Points (n, 3), tetrahedra (n, 4), boundary faces (n, 3) and their tags (n) of a mesh.
pub(crate) type MeshParts<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray1<u8>>,
);

/// A mesh; its points and tetrahedra without a copy.
///
/// # Errors
/// When Python has no memory.
pub(crate) fn mesh<'py>(py: Python<'py>, mesh: &Arc<TetMesh>) -> PyResult<MeshParts<'py>> {
    let owner = || Bound::new(py, Owner { _of: Arc::clone(mesh) as _ }).map(Bound::into_any);
    let points = rows(triples_of_points(mesh.points()), 3, owner()?)?;
    let tets = rows(mesh.tets().as_flattened(), 4, owner()?)?;
    let corners: Vec<u32> = mesh.boundary().iter().flat_map(|face| face.points).collect();
    let tags: Vec<u8> = mesh.boundary().iter().map(|face| face.tag.number()).collect();
    let (corners, tags) = (Arc::new(corners), Arc::new(tags));
    let owner = Bound::new(py, Owner { _of: Arc::clone(&corners) as _ })?.into_any();
    let faces = rows(&corners, 3, owner)?;
    let owner = Bound::new(py, Owner { _of: Arc::clone(&tags) as _ })?.into_any();
    let view = ArrayView1::from(tags.as_slice());
    // SAFETY: as in `lent`.
    let tags = unsafe { PyArray1::borrow_from_array(&view, owner) };
    tags.readwrite().make_nonwriteable();
    Ok((points, tets, faces, tags))
}

/// Vectors (n, 3) of a displacement, mm, without a copy.
///
/// # Errors
/// When Python has no memory.
pub(crate) fn vectors<'py>(
    py: Python<'py>,
    displacement: &Displacement,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // Copies of a displacement share its vectors.
    let held = Arc::new(displacement.clone());
    let owner = Bound::new(py, Owner { _of: Arc::clone(&held) as _ })?.into_any();
    rows(triples_of_vectors(held.values()), 3, owner)
}

/// Rows of some numbers as an array that cannot be written to. The numbers must be the owner's.
fn rows<'py, T: Element>(
    numbers: &[T],
    columns: usize,
    owner: Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let view =
        ArrayView2::from_shape((numbers.len() / columns, columns), numbers).map_err(shape)?;
    // SAFETY: every caller passes memory that its owner keeps in place; the array is made
    // read-only.
    let array = unsafe { PyArray2::borrow_from_array(&view, owner) };
    array.readwrite().make_nonwriteable();
    Ok(array)
}

const _: () = assert!(size_of::<Point>() == 24 && align_of::<Point>() == align_of::<f64>());
const _: () = assert!(size_of::<Vector>() == 24 && align_of::<Vector>() == align_of::<f64>());

fn triples_of_points(points: &[Point]) -> &[f64] {
    // SAFETY: a point is three f64 without padding (`repr(C)`, and the assertions above).
    unsafe { std::slice::from_raw_parts(points.as_ptr().cast(), 3 * points.len()) }
}

fn triples_of_vectors(vectors: &[Vector]) -> &[f64] {
    // SAFETY: as for points.
    unsafe { std::slice::from_raw_parts(vectors.as_ptr().cast(), 3 * vectors.len()) }
}

fn nothing() -> PyErr {
    pyo3::exceptions::PyRuntimeError::new_err("a result that was there is gone")
}

fn shape(error: numpy::ndarray::ShapeError) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(error.to_string())
}

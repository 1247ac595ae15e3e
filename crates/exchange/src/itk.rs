//! Transforms as ITK reads them: MATLAB matrices, level 4.

use crate::{
    Error,
    file::{self, has_suffix},
    scalar::{Sample, Scalar, write_samples},
};
use std::{io::Write, path::Path};
use supine_space::{Grid, Progress};
use supine_volume::Volume;

/// ITK's name of a displacement field, which is also the name of the matrix.
const NAME: &str = "DisplacementFieldTransform_double_3_3";
/// The matrix of the grid.
const FIXED: &str = "fixed";

/// Writes a displacement field (mm, LPS; from the places of the grid to where values are taken) as
/// a transform that `SimpleITK.ReadTransform` and other programs on ITK read: `.mat` of MATLAB,
/// level 4.
///
/// Two columns, as ITK's own writer has them: the vectors, x, y, z of each voxel, i fastest, in
/// single precision; the grid in double precision: voxels along i, j, k, origin, spacing, direction
/// row by row. ITK makes both double.
///
/// # Errors
/// When the name ends otherwise, the field has more than 2147483647 numbers, the file cannot be
/// written, or the callback asked to stop.
pub fn write_transform(
    field: &Volume<[f32; 3]>,
    path: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let unwritable = |reason: &str| Error::Unwritable { path: path.into(), reason: reason.into() };
    if !has_suffix(path, ".mat") {
        return Err(unwritable("a transform is written as .mat"));
    }
    let count = 3 * field.data().len();
    let rows = i32::try_from(count).map_err(|_| {
        unwritable("the field has too many voxels for a transform; write it as .nrrd")
    })?;
    let grid = fixed(field.grid());
    file::write(path, |out| {
        out.write_all(&head::<f32>(NAME, rows))?;
        write_samples(out, field.data().iter().flatten().copied(), count, progress)?;
        out.write_all(&head::<f64>(FIXED, grid.len() as i32))?;
        write_samples(out, grid, grid.len(), Progress::none())
    })
}

/// What stands ahead of the numbers of a column: five integers and the name. The first is, as
/// decimal digits, the order of bytes (0: little endian), nothing, the type of the numbers, and 0
/// for a full matrix.
fn head<T: Sample>(name: &str, rows: i32) -> Vec<u8> {
    let kind = if matches!(T::SCALAR, Scalar::F32) { 10 } else { 0 };
    let length = name.len() as i32 + 1;
    let (columns, imaginary) = (1, 0);
    let mut bytes: Vec<u8> =
        [kind, rows, columns, imaginary, length].into_iter().flat_map(i32::to_le_bytes).collect();
    bytes.extend_from_slice(name.as_bytes());
    bytes.push(0);
    bytes
}

/// The grid as ITK's fixed parameters of a displacement field.
fn fixed(grid: &Grid) -> [f64; 18] {
    let mut fixed = [0.0; 18];
    for a in 0..3 {
        fixed[a] = grid.size()[a] as f64;
        fixed[3 + a] = grid.origin()[a];
        fixed[6 + a] = grid.spacing()[a];
        for b in 0..3 {
            fixed[9 + 3 * a + b] = grid.direction()[(a, b)];
        }
    }
    fixed
}

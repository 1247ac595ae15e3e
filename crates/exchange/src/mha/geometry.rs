//! The grid of a MetaImage, LPS, mm.

use super::header::Header;
use crate::Problem;
use supine_space::{Grid, Matrix, Point};

/// The names of the matrix: the i, j and k axes one after the other.
const MATRIX: [&str; 3] = ["TransformMatrix", "Rotation", "Orientation"];
/// The names of the place of the first voxel's centre.
const OFFSET: [&str; 3] = ["Offset", "Position", "Origin"];

/// The grid of three axes.
pub(super) fn grid(header: &Header) -> Result<Grid, Problem> {
    let dimensions: [usize; 1] = header.needed(&["NDims"])?;
    if dimensions != [3] {
        let reason = format!("{} instead of 3: one volume of three axes is read", dimensions[0]);
        return Err(Problem::field("NDims", reason));
    }
    // Where a matrix turns about a centre, ITK passes the centre over and others do not.
    let centre: Option<[f64; 3]> = header.numbers(&["CenterOfRotation"])?;
    if centre.is_some_and(|c| c.iter().any(|x| x.abs() > 0.0)) {
        let reason = "is not 0 0 0: programs do not agree where such a volume lies";
        return Err(Problem::field("CenterOfRotation", reason));
    }
    let missing = |name| {
        let reason = "is missing, so that left and right of the patient are not known: save the file with it";
        Problem::field(name, reason)
    };
    let axes: [f64; 9] = header.numbers(&MATRIX)?.ok_or_else(|| missing(MATRIX[0]))?;
    if !axes.iter().all(|x| x.is_finite()) {
        return Err(Problem::field(MATRIX[0], "holds a number that is not finite"));
    }
    let offset: [f64; 3] = header.numbers(&OFFSET)?.ok_or_else(|| missing(OFFSET[0]))?;
    let spacing: [f64; 3] = header.needed(&["ElementSpacing"])?;
    let size: [usize; 3] = header.needed(&["DimSize"])?;
    Ok(Grid::new(size, spacing.into(), Point::from(offset), Matrix::from_column_slice(&axes))?)
}

/// The lines of a grid, in MetaIO's order: matrix, offset, spacing, size.
pub(super) fn lines(grid: &Grid) -> String {
    // Adding 0 makes -0 the same as 0.
    let text = |values: &[f64]| {
        let words: Vec<String> = values.iter().map(|x| (x + 0.0).to_string()).collect();
        words.join(" ")
    };
    let [ni, nj, nk] = grid.size();
    format!(
        "TransformMatrix = {}\nOffset = {}\nCenterOfRotation = 0 0 0\nElementSpacing = {}\nDimSize = {ni} {nj} {nk}\n",
        text(grid.direction().as_slice()),
        text(grid.origin().coords.as_slice()),
        text(grid.spacing().as_slice()),
    )
}

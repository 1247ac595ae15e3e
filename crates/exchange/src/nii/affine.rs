//! sform and qform of a NIfTI-1 header.

use crate::Problem;
use nalgebra::{Quaternion, Rotation3, UnitQuaternion};
use nifti::NiftiHeader;
use supine_space::{Grid, Matrix, Point, Vector};

/// x and y change sign between RAS and LPS.
pub(super) const FLIP: Vector = Vector::new(-1.0, -1.0, 1.0);

/// The number an f32 was most likely made from: its shortest decimal, within half a unit of its
/// last place. 0.7f32 is 0.7 again, not 0.699999988.
pub(super) fn decimal(x: f32) -> f64 {
    x.to_string().parse().unwrap_or(f64::from(x))
}

/// sform and qform of one file may put a voxel this far apart, mm: what rounding to f32 and to four
/// decimals leaves.
const FORMS_MM: f64 = 0.1;

/// The grid of a header, LPS, mm: from the sform, or from the qform when there is no sform; where
/// there are both, they have to say the same.
pub(super) fn grid(header: &NiftiHeader, size: [usize; 3]) -> Result<Grid, Problem> {
    let forms = (header.sform_code > 0, header.qform_code > 0);
    if forms == (false, false) {
        let reason = "sform_code and qform_code are both 0, so that left and right of the patient \
                      are not known: set one of them in the program that wrote the file";
        return Err(Problem::field("sform_code", reason));
    }
    let by_qform = || grid_of(header, size, qform(header)?);
    if !forms.0 {
        return by_qform();
    }
    let by_sform = grid_of(header, size, sform(header))?;
    if forms.1 {
        same_place(header, &by_sform, &by_qform()?)?;
    }
    Ok(by_sform)
}

/// Refuses a header that puts the voxels at two places: programs differ in which they read.
fn same_place(header: &NiftiHeader, sform: &Grid, qform: &Grid) -> Result<(), Problem> {
    let off = sform.offset_mm(qform).unwrap_or(f64::INFINITY);
    if off <= FORMS_MM {
        return Ok(());
    }
    let mirrored = sform.direction().determinant() * qform.direction().determinant() < 0.0;
    let how = if mirrored { ", mirrored" } else { "" };
    let reason = format!(
        "sform (code {}) and qform (code {}) put the voxels up to {off:.1} mm apart{how}, and programs differ in which \
         they read: set the code of the wrong one to 0",
        header.sform_code, header.qform_code
    );
    Err(Problem::field("sform_code, qform_code", reason))
}

/// The grid of one of the forms.
fn grid_of(
    header: &NiftiHeader,
    size: [usize; 3],
    (columns, origin): (Matrix, Vector),
) -> Result<Grid, Problem> {
    let unit = unit_mm(header)?;
    let columns = Matrix::from_fn(|r, c| columns[(r, c)] * FLIP[r] * unit);
    let norms = Vector::from_fn(|a, _| columns.column(a).norm());
    let direction = Matrix::from_fn(|r, c| columns[(r, c)] / norms[c]);
    // pixdim holds the spacing as one number, the sform as three rounded ones.
    let spacing = Vector::from_fn(|a, _| {
        let stated = decimal(header.pixdim[a + 1]) * unit;
        if (stated - norms[a]).abs() <= 1e-6 * norms[a] { stated } else { norms[a] }
    });
    let origin = Point::from(origin.component_mul(&FLIP) * unit);
    Ok(Grid::new(size, spacing, origin, direction)?)
}

/// Millimetres per unit of length; an unknown unit is taken as mm, as all readers do.
fn unit_mm(header: &NiftiHeader) -> Result<f64, Problem> {
    match header.xyzt_units & 7 {
        0 | 2 => Ok(1.0),
        1 => Ok(1000.0),
        3 => Ok(1e-3),
        other => Err(Problem::field("xyzt_units", format!("{other} is not a unit of length"))),
    }
}

fn sform(header: &NiftiHeader) -> (Matrix, Vector) {
    let rows = [header.srow_x, header.srow_y, header.srow_z].map(|row| row.map(decimal));
    (Matrix::from_fn(|r, c| rows[r][c]), Vector::from_fn(|r, _| rows[r][3]))
}

/// R(quaternion) diag(pixdim 1, 2, qfac 3), `nifti1.h` method 2.
fn qform(header: &NiftiHeader) -> Result<(Matrix, Vector), Problem> {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let squares = b * b + c * c + d * d;
    // Rounding of f32 may carry the sum past 1.
    if squares.is_nan() || squares > 1.0 + 1e-5 {
        return Err(Problem::field("quatern_b, c, d", "are not part of a unit quaternion"));
    }
    let turn =
        UnitQuaternion::from_quaternion(Quaternion::new((1.0 - squares).max(0.0).sqrt(), b, c, d));
    let qfac = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let scale = Vector::new(
        decimal(header.pixdim[1]),
        decimal(header.pixdim[2]),
        decimal(header.pixdim[3]) * qfac,
    );
    let columns = turn.to_rotation_matrix().into_inner() * Matrix::from_diagonal(&scale);
    let offset = [header.quatern_x, header.quatern_y, header.quatern_z].map(decimal);
    Ok((columns, offset.into()))
}

/// What a grid becomes in a header, RAS.
#[derive(Debug)]
pub(super) struct Forms {
    /// Rows of the sform.
    pub(super) rows: [[f64; 4]; 3],
    /// Quaternion b, c, d of the qform.
    pub(super) quaternion: [f64; 3],
    /// -1 when the axes are left-handed in RAS, else 1.
    pub(super) qfac: f64,
}

impl Forms {
    /// sform and qform of the same map.
    pub(super) fn of(grid: &Grid) -> Self {
        let direction = Matrix::from_fn(|r, c| grid.direction()[(r, c)] * FLIP[r]);
        let origin = grid.origin().coords.component_mul(&FLIP);
        let row = |r: usize| {
            let at = |c: usize| direction[(r, c)] * grid.spacing()[c];
            [at(0), at(1), at(2), origin[r]]
        };
        let qfac = if direction.determinant() < 0.0 { -1.0 } else { 1.0 };
        let right_handed = direction * Matrix::from_diagonal(&Vector::new(1.0, 1.0, qfac));
        let rotation = Rotation3::from_matrix_unchecked(right_handed);
        let q = UnitQuaternion::from_rotation_matrix(&rotation);
        // The sign with a positive real part is the one that can be told from b, c, d.
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        Self { rows: [0, 1, 2].map(row), quaternion: [q.i, q.j, q.k].map(|x| x * sign), qfac }
    }
}

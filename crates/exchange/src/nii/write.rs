//! Writing NIfTI-1: little endian, sform and qform equal, mm.

use super::affine::Forms;
use crate::{
    Error,
    file::{self, COMPRESSION},
    scalar::{Sample, Scalar, write_samples},
};
use flate2::write::GzEncoder;
use std::{io::Write, path::Path};
use supine_space::{Grid, Progress};
use supine_volume::Volume;

/// Writes a volume; `note` goes to `descrip` (79 bytes) and, whole, to a comment extension.
pub(crate) fn write<T: Sample>(
    path: &Path,
    volume: &Volume<T>,
    note: &str,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let samples = volume.data().iter().copied();
    write_values(path, (volume.grid(), Values::One), note, samples, progress)
}

/// Writes displacements as ITK does, vectors in LPS, mm: intent 1007 (`NIFTI_INTENT_VECTOR`),
/// components along the fifth axis, slowest in memory. Intent 1006 (`NIFTI_INTENT_DISPVECT`) means
/// vectors in RAS, which readers built on an ITK before 5.3 take for LPS without a word.
pub(crate) fn write_displacements(
    path: &Path,
    field: &Volume<[f32; 3]>,
    note: &str,
    progress: Progress<'_>,
) -> Result<(), Error> {
    // Adding 0 makes -0 the same as 0.
    let component = |a: usize| field.data().iter().map(move |v| v[a] + 0.0);
    let samples = (0..3).flat_map(component);
    write_values(path, (field.grid(), Values::Displacement), note, samples, progress)
}

/// What a voxel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Values {
    One,
    Displacement,
}

fn write_values<T: Sample>(
    path: &Path,
    (grid, values): (&Grid, Values),
    note: &str,
    samples: impl Iterator<Item = T>,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let compressed = file::has_suffix(path, ".nii.gz");
    if !compressed && !file::has_suffix(path, ".nii") {
        let reason = "the name of a NIfTI file ends in .nii or .nii.gz".into();
        return Err(Error::Unwritable { path: path.into(), reason });
    }
    if let Some(n) = grid.size().into_iter().find(|&n| n > i16::MAX as usize) {
        let reason = format!("NIfTI-1 holds 32767 voxels along an axis, not {n}: write .nrrd");
        return Err(Error::Unwritable { path: path.into(), reason });
    }
    let extension = extension(note);
    let header = header((grid, values), T::SCALAR, note, 352 + extension.len());
    let count = grid.len() * if values == Values::Displacement { 3 } else { 1 };
    file::write(path, |out| {
        if compressed {
            let mut gzip = GzEncoder::new(out, COMPRESSION);
            gzip.write_all(&header)?;
            gzip.write_all(&extension)?;
            write_samples(&mut gzip, samples, count, progress)?;
            gzip.finish().map(drop)
        } else {
            out.write_all(&header)?;
            out.write_all(&extension)?;
            write_samples(out, samples, count, progress)
        }
    })
}

/// A comment extension (code 6): size, a multiple of 16, code, text padded with zeros.
fn extension(note: &str) -> Vec<u8> {
    if note.is_empty() {
        return vec![];
    }
    let size = (8 + note.len()).next_multiple_of(16);
    let mut bytes = (size as i32).to_le_bytes().to_vec();
    bytes.extend(6i32.to_le_bytes());
    bytes.extend(note.as_bytes());
    bytes.resize(size, 0);
    bytes
}

/// The fields of `nifti1.h` in their order, and the four bytes that announce extensions.
fn header((grid, values): (&Grid, Values), scalar: Scalar, note: &str, offset: usize) -> Vec<u8> {
    let forms = Forms::of(grid);
    let mut h = Vec::with_capacity(352);
    h.extend(348i32.to_le_bytes());
    h.extend([0; 36]); // data_type, db_name, extents, session_error, regular, dim_info
    h[38] = b'r';
    let [i, j, k] = grid.size().map(|n| n as i16);
    let (dimension, components, intent) = match values {
        Values::One => (3, 1, 0),
        Values::Displacement => (5, 3, 1007),
    };
    shorts(&mut h, &[dimension, i, j, k, 1, components, 1, 1]);
    floats(&mut h, &[0.0; 3]); // intent_p1..3
    shorts(&mut h, &[intent, datatype(scalar), scalar.size() as i16 * 8, 0]);
    let s = grid.spacing();
    let further = if values == Values::Displacement { 1.0 } else { 0.0 };
    floats(&mut h, &[forms.qfac, s.x, s.y, s.z, further, further, 0.0, 0.0]);
    floats(&mut h, &[offset as f64, 1.0, 0.0]); // vox_offset, scl_slope, scl_inter
    shorts(&mut h, &[0]); // slice_end
    h.extend([0, 2]); // slice_code, xyzt_units: mm
    floats(&mut h, &[0.0; 4]); // cal_max, cal_min, slice_duration, toffset
    h.extend([0; 8]); // glmax, glmin
    h.extend(text::<80>(note));
    h.extend([0; 24]); // aux_file
    shorts(&mut h, &[1, 1]); // qform_code, sform_code: scanner
    floats(&mut h, &forms.quaternion);
    floats(&mut h, &forms.rows.map(|row| row[3]));
    forms.rows.iter().for_each(|row| floats(&mut h, row));
    h.extend([0; 16]); // intent_name
    h.extend(b"n+1\0");
    h.extend([u8::from(!note.is_empty()), 0, 0, 0]);
    h
}

fn shorts(h: &mut Vec<u8>, values: &[i16]) {
    values.iter().for_each(|v| h.extend(v.to_le_bytes()));
}

fn floats(h: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|&v| h.extend((v as f32).to_le_bytes()));
}

/// Text cut at a character so that a zero follows it.
fn text<const N: usize>(note: &str) -> [u8; N] {
    let mut bytes = [0; N];
    let end = (0..N).rev().find(|&n| note.is_char_boundary(n)).unwrap_or(0).min(note.len());
    bytes[..end].copy_from_slice(&note.as_bytes()[..end]);
    bytes
}

fn datatype(scalar: Scalar) -> i16 {
    match scalar {
        Scalar::U8 => 2,
        Scalar::I16 => 4,
        Scalar::I32 => 8,
        Scalar::F32 => 16,
        Scalar::F64 => 64,
        Scalar::I8 => 256,
        Scalar::U16 => 512,
        Scalar::U32 => 768,
        Scalar::I64 => 1024,
        Scalar::U64 => 1280,
    }
}

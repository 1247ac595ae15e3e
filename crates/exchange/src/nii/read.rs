//! Reading NIfTI-1.

use super::affine::{self, decimal};
use super::names;
use crate::{Problem, file, raster::Raster, scalar::Scalar};
use nifti::{Endianness, NiftiHeader, NiftiType};
use std::collections::BTreeMap;
use supine_space::Progress;

/// Bytes of a NIfTI-1 header.
const HEADER: usize = 348;

/// Whether the bytes, decompressed or not, begin like NIfTI (1 or 2) of either byte order.
pub(crate) fn is_nifti(bytes: &[u8]) -> bool {
    first(bytes, 4).unwrap_or_default().first_chunk().is_some_and(|&b| {
        let sizes = [i32::from_le_bytes(b), i32::from_be_bytes(b)];
        sizes.iter().any(|s| [348, 540].contains(s))
    })
}

/// The first bytes of a file, decompressed, or fewer.
fn first(bytes: &[u8], count: usize) -> Result<Vec<u8>, Problem> {
    if file::is_gzip(bytes) {
        file::gunzip_start(bytes, count)
    } else {
        Ok(bytes[..count.min(bytes.len())].to_vec())
    }
}

/// The volume of a NIfTI-1 file.
pub(crate) fn parse(bytes: &[u8], progress: Progress<'_>) -> Result<Raster, Problem> {
    let header = header(&first(bytes, HEADER)?)?;
    let size = size(&header)?;
    let grid = affine::grid(&header, size)?;
    let scalar = scalar(&header)?;
    let wanted = grid.len().saturating_mul(scalar.size());
    let offset = offset(&header)?;
    let end = offset.saturating_add(wanted);
    let mut bytes = if file::is_gzip(bytes) {
        file::gunzip(bytes, end, progress)?.0
    } else {
        bytes[..end.min(bytes.len())].to_vec()
    };
    if bytes.len() < end {
        let (wanted, found) = (end as u128, bytes.len() as u128);
        return Err(Problem::Truncated { wanted, found });
    }
    let ahead: Vec<u8> = bytes.drain(..offset).collect();
    let (slope, intercept) = scaling(&header)?;
    let big_endian = matches!(header.endianness, Endianness::Big);
    let segments = names::segments(&ahead, big_endian)?;
    Ok(Raster {
        grid,
        layers: 1,
        layers_first: false,
        scalar,
        big_endian,
        bytes,
        slope,
        intercept,
        keys: BTreeMap::new(),
        note: note(&ahead, big_endian),
        segments,
    })
}

/// The words of the header: `descrip` and `aux_file`, which other programs carry on, and the texts
/// of extensions.
fn note(ahead: &[u8], big_endian: bool) -> String {
    let fields = [&ahead[148..228], &ahead[228..252]];
    let texts = fields.into_iter().chain(names::extensions(ahead, big_endian)).map(|text| {
        let end = text.iter().position(|&b| b == 0).unwrap_or(text.len());
        String::from_utf8_lossy(&text[..end])
    });
    texts.filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; ")
}

fn header(start: &[u8]) -> Result<NiftiHeader, Problem> {
    if start.len() < HEADER {
        let length = start.len() as u128;
        return Err(Problem::Truncated { wanted: HEADER as u128, found: length });
    }
    let size = start.first_chunk().copied().unwrap_or_default();
    if [i32::from_le_bytes(size), i32::from_be_bytes(size)].contains(&540) {
        let advice = "save the file as NIfTI-1";
        return Err(Problem::Unsupported { what: "NIfTI-2".into(), advice });
    }
    let header =
        NiftiHeader::from_reader(start).map_err(|e| Problem::field("header", e.to_string()))?;
    if header.sizeof_hdr != 348 {
        return Err(Problem::field("sizeof_hdr", format!("{} is not 348", header.sizeof_hdr)));
    }
    if &header.magic == b"ni1\0" {
        let what = "a NIfTI header whose data are in another file (.img)".into();
        return Err(Problem::Unsupported { what, advice: "save it as one file, .nii or .nii.gz" });
    }
    Ok(header)
}

/// Three dimensions; further ones must be 1.
fn size(header: &NiftiHeader) -> Result<[usize; 3], Problem> {
    let dim = header.dim().map_err(|e| Problem::field("dim", e.to_string()))?;
    match dim {
        [i, j, k, rest @ ..] if rest.iter().all(|&n| n == 1) => Ok([*i, *j, *k].map(usize::from)),
        _ => Err(Problem::field("dim", format!("{dim:?} instead of one volume of three axes"))),
    }
}

fn scalar(header: &NiftiHeader) -> Result<Scalar, Problem> {
    let kind = header.data_type().map_err(|e| Problem::field("datatype", e.to_string()))?;
    Ok(match kind {
        NiftiType::Int8 => Scalar::I8,
        NiftiType::Uint8 => Scalar::U8,
        NiftiType::Int16 => Scalar::I16,
        NiftiType::Uint16 => Scalar::U16,
        NiftiType::Int32 => Scalar::I32,
        NiftiType::Uint32 => Scalar::U32,
        NiftiType::Int64 => Scalar::I64,
        NiftiType::Uint64 => Scalar::U64,
        NiftiType::Float32 => Scalar::F32,
        NiftiType::Float64 => Scalar::F64,
        other => {
            return Err(Problem::field("datatype", format!("{other:?} is not one real number")));
        }
    })
}

/// Where the samples begin.
fn offset(header: &NiftiHeader) -> Result<usize, Problem> {
    let offset = header.vox_offset;
    // f32 holds whole numbers to 2^24; extensions that long do not occur.
    if offset.fract() == 0.0 && (HEADER as f32..=16_777_216.0).contains(&offset) {
        Ok(offset as usize)
    } else {
        Err(Problem::field("vox_offset", format!("{offset} is not a place behind the header")))
    }
}

/// Slope and intercept; a slope of 0 or NaN means that there is no scaling.
fn scaling(header: &NiftiHeader) -> Result<(f64, f64), Problem> {
    let (slope, intercept) = (header.scl_slope, header.scl_inter);
    if slope == 0.0 || slope.is_nan() {
        return Ok((1.0, 0.0));
    }
    if !(slope.is_finite() && intercept.is_finite()) {
        let reason = format!("slope {slope} and intercept {intercept} are not finite");
        return Err(Problem::field("scl_slope", reason));
    }
    Ok((decimal(slope), decimal(intercept)))
}

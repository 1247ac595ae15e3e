//! CT, scalar volumes, signed distances and displacement fields.

use crate::{
    Error, Problem, file, mha, nii,
    nrrd::{self, Axis},
    raster_file,
};
use std::path::Path;
use supine_space::{Progress, Warning};
use supine_volume::{Ct, SignedDistance, Volume};

/// A CT as a file holds it.
#[derive(Clone, Debug)]
pub struct CtFile {
    /// The CT, HU.
    pub ct: Ct,
    /// What the file says in words about how it came to be: the note of [`write_ct`], in NIfTI-1
    /// with the `aux_file`; empty when the file says nothing.
    pub note: String,
    /// What one has to know before trusting it.
    pub warnings: Vec<Warning>,
}

/// Values of a CT span more than this, HU; what spans less was scaled to something else.
const SPAN_HU: i16 = 100;

/// Reads a CT from NRRD (attached data), NIfTI-1 or MetaImage, told apart by their first bytes.
///
/// Any scalar type is taken whose values, after the scaling of the file, are HU within i16.
/// Decimals are rounded, halves to even, and that is told.
///
/// # Errors
/// When the file cannot be read, is damaged, does not say which way its axes point, holds several
/// values per voxel or a value that is no HU.
pub fn read_ct(path: &Path, progress: Progress<'_>) -> Result<CtFile, Error> {
    let raster = raster_file::read(path, progress)?;
    let ct = || {
        if raster.layers != 1 {
            let reason = format!("{} values per voxel, a CT has one", raster.layers);
            return Err(Problem::field("sizes", reason));
        }
        let (data, rounded) = raster.rounded("expected HU from -32768 to 32767")?;
        if rounded {
            refuse_scaled(&data)?;
        }
        Ok((raster.grid.clone(), data, rounded))
    };
    let (grid, data, rounded) = ct().map_err(|p| p.of(path))?;
    let ct = Volume::new(grid, data);
    let ct = ct.map_err(|e| Problem::field("sizes", e.to_string()).of(path))?;
    let text = "the values of the CT have decimals; HU were rounded to whole numbers";
    let warnings = rounded.then(|| Warning::new("values-rounded", text)).into_iter().collect();
    Ok(CtFile { ct, note: raster.note, warnings })
}

/// Refuses values with decimals that span too little to be HU: of a CT that was scaled to 0..1,
/// nothing would be left.
fn refuse_scaled(data: &[i16]) -> Result<(), Problem> {
    let (low, high) = data.iter().fold((i16::MAX, i16::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    if i32::from(high) - i32::from(low) >= i32::from(SPAN_HU) {
        return Ok(());
    }
    let reason = format!(
        "all lie between {low} and {high}, with decimals: they are no HU; save the CT without scaling its values"
    );
    Err(Problem::field("values", reason))
}

/// Reads tenths of mm, 0 to 255, as [`write_tenths`] writes them.
///
/// # Errors
/// When the file cannot be read, is damaged, does not say which way its axes point, or holds
/// anything but one whole number from 0 to 255 per voxel.
pub fn read_tenths(path: &Path, progress: Progress<'_>) -> Result<Volume<u8>, Error> {
    let raster = raster_file::read(path, progress)?;
    let data = if raster.layers == 1 {
        raster.whole::<u8>("expected a whole number of tenths of mm from 0 to 255")
    } else {
        let reason = format!("{} values per voxel, expected one", raster.layers);
        Err(Problem::field("sizes", reason))
    };
    let data = data.map_err(|p| p.of(path))?;
    Volume::new(raster.grid, data).map_err(|e| Problem::field("sizes", e.to_string()).of(path))
}

/// Writes lengths in tenths of mm as NRRD: 8 bit, gzip, LPS.
///
/// # Errors
/// When the name does not end in `.nrrd` the file cannot be written, or the callback asked to
/// stop.
pub fn write_tenths(volume: &Volume<u8>, path: &Path, progress: Progress<'_>) -> Result<(), Error> {
    only_nrrd(path, "a map of lengths")?;
    let keys = [("sample units".into(), "0.1 mm".into())];
    nrrd::write(path, volume.grid(), &Axis::Scalar, &keys, volume.data().iter().copied(), progress)
}

/// Writes a CT in the format its name ends in: `.nrrd` as [`write_ct_nrrd`], `.nii` and `.nii.gz`
/// as [`write_ct_nifti`], `.mha` as MetaImage (16 bit, zlib, LPS, the note as `Comment`).
///
/// # Errors
/// When the name ends otherwise, the file cannot be written, or the callback asked to stop.
pub fn write_ct(ct: &Ct, path: &Path, note: &str, progress: Progress<'_>) -> Result<(), Error> {
    if is_meta_image(path) {
        return mha::write(path, (ct.grid(), 1), note, ct.data().iter().copied(), progress);
    }
    if is_nifti(path) {
        return write_ct_nifti(ct, path, note, progress);
    }
    only_nrrd_too(path, "a CT")?;
    write_ct_nrrd(ct, path, note, progress)
}

/// Writes a CT as NRRD: 16 bit, gzip, LPS.
///
/// `note` says how the volume came to be (`DERIVED ...`); it stands under the key `derivation`,
/// unless it is empty.
///
/// # Errors
/// When the file cannot be written, or the callback asked to stop.
pub fn write_ct_nrrd(
    ct: &Ct,
    path: &Path,
    note: &str,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let keys = if note.is_empty() { vec![] } else { vec![("derivation".into(), note.into())] };
    nrrd::write(path, ct.grid(), &Axis::Scalar, &keys, ct.data().iter().copied(), progress)
}

/// Writes a CT as NIfTI-1 (`.nii`, or `.nii.gz` compressed): 16 bit, sform and qform equal, RAS.
///
/// `note` says how the volume came to be (`DERIVED ...`); its first 79 bytes stand in `descrip`,
/// all of it in a comment extension.
///
/// # Errors
/// When the name ends otherwise, a dimension exceeds 32,767 the file cannot be written, or the
/// callback asked to stop.
pub fn write_ct_nifti(
    ct: &Ct,
    path: &Path,
    note: &str,
    progress: Progress<'_>,
) -> Result<(), Error> {
    nii::write(path, ct, note, progress)
}

/// What the vectors of a displacement field lead from and to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldKind {
    /// From a voxel of the output image to the place in the input image it is sampled at: what ITK
    /// and Slicer transforms hold.
    Resampling,
    /// From a point of the input to where it moves: what carries points and surfaces.
    Modeling,
}

impl FieldKind {
    fn name(self) -> &'static str {
        match self {
            Self::Resampling => "resampling",
            Self::Modeling => "modeling",
        }
    }
}

/// Writes a displacement field (mm, LPS) with three floats per voxel: as NRRD, or as NIfTI-1
/// (`.nii`, `.nii.gz`) as ITK writes them, with the intent `VECTOR` and vectors in LPS, or as
/// MetaImage (`.mha`).
///
/// In NRRD the key `displacement field type` says which way it leads, as 3D Slicer reads it; in
/// NIfTI the description does, in MetaImage the comment. ITK takes any of these files of kind
/// [`FieldKind::Resampling`] as the field of a displacement field transform.
///
/// # Errors
/// When the name ends otherwise, the file cannot be written, or the callback asked to stop.
pub fn write_field(
    field: &Volume<[f32; 3]>,
    path: &Path,
    kind: FieldKind,
    progress: Progress<'_>,
) -> Result<(), Error> {
    if is_nifti(path) {
        let note = format!("displacement field type: {}", kind.name());
        return nii::write_displacements(path, field, &note, progress);
    }
    let samples = field.data().iter().flatten().copied();
    if is_meta_image(path) {
        let note = format!("displacement field type: {}", kind.name());
        return mha::write(path, (field.grid(), 3), &note, samples, progress);
    }
    only_nrrd_too(path, "a displacement field")?;
    let keys = [("displacement field type".into(), kind.name().into())];
    nrrd::write(path, field.grid(), &Axis::Vector, &keys, samples, progress)
}

/// Writes a volume of floats (say, the Jacobian) as NRRD, NIfTI-1 (`.nii`, `.nii.gz`) or MetaImage
/// (`.mha`).
///
/// # Errors
/// When the name ends otherwise, the file cannot be written, or the callback asked to stop.
pub fn write_scalar(
    volume: &Volume<f32>,
    path: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    if is_nifti(path) {
        return nii::write(path, volume, "", progress);
    }
    let samples = volume.data().iter().copied();
    if is_meta_image(path) {
        return mha::write(path, (volume.grid(), 1), "", samples, progress);
    }
    only_nrrd_too(path, "a volume of floats")?;
    nrrd::write(path, volume.grid(), &Axis::Scalar, &[], samples, progress)
}

/// Unit of the whole numbers of a signed distance, as files name it.
const DISTANCE_UNIT: (&str, &str) = ("unit", "1/2000 mm");

/// Writes a signed distance as NRRD: 16 bit, in 1/2000 mm (the key `unit` says so).
///
/// # Errors
/// When the name does not end in `.nrrd` the file cannot be written, or the callback asked to
/// stop.
pub fn write_signed_distance(
    distance: &SignedDistance,
    path: &Path,
    progress: Progress<'_>,
) -> Result<(), Error> {
    only_nrrd(path, "a signed distance")?;
    let keys = [(DISTANCE_UNIT.0.into(), DISTANCE_UNIT.1.into())];
    let values = distance.values();
    nrrd::write(path, values.grid(), &Axis::Scalar, &keys, values.data().iter().copied(), progress)
}

/// Reads what [`write_signed_distance`] wrote.
///
/// # Errors
/// When the file cannot be read, is damaged or does not hold whole numbers of 1/2000 mm.
pub fn read_signed_distance(path: &Path, progress: Progress<'_>) -> Result<SignedDistance, Error> {
    let raster = raster_file::read(path, progress)?;
    let values = || {
        let unit = raster.keys.get(DISTANCE_UNIT.0).map(String::as_str);
        if unit != Some(DISTANCE_UNIT.1) || raster.layers != 1 {
            let reason = "a signed distance is in 1/2000 mm, one value per voxel";
            return Err(Problem::field(DISTANCE_UNIT.0, reason.to_string()));
        }
        raster.whole::<i16>("expected a whole number from -32768 to 32767")
    };
    let values = values().map_err(|p| p.of(path))?;
    Volume::new(raster.grid.clone(), values)
        .map(SignedDistance::from_values)
        .map_err(|e| Problem::field("sizes", e.to_string()).of(path))
}

fn is_nifti(path: &Path) -> bool {
    file::has_suffix(path, ".nii") || file::has_suffix(path, ".nii.gz")
}

/// Whether MetaImage is to be written: one file, never a header beside its data.
pub(crate) fn is_meta_image(path: &Path) -> bool {
    file::has_suffix(path, ".mha")
}

/// Refuses what ends in none of the endings of volumes; the other formats have been seen to. A
/// segmentation of 3D Slicer (`.seg.nrrd`) holds labels alone.
fn only_nrrd_too(path: &Path, what: &str) -> Result<(), Error> {
    if is_plain_nrrd(path) {
        return Ok(());
    }
    let reason = format!("{what} is written as .nrrd, .nii, .nii.gz or .mha");
    Err(Error::Unwritable { path: path.into(), reason })
}

fn is_plain_nrrd(path: &Path) -> bool {
    file::has_suffix(path, ".nrrd") && !file::has_suffix(path, ".seg.nrrd")
}

fn only_nrrd(path: &Path, what: &str) -> Result<(), Error> {
    if is_plain_nrrd(path) {
        Ok(())
    } else {
        let reason = format!("{what} is written as .nrrd only");
        Err(Error::Unwritable { path: path.into(), reason })
    }
}

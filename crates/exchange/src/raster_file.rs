//! Voxel data from a file of any format.

use crate::{Problem, file, mha, nii, nrrd, raster::Raster};
use std::path::{Path, PathBuf};
use supine_space::Progress;

/// What a name of a volume ends with, in lower case.
const ENDINGS: [&str; 5] = [".nrrd", ".nii", ".nii.gz", ".mha", ".mhd"];

/// Whether a file's name is that of a volume that is read here: `.nrrd`, `.nii`, `.nii.gz`, `.mha` or `.mhd`,
/// whatever the case.
pub fn is_volume_name(path: &Path) -> bool {
    ENDINGS.iter().any(|ending| file::has_suffix(path, ending))
}

/// The files that are read when a volume is named: itself, and of a `.mhd` the file with its samples. Of a header
/// that cannot be used, itself alone: whoever reads it is told.
///
/// # Errors
/// When a `.mhd` cannot be read.
pub fn volume_files(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = vec![path.to_owned()];
    if file::has_suffix(path, ".mhd") {
        let beside = mha::data_file(&std::fs::read(path)?).ok().flatten();
        files.extend(beside.map(|name| path.with_file_name(name)).filter(|p| p.is_file()));
    }
    Ok(files)
}

/// The voxel data of a NRRD, NIfTI or MetaImage file.
pub(crate) fn read(path: &Path, progress: Progress<'_>) -> Result<Raster, crate::Error> {
    let bytes = file::read(path)?;
    if !mha::is_meta_image(&bytes) {
        return parse(&bytes, progress).map_err(|p| p.of(path));
    }
    let beside = mha::data_file(&bytes).map_err(|p| p.of(path))?;
    let beside = beside.map(|name| file::read(&path.with_file_name(name))).transpose()?;
    mha::parse(&bytes, beside.as_deref(), progress).map_err(|p| p.of(path))
}

/// The voxel data of one NRRD or NIfTI file; its first bytes decide which it is.
pub(crate) fn parse(bytes: &[u8], progress: Progress<'_>) -> Result<Raster, Problem> {
    if bytes.starts_with(b"NRRD") {
        nrrd::parse(bytes, progress)
    } else if nii::is_nifti(bytes) {
        nii::parse(bytes, progress)
    } else {
        Err(Problem::Format("NRRD (.nrrd), NIfTI-1 (.nii, .nii.gz) or MetaImage (.mha, .mhd)"))
    }
}

//! Voxel data from a file of either format.

use crate::{Problem, file, nii, nrrd, raster::Raster};
use std::path::Path;
use supine_space::Progress;

/// The voxel data of a NRRD or NIfTI file.
pub(crate) fn read(path: &Path, progress: Progress<'_>) -> Result<Raster, crate::Error> {
    let bytes = file::read(path)?;
    parse(&bytes, progress).map_err(|p| p.of(path))
}

/// The voxel data of a NRRD or NIfTI file; its first bytes decide which it is.
pub(crate) fn parse(bytes: &[u8], progress: Progress<'_>) -> Result<Raster, Problem> {
    if bytes.starts_with(b"NRRD") {
        nrrd::parse(bytes, progress)
    } else if nii::is_nifti(bytes) {
        nii::parse(bytes, progress)
    } else {
        Err(Problem::Format("NRRD (.nrrd) or NIfTI-1 (.nii, .nii.gz)"))
    }
}

//! Voxel data from a file of any format.

use crate::{Problem, file, mha, nii, nrrd, raster::Raster};
use std::path::{Path, PathBuf};
use supine_space::Progress;

/// What a name of a volume ends with, in lower case.
const ENDINGS: [&str; 5] = [".nrrd", ".nii", ".nii.gz", ".mha", ".mhd"];

/// Whether a file's name is that of a volume that is read here: `.nrrd`, `.nii`, `.nii.gz`, `.mha`
/// or `.mhd`, whatever the case.
pub fn is_volume_name(path: &Path) -> bool {
    ENDINGS.iter().any(|ending| file::has_suffix(path, ending))
}

/// The files that are read when a volume is named: itself, and of a `.mhd` the file with its
/// samples. Of a header that cannot be used, itself alone: whoever reads it is told.
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

/// Forms that volumes come in elsewhere and that are not read: ending, what it is, what to do.
const ELSEWHERE: [(&str, &str, &str); 11] = [
    (".nhdr", "a NRRD whose voxels lie in another file", "save it as one .nrrd"),
    (".hdr", "an image of two files (.hdr and .img)", "save it as .nii.gz"),
    (".img", "an image of two files (.hdr and .img)", "save it as .nii.gz"),
    (".mgz", "a FreeSurfer volume", "save it as .nii.gz"),
    (".vti", "a VTK image", "save it as .nrrd or .nii.gz"),
    (".zip", PACKED, UNPACK),
    (".tar", PACKED, UNPACK),
    (".tar.gz", PACKED, UNPACK),
    (".tgz", PACKED, UNPACK),
    (".7z", PACKED, UNPACK),
    (".rar", PACKED, UNPACK),
];
const PACKED: &str = "an archive of files";
const UNPACK: &str = "unpack it and name what was in it";

/// Why a file of this name is not read, where its ending tells: a volume in another form, or an
/// archive.
pub(crate) fn form_elsewhere(path: &Path) -> Option<Problem> {
    let entry = ELSEWHERE.iter().find(|(ending, ..)| file::has_suffix(path, ending));
    entry.map(|&(_, what, advice)| Problem::Unsupported { what: what.into(), advice })
}

/// Whether a name is that of a volume in a form that is not read, or of an archive, as
/// [`crate::read_ct`] tells of it.
pub fn is_volume_elsewhere(path: &Path) -> bool {
    form_elsewhere(path).is_some()
}

/// The voxel data of a NRRD, NIfTI or MetaImage file.
pub(crate) fn read(path: &Path, progress: Progress<'_>) -> Result<Raster, crate::Error> {
    if let Some(problem) = form_elsewhere(path) {
        return Err(problem.of(path));
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_that_are_not_read_are_named_with_what_to_do() {
        let dir = tempfile::tempdir().unwrap();
        let told = |name: &str| {
            let path = dir.path().join(name);
            std::fs::write(&path, "NRRD0005\n").unwrap();
            read(&path, Progress::none()).unwrap_err().to_string()
        };
        assert!(told("ct.NHDR").contains("save it as one .nrrd"), "{}", told("ct.NHDR"));
        assert!(told("ct.img").contains("two files (.hdr and .img)"));
        assert!(told("study.tar.gz").contains("unpack it and name what was in it"));
        assert!(!told("ct.nrrd").contains("is not read"));
        assert!(!is_volume_elsewhere(Path::new("labels.seg.nrrd")));
    }
}

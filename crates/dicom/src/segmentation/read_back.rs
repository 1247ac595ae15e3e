//! A segmentation appears under its name only when it reads back as it was meant.

use super::{read_segmentation, write::Label};
use crate::data_set::DataSet;
use crate::error::Error;
use dicom_dictionary_std::tags;
use dicom_object::open_file;
use std::io::Write as _;
use std::path::Path;
use supine_volume::LabelMap;

/// Writes a file under a temporary name beside its own, which it gets when `check` finds no fault.
pub(super) fn write(
    path: &Path,
    bytes: &[u8],
    check: impl FnOnce(&Path) -> Result<(), String>,
) -> Result<(), Error> {
    let fail = |source| Error::Write { path: path.to_owned(), source };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".supine-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        // The mask of the process decides, as for any other file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder).map_err(fail)?;
    temporary.write_all(bytes).map_err(fail)?;
    temporary.flush().map_err(fail)?;
    check(temporary.path()).map_err(|reason| {
        let file = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Error::ReadBack { file, reason }
    })?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Another reader (dicom-object) must see the same identity and pixels, and ours the same labels.
pub(super) fn check(
    path: &Path,
    meant: &DataSet,
    labels: &LabelMap,
    frame_of_reference: &str,
    segments: &[Label],
) -> Result<(), String> {
    let object = open_file(path).map_err(|e| e.to_string())?;
    for tag in [tags::SOP_INSTANCE_UID, tags::SERIES_INSTANCE_UID, tags::FRAME_OF_REFERENCE_UID] {
        let found = object.element(tag).map_err(|e| e.to_string())?;
        let found = found.to_str().map_err(|e| e.to_string())?;
        if found.trim_matches([' ', '\0']) != meant.text(tag) {
            return Err(format!("{tag} differs"));
        }
    }
    let pixels = object.element(tags::PIXEL_DATA).map_err(|e| e.to_string())?;
    let pixels = pixels.to_bytes().map_err(|e| e.to_string())?;
    let wanted = meant.bytes(tags::PIXEL_DATA).unwrap_or_default();
    if !pixels.starts_with(wanted) || pixels.len() > wanted.len() + 1 {
        return Err("the pixels differ".into());
    }
    let read = read_segmentation(path, labels.grid(), Some(frame_of_reference))
        .map_err(|e| e.to_string())?;
    for ((number, name, _), segment) in segments.iter().zip(read.segments()) {
        let mask = read.mask(segment.number);
        let mut pairs = labels.data().iter().zip(mask.data());
        if segment.name != *name || pairs.any(|(l, m)| (l == number) != *m) {
            return Err(format!("the segment {name:?} differs"));
        }
    }
    Ok(())
}

//! Single objects that are no slices: opening them, and telling which they are.

use crate::data_set::{Container, DataSet, OpenError, Parsed, TransferSyntax, Until};
use crate::error::Error;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;
use supine_space::Warning;

/// Objects that hold regions of the patient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RegionObject {
    /// A segmentation, see [`crate::read_segmentation`].
    Segmentation,
    /// A structure set, see [`crate::read_structures`].
    Structures,
}

/// Which object of regions a file is, by its content; `None` when it is no DICOM file.
///
/// # Errors
/// When the file cannot be read, or is a DICOM file of another kind or a damaged one.
pub fn region_object(path: &Path) -> Result<Option<RegionObject>, Error> {
    let Some(class) = class(path)? else { return Ok(None) };
    match class.as_str() {
        uids::SEGMENTATION_STORAGE | uids::LABEL_MAP_SEGMENTATION_STORAGE => {
            Ok(Some(RegionObject::Segmentation))
        }
        uids::RT_STRUCTURE_SET_STORAGE => Ok(Some(RegionObject::Structures)),
        _ => {
            let what = format!(
                "neither a segmentation nor a structure set, but: {}",
                crate::folder::kind(&class)
            );
            Err(Error::Unsupported { file: name(path), what })
        }
    }
}

/// Whether a file is an RT dose, by its content.
///
/// # Errors
/// When the file cannot be read or is a damaged DICOM file.
pub fn is_dose(path: &Path) -> Result<bool, Error> {
    Ok(class(path)?.is_some_and(|class| class == uids::RT_DOSE_STORAGE))
}

/// SOP Class UID of a file; `None` when it is no DICOM file.
fn class(path: &Path) -> Result<Option<String>, Error> {
    let file = name(path);
    let mut container = match Container::open_head(path) {
        Ok(container) => container,
        Err(OpenError::NotDicom(_)) => return Ok(None),
        Err(OpenError::Malformed { .. }) if !says_dicom(path)? => return Ok(None),
        Err(error) => return Err(opened(error, path, &file)),
    };
    let class = container.meta.text(tags::MEDIA_STORAGE_SOP_CLASS_UID);
    if !class.is_empty() {
        return Ok(Some(class));
    }
    let head = container.data(Until::PixelData).map_err(|e| opened(e, path, &file))?;
    Ok(Some(head.set.text(tags::SOP_CLASS_UID)))
}

/// Whether a file has the marker of a DICOM file; one that cannot be read has not.
pub fn has_marker(path: &Path) -> bool {
    says_dicom(path).unwrap_or(false)
}

/// Whether the file has the marker of a DICOM file.
fn says_dicom(path: &Path) -> Result<bool, Error> {
    use std::io::Read as _;
    let read_error = |source| Error::Read { path: path.to_owned(), source };
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map_err(read_error)?;
    file.take(132).read_to_end(&mut head).map_err(read_error)?;
    Ok(head.get(128..132) == Some(b"DICM") || head.starts_with(b"DICM"))
}

/// A whole object.
pub(crate) struct Object {
    /// Name of the file, for messages.
    pub(crate) file: String,
    pub(crate) set: DataSet,
    pub(crate) syntax: TransferSyntax,
    /// Bytes behind the last element.
    behind: usize,
}

/// That files are longer than what they hold, by so many bytes.
pub(crate) fn told_behind(bytes: usize) -> Option<Warning> {
    const TEXT: &str = "files go on behind their last element, with zeros or with what is no DICOM; that was passed over";
    (bytes > 0).then(|| Warning::new("bytes-behind-data", TEXT))
}

impl Object {
    /// Reads a whole file.
    pub(crate) fn open(path: &Path) -> Result<Self, Error> {
        let file = name(path);
        let mut container = Container::open(path).map_err(|e| opened(e, path, &file))?;
        let Parsed { set, behind, .. } =
            container.data(Until::End).map_err(|e| opened(e, path, &file))?;
        Ok(Self { file, set, syntax: container.syntax, behind })
    }

    /// That the file is longer than what it holds.
    pub(crate) fn told_behind(&self) -> Option<Warning> {
        told_behind(self.behind)
    }

    pub(crate) fn unsupported<T>(&self, what: impl Into<String>) -> Result<T, Error> {
        Err(Error::Unsupported { file: self.file.clone(), what: what.into() })
    }

    pub(crate) fn fail<T>(
        &self,
        attribute: &'static str,
        reason: impl Into<String>,
    ) -> Result<T, Error> {
        Err(Error::attribute(&self.file, attribute, reason))
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn opened(error: OpenError, path: &Path, file: &str) -> Error {
    let malformed = |reason: String| Error::Malformed { file: file.to_owned(), reason };
    match error {
        OpenError::Io(source) => Error::Read { path: path.to_owned(), source },
        OpenError::NotDicom(reason) => malformed(reason.to_owned()),
        OpenError::Malformed { reason, .. } => malformed(reason),
    }
}

//! The CT, from whatever holds it.

use crate::Error;
use std::path::Path;
use supine_dicom::{ReadInfo, ReadParams, Source, tells_deformation};
use supine_exchange::CtFile;
use supine_space::{Progress, Warning};
use supine_volume::{Ct, Field};

/// A CT and, when it came from DICOM, what an export inherits.
#[derive(Debug)]
pub struct CtInput {
    /// The CT, HU.
    pub ct: Ct,
    /// The series it came from; `None` for NRRD, NIfTI and MetaImage, which carry no patient.
    pub dicom: Option<(Source, ReadInfo)>,
    /// Whether it is a result of this program: a CT that it deformed.
    pub deformed: bool,
    /// What was noticed when it was read.
    pub warnings: Vec<Warning>,
}

impl CtInput {
    /// What was measured: as the padding of a series tells, else as it is found in the values.
    pub fn field(&self) -> Field {
        let told = self.dicom.as_ref().and_then(|(source, _)| source.field(self.ct.grid()));
        told.unwrap_or_else(|| Field::found(&self.ct))
    }

    /// Refuses values that cannot be HU of a patient in air; of a series that is done when it is read.
    ///
    /// # Errors
    /// [`Error::Ct`].
    pub(crate) fn in_hu(self) -> Result<Self, Error> {
        if self.dicom.is_none() {
            supine_dicom::refuse_implausible(self.ct.data()).map_err(Error::Ct)?;
        }
        Ok(self)
    }

    /// Refuses a result of this program.
    ///
    /// # Errors
    /// [`Error::Deformed`].
    pub(crate) fn not_deformed(self, path: &Path) -> Result<Self, Error> {
        if self.deformed { Err(Error::Deformed { path: path.into() }) } else { Ok(self) }
    }
}

/// Reads a CT: a DICOM folder (or a file of the series), an NRRD, NIfTI or MetaImage file.
///
/// # Errors
/// When it is not there, not readable, or not one usable series.
pub fn read_ct(path: &Path, params: &ReadParams, progress: Progress<'_>) -> Result<CtInput, Error> {
    if let Err(source) = std::fs::metadata(path) {
        return Err(Error::Missing { key: "ct", path: path.into(), source });
    }
    if supine_exchange::is_volume_name(path) {
        return volume(path, progress);
    }
    match supine_dicom::read_series(path, params, progress) {
        Ok((ct, source, info)) => {
            let deformed = source.is_deformed();
            let warnings = info.warnings.clone();
            Ok(CtInput { ct, dicom: Some((source, info)), deformed, warnings })
        }
        Err(supine_dicom::Error::Stopped(_)) => Err(Error::Stopped),
        // Slices of DICOM have names of any kind, so that the name tells only what is none.
        Err(supine_dicom::Error::NotDicom { .. })
            if path.is_file() && supine_exchange::is_volume_elsewhere(path) =>
        {
            volume(path, progress)
        }
        Err(error) => Err(Error::Ct(error)),
    }
}

/// A CT in one file that is no DICOM.
fn volume(path: &Path, progress: Progress<'_>) -> Result<CtInput, Error> {
    let read = supine_exchange::read_ct(path, progress);
    let CtFile { ct, note, warnings } = read.map_err(|source| Error::file("ct", source))?;
    Ok(CtInput { ct, dicom: None, deformed: tells_deformation(&note), warnings })
}

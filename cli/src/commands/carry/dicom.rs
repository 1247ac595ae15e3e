//! DICOM objects of the CT before deformation, and of the exported one.

use super::Job;
use crate::failure::Failure;
use std::path::PathBuf;
use supine_dicom::{CompanionParams, Deformable, ObjectReference, Source, read_deformable};
use supine_pipeline::CtInput;
use supine_volume::Ct;

/// The exported CT of a run with the registration beside it.
pub(super) struct Exported {
    /// Its voxels.
    pub(super) ct: Ct,
    /// The headers of its slices.
    pub(super) source: Source,
    /// The registration to the CT it was made from.
    pub(super) registration: Option<ObjectReference>,
}

impl Job<'_> {
    /// Whether the result is to be a DICOM object.
    pub(super) fn to_dicom(&self) -> bool {
        self.args.out.extension().is_some_and(|e| e.eq_ignore_ascii_case("dcm"))
    }

    /// The exported CT, to which a DICOM object will belong.
    pub(super) fn exported(&self) -> Result<Exported, Failure> {
        let folder = self.from.join("ct");
        if !folder.is_dir() {
            return Err(Failure::usage(
                "a DICOM object (.dcm) goes with the exported CT of a run: name the folder of a \
                 run whose CT came as DICOM, or another ending",
            ));
        }
        let CtInput { ct, dicom } = self.read_ct(&folder)?;
        let Some((source, _)) = dicom else {
            return Err(Failure::input(format!("{} is no DICOM series", folder.display())));
        };
        let registration = self.registration()?;
        if let Some(r) = &registration
            && r.registered_frame_uid != source.frame_of_reference_uid()
        {
            return Err(Failure::input(format!(
                "{} is not the registration of {}",
                self.registration_path().display(),
                folder.display()
            )));
        }
        Ok(Exported { ct, source, registration: registration.map(|r| r.object) })
    }

    /// Frame of reference of the CT before deformation, as far as it is known.
    pub(super) fn frame_before(&self) -> Result<Option<String>, Failure> {
        if let Some((source, _)) = self.ct()?.and_then(|ct| ct.dicom) {
            return Ok(Some(source.frame_of_reference_uid()));
        }
        Ok(self.registration()?.map(|r| r.source_frame_uid))
    }

    /// What is carried must lie in the frame of reference of the CT; a warning when that is not known.
    pub(super) fn same_frame(&self, frames: &[String]) -> Result<Option<String>, Failure> {
        let Some(own) = self.frame_before()? else {
            let unknown = "the frame of reference was not compared with the CT's (--ct)";
            return Ok(Some(unknown.into()));
        };
        if frames.iter().any(|f| !f.is_empty() && *f != own) {
            return Err(Failure::input(format!(
                "{} was drawn in another frame of reference than that of the CT",
                self.what.display()
            )));
        }
        Ok(None)
    }

    fn registration(&self) -> Result<Option<Deformable>, Failure> {
        let path = self.registration_path();
        if !path.is_file() {
            return Ok(None);
        }
        Ok(Some(read_deformable(&path)?))
    }

    fn registration_path(&self) -> PathBuf {
        self.from.join("registration").join("deformable.dcm")
    }
}

/// What a carried object says about itself.
pub(super) fn params(what: &str, source: &Source) -> CompanionParams {
    CompanionParams {
        series_description: format!("DEFORMED {what} [supine]"),
        derivation: format!(
            "DERIVED: {what} carried with the tissue of a simulated deformation, not made anew on \
             it. The CT:"
        ),
        clock: source.clock(),
        software_version: env!("CARGO_PKG_VERSION").into(),
    }
}

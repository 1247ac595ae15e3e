//! A patient's own dose, structures and segments in the operating position, as objects of the
//! exported CT.
//!
//! The one way for a run (`carry.*` in the case) and for `supine carry`: [`CarryContext`] says what
//! an object is compared with and what it may name, the other files move it and write it.

use crate::Error;
use crate::shared::{CtInput, ExportSource, compare_patient, names_a_patient, read_ct};
use std::path::{Path, PathBuf};
use supine_dicom::{
    Anonymiser, CompanionParams, Deformable, Dose, NOT_USABLE, ObjectReference, ReadParams, Roi,
    Segmentation, Source, Structures, frame_of_reference, read_deformable, read_dose,
    read_segmentation, read_structures,
};
use supine_report::PatientIdentity;
use supine_space::{Grid, Progress, Warning};
use supine_volume::Ct;

/// Said of an object that names no frame of reference (PS3.3 C.7.4.1 asks for it).
const NO_FRAME: &str = "it names no frame of reference: that it was made on this CT rests on its patient and its place alone";
/// Said when the CT before deformation is not known.
const NOT_COMPARED: &str = "the frame of reference was not compared with the CT's (--ct)";

/// What was exported, as far as there is any.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExportedFiles {
    /// The folder of the series.
    pub(crate) series: Option<PathBuf>,
    /// The deformable registration.
    pub(crate) registration: Option<PathBuf>,
    /// What took the patient out, while it is known.
    pub(crate) secret: Option<[u8; 32]>,
    /// They are of a run that must not be used: what is carried with them says so.
    pub(crate) not_usable: bool,
}

/// What an object of the patient is held against before it is carried.
#[derive(Debug)]
pub(crate) struct CarryContext {
    /// The exported CT, when the run has one.
    exported: Option<(Ct, Source)>,
    /// The series that an export will be made from, while there is none.
    ahead: Option<Source>,
    registration: Option<Deformable>,
    /// What took the patient out of the exported CT.
    anonymiser: Option<Anonymiser>,
    /// Frame of reference of the CT before deformation, as far as it is known.
    before: Option<String>,
    /// Whose the CT before deformation is, where that is at hand.
    patient: Option<PatientIdentity>,
    /// What is carried comes from a run that must not be used.
    not_usable: bool,
}

/// Where an object, or a region of it, was drawn.
#[derive(Debug)]
struct Drawn {
    /// Name of the region; none for the object as a whole.
    region: Option<String>,
    /// UID of the frame of reference; empty where none is named.
    frame: String,
}

impl Drawn {
    fn whole(frame: String) -> Self {
        Self { region: None, frame }
    }

    fn regions(structures: &Structures) -> Vec<Self> {
        let of = |roi: &Roi| Self {
            region: Some(roi.name.clone()),
            frame: roi.frame_of_reference.clone(),
        };
        structures.rois().iter().map(of).collect()
    }
}

impl CarryContext {
    /// The context of what was exported; `before` is the series before deformation, where it is at
    /// hand.
    ///
    /// # Errors
    /// When the exported series, its registration or the key of its de-identification cannot be
    /// read, or do not belong together.
    pub(crate) fn of(
        exported: &ExportedFiles,
        before: Option<&Source>,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let ExportedFiles { series, registration: path, secret, not_usable } = exported;
        let exported = match series {
            Some(folder) => match read_ct(folder, &ReadParams::default(), progress)? {
                CtInput { ct, dicom: Some((source, _)), .. } => Some((ct, source)),
                CtInput { dicom: None, .. } => None,
            },
            None => None,
        };
        let registration = path
            .as_ref()
            .filter(|path| path.is_file())
            .map(|path| read_deformable(path).map_err(Error::Carried))
            .transpose()?;
        if let (Some(r), Some((_, source))) = (&registration, &exported)
            && r.registered_frame_uid != source.frame_of_reference_uid()
        {
            let (path, series) =
                (path.clone().unwrap_or_default(), series.clone().unwrap_or_default());
            return Err(Error::OtherRegistration { path, series });
        }
        let anonymised = exported.as_ref().is_some_and(|(_, source)| source.is_anonymised());
        if let (Some(before), Some((_, source)), false) = (before, &exported, anonymised) {
            let [own, other] = [source, before].map(|of| of.whose().id);
            let frame = registration.as_ref().map(|r| &r.source_frame_uid);
            let elsewhere = frame.is_some_and(|uid| *uid != before.frame_of_reference_uid());
            if elsewhere || (!own.is_empty() && !other.is_empty() && own != other) {
                return Err(Error::OtherCt);
            }
        }
        let anonymiser = secret.filter(|_| anonymised).map(Anonymiser::new);
        let patient = before.map(Source::whose);
        let before = before.map(Source::frame_of_reference_uid);
        let before = before.or_else(|| registration.as_ref().map(|r| r.source_frame_uid.clone()));
        let (ahead, not_usable) = (None, *not_usable);
        Ok(Self { exported, ahead, registration, anonymiser, before, patient, not_usable })
    }

    /// What is known before the CT is exported; `before` is the series as it was read.
    pub(crate) fn ahead(before: &Source, exported: &ExportSource) -> Self {
        let (ahead, anonymiser) = (Some(exported.source.clone()), exported.anonymiser.clone());
        let patient = Some(before.whose());
        let before = Some(before.frame_of_reference_uid());
        let (exported, registration, not_usable) = (None, None, false);
        Self { exported, ahead, registration, anonymiser, before, patient, not_usable }
    }

    /// The series whose patient an object has to be of.
    fn whose(&self) -> Option<&Source> {
        self.exported.as_ref().map(|(_, source)| source).or(self.ahead.as_ref())
    }

    /// The exported CT, to which a DICOM object will belong.
    pub(crate) fn exported(&self) -> Option<&(Ct, Source)> {
        self.exported.as_ref()
    }

    /// The registration of the exported CT with the one before.
    pub(super) fn registration(&self) -> Option<&ObjectReference> {
        self.registration.as_ref().map(|r| &r.object)
    }

    /// An RT dose that lies on the CT, and what a user has to know of it.
    ///
    /// # Errors
    /// When it cannot be read, or belongs to another CT or patient.
    pub(crate) fn dose(&self, path: &Path) -> Result<(Dose, Vec<Warning>), Error> {
        let dose = read_dose(path).map_err(Error::Carried)?;
        let mut warnings = dose.warnings().to_vec();
        warnings.extend(self.compare(path, &[Drawn::whole(dose.frame_of_reference_uid())])?);
        let Some(source) = self.whose() else { return Ok((dose, warnings)) };
        let dose = dose.for_export(source, self.anonymiser.as_ref()).map_err(Error::Carried)?;
        Ok((dose, warnings))
    }

    /// A structure set that was drawn on the CT, and what a user has to know of it.
    ///
    /// # Errors
    /// As [`Self::dose`].
    pub(crate) fn structures(&self, path: &Path) -> Result<(Structures, Vec<Warning>), Error> {
        let structures = read_structures(path).map_err(Error::Carried)?;
        let mut warnings = structures.warnings().to_vec();
        warnings.extend(self.compare(path, &Drawn::regions(&structures))?);
        let Some(source) = self.whose() else { return Ok((structures, warnings)) };
        let exported = structures.for_export(source, self.anonymiser.as_ref());
        let (structures, renamed) = exported.map_err(Error::Carried)?;
        warnings.extend(renamed);
        Ok((structures, warnings))
    }

    /// A segmentation on the voxels of the CT, and what a user has to know of it.
    ///
    /// # Errors
    /// As [`Self::dose`]; and when its pixels are no voxels of the CT.
    pub(crate) fn segmentation(
        &self,
        path: &Path,
        grid: &Grid,
    ) -> Result<(Segmentation, Vec<Warning>), Error> {
        let frame = frame_of_reference(path).map_err(Error::Carried)?;
        let mut warnings = self.compare(path, &[Drawn::whole(frame.clone())])?;
        let given = read_segmentation(path, grid, Some(&frame)).map_err(Error::Carried)?;
        warnings.extend(given.warnings().to_vec());
        let Some(source) = self.whose() else { return Ok((given, warnings)) };
        let exported = given.for_export(source, self.anonymiser.as_ref());
        let (given, renamed) = exported.map_err(Error::Carried)?;
        warnings.extend(renamed);
        Ok((given, warnings))
    }

    /// What is carried must be of the patient of the CT and lie in the frame of reference of the
    /// CT, under its own UID or the mapped one. Warnings where that is not known.
    fn compare(&self, path: &Path, drawn: &[Drawn]) -> Result<Vec<Warning>, Error> {
        let (named, mut warnings) = self.compare_patient(path)?;
        let Some(own) = &self.before else {
            warnings.push(Warning::new("frame-not-compared", NOT_COMPARED));
            return Ok(warnings);
        };
        let mapped = |uid: &str| self.anonymiser.as_ref().map(|by| by.uid(uid));
        let same = |uid: &String| {
            uid == own || mapped(uid).as_ref() == Some(own) || mapped(own).as_ref() == Some(uid)
        };
        let other = drawn.iter().find(|one| !one.frame.is_empty() && !same(&one.frame));
        if let Some(Drawn { region, .. }) = other {
            let anonymised = self.whose().is_some_and(Source::is_anonymised);
            return Err(Error::OtherFrame {
                path: path.into(),
                region: region.clone(),
                without_key: anonymised && self.anonymiser.is_none(),
            });
        }
        if drawn.iter().any(|one| one.frame.is_empty()) {
            if !named {
                return Err(Error::Unattributed { path: path.into() });
            }
            warnings.push(Warning::new("frame-missing", NO_FRAME));
        }
        Ok(warnings)
    }

    /// What is carried must be of the patient of the CT. Whether both name a patient, and what is
    /// doubtful of it. Against the Patient ID of an exported CT it is held when it is made ready
    /// for that.
    fn compare_patient(&self, path: &Path) -> Result<(bool, Vec<Warning>), Error> {
        let Some(source) = self.whose() else {
            let compared = self.patient.as_ref().map(|own| compare_patient(path, own));
            let compared = compared.transpose()?.unwrap_or_default();
            return Ok((compared.by_id, compared.warning.into_iter().collect()));
        };
        // A de-identified CT bears a pseudonym, by which it is compared when the object is made
        // ready for it.
        let exported = (!source.is_anonymised()).then(|| source.whose());
        let own = self.patient.as_ref().or(exported.as_ref());
        match own.map(|own| compare_patient(path, own)) {
            Some(Ok(compared)) => Ok((compared.by_id, compared.warning.into_iter().collect())),
            // In these words it is refused when it is made ready.
            Some(Err(Error::OtherPatient { .. })) => Ok((true, vec![])),
            Some(Err(error)) => Err(error),
            None => Ok((names_a_patient(path)?, vec![])),
        }
    }

    /// The headers that an object is written with.
    pub(super) fn source(&self) -> Result<&Source, Error> {
        self.exported.as_ref().map(|(_, source)| source).ok_or(Error::NoSeries)
    }

    /// Series Description of what is carried.
    pub(super) fn description(&self, what: &str) -> String {
        let mark = if self.not_usable { format!("{NOT_USABLE} ") } else { String::new() };
        format!("{mark}DEFORMED {what} [supine]")
    }

    /// What a carried object says about itself, behind `before` others of its kind.
    ///
    /// # Errors
    /// When there is no exported CT.
    pub(super) fn params(&self, what: &str, before: usize) -> Result<CompanionParams, Error> {
        Ok(CompanionParams {
            series_description: self.description(what),
            derivation: format!(
                "DERIVED: {what} carried with the tissue of a simulated deformation, not made anew on \
                 it. The CT:"
            ),
            clock: self.source()?.clock(),
            before,
            software_version: env!("CARGO_PKG_VERSION").into(),
        })
    }
}

//! Doses.

use super::{CarryDone, DicomDose, DoseFacts, Job};
use crate::commands::usage;
use crate::shared::carry::{CarriedDose, carry_with_totals, dose_doubts, max_gy, not_anew};
use crate::{Error, NodeId};
use supine_exchange::write_scalar;
use supine_space::Warning;
use supine_volume::Volume;
use supine_warp::DoseTotals;

const NO_CT: &str = "without --ct (the CT before deformation) the density of the tissue is not known: the total is by \
                     volume only, and beside the skin air cannot be told from tissue: the dose there is carried as it was given";

impl Job<'_> {
    /// A dose of a plain volume, Gy.
    pub(super) fn plain_dose(&self, given: &Volume<f32>) -> Result<CarryDone, Error> {
        if self.to_dicom() {
            return Err(usage(
                "an RT dose (.dcm) names its plan, which a plain volume does not know: carry the RT dose itself, or \
                 name a .nrrd, .nii.gz or .mha file",
            ));
        }
        self.warn_beside(given.grid());
        let ct = self.ct()?;
        let (moved, totals) = self.gather.work(NodeId::Carry, |progress| {
            carry_with_totals(given, ct.as_ref().map(|ct| &ct.ct), &self.deformation, progress)
        })?;
        let notes = std::iter::once(not_anew()).chain(dose_doubts(given, &moved)).collect();
        let carried = moved.carried;
        self.write(&carried)?;
        let told = self.told_dose([given, &carried].map(max_gy), &totals, notes);
        Ok(CarryDone::Dose(Box::new(told)))
    }

    /// A DICOM RT dose.
    pub(super) fn dose(&self) -> Result<CarryDone, Error> {
        let ct = self.ct()?;
        let context = self.context(ct.as_ref())?;
        let out = self.to_dicom().then(|| self.out());
        let done = self.gather.work(NodeId::Carry, |progress| {
            let ct = ct.as_ref().map(|ct| &ct.ct);
            self.with(&context).dose(&self.given.what, out, ct, progress)
        })?;
        if out.is_none() {
            self.write(&done.carried)?;
        }
        let dicom = dicom(&done);
        let told = self.told_dose(done.max_gy(), &done.totals, done.warnings);
        Ok(CarryDone::Dose(Box::new(DoseFacts { dicom, ..told })))
    }

    fn write(&self, carried: &Volume<f32>) -> Result<(), Error> {
        self.gather.work(NodeId::Export, |progress| {
            write_scalar(carried, self.out(), progress).map_err(Error::product)
        })
    }

    fn told_dose(
        &self,
        max_gy: [f64; 2],
        totals: &DoseTotals,
        mut warnings: Vec<Warning>,
    ) -> DoseFacts {
        if totals.energy_mj.is_none() {
            warnings.insert(1, Warning::new("density-unknown", NO_CT));
        }
        self.gather.warn_all(NodeId::Carry, warnings);
        DoseFacts {
            out: self.out().into(),
            max_gy,
            integral_gy_ml: totals.volume_gy_ml,
            written_gy_ml: totals.written_gy_ml,
            energy_mj: totals.energy_mj,
            mass_g: totals.mass_g,
            density: "1 + HU/1000 g/ml, at least 0",
            dicom: None,
            warnings: self.gather.warnings(),
        }
    }
}

/// What was written as DICOM.
fn dicom(done: &CarriedDose) -> Option<DicomDose> {
    let written = done.written.as_ref()?;
    Some(DicomDose {
        dose_type: done.given.dose_type().to_string(),
        summation: done.given.summation_type().to_string(),
        instance_uid: written.object.instance_uid.clone(),
        series_uid: written.object.series_uid.clone(),
        step_gy: [done.given.step_gy(), written.step_gy],
        read_back_error_gy: written.error_gy,
    })
}

//! The series for the planning system, read back and verified, with its registrations.

use super::import::Imported;
use super::warp::Facts as WarpFacts;
use crate::bench::{Bench, Done, Made};
use crate::outward::Outward;
use crate::store::Store;
use crate::{Case, RunError, Stage, texts, write_registration};
use supine_dicom::{Expected, ExportParams, Source};
use supine_mesh::{Displacement, TetMesh};
use supine_report::{Checks, Export};
use supine_space::Progress;
use supine_volume::Ct;

/// The mesh, and its displacement as the solver gave it.
type Map<'a> = (&'a TetMesh, &'a Displacement);
pub(crate) type Exported = Done<(), Option<Export>>;

pub(crate) fn export(
    bench: &mut Bench<'_>,
    case: &Case,
    (input, map): (&Imported, Map<'_>),
    warped: &Done<Ct, WarpFacts>,
    reach_mm: f64,
) -> Result<Exported, RunError> {
    bench.stage(
        Stage::Export,
        &[
            &warped.key,
            &texts::derivation(case),
            &texts::series_description(case),
            &format!("{:?}", case.export),
        ],
        |_, _| Ok(()),
        |store, progress| match &input.outward {
            Some(outward) => {
                let series = Series { case, outward, warped, reach_mm };
                let mut made = series.write(store, progress.part(0.0, 0.7))?;
                if let (true, Some(export)) = (case.export.registration, &mut made.facts) {
                    let [exported, folder] = ["ct", "registration"].map(|name| store.path(name));
                    let (ct, progress) = (&input.input.ct, progress.part(0.7, 1.0));
                    let between = (&outward.source, exported?);
                    let registration =
                        write_registration(ct.grid(), between, map, &folder?, progress)?;
                    export.registration = Some(registration);
                }
                Ok(made)
            }
            None => without_dicom(case, store, &warped.product, progress),
        },
    )
}

/// A CT that came without DICOM carries no patient: it leaves as it came, as a plain volume.
fn without_dicom(
    case: &Case,
    store: &Store,
    warped: &Ct,
    progress: Progress<'_>,
) -> Result<Made<(), Option<Export>>, RunError> {
    let (path, note) = (store.path("ct.nrrd")?, texts::derivation(case));
    supine_exchange::write_ct_nrrd(warped, &path, &note, progress).map_err(RunError::product)?;
    let warning = "the CT did not come as DICOM, so there is no patient to export a series for: \
                   the deformed CT is ct.nrrd";
    Ok(Made { product: (), facts: None, warnings: vec![warning.into()] })
}

struct Series<'a> {
    case: &'a Case,
    outward: &'a Outward,
    warped: &'a Done<Ct, WarpFacts>,
    /// Largest displacement, mm.
    reach_mm: f64,
}

impl Series<'_> {
    fn write(
        &self,
        store: &Store,
        progress: Progress<'_>,
    ) -> Result<Made<(), Option<Export>>, RunError> {
        let Outward { source, anonymiser } = self.outward;
        let params = ExportParams {
            series_description: texts::series_description(self.case),
            derivation: texts::derivation(self.case),
            image_comments: texts::IMAGE_COMMENTS.into(),
            laterality: self.case.breast,
            clock: source.clock(),
            software_version: env!("CARGO_PKG_VERSION").into(),
            identity: identity(source, self.case),
            reach_mm: self.reach_mm,
            policy: self.case.export.policy,
        };
        let folder = store.path("ct")?;
        let written = supine_dicom::write_series(
            &self.warped.product,
            source,
            &params,
            &folder,
            progress.part(0.0, 0.6),
        )
        .map_err(export_error)?;
        let (ct, progress) = (&self.case.ct, progress.part(0.6, 1.0));
        let (policy, accept) = (params.policy, self.case.accept);
        let expected = Expected { policy, anonymiser: anonymiser.as_ref(), accept };
        let verified = supine_dicom::verify_export(&folder, Some(ct), expected, progress)
            .map_err(export_error)?;
        let passed = verified.checks.iter().filter(|c| c.passed == Some(true)).count();
        let failed = verified.checks.iter().filter(|c| c.passed == Some(false));
        let mut warnings: Vec<String> = written.warnings;
        warnings.extend(failed.map(|c| format!("check {} failed: {}", c.rule, c.detail)));
        let export = Export {
            folder: "ct".into(),
            files: written.files.len(),
            series_description: params.series_description,
            series_uid: written.series_uid,
            frame_of_reference_uid: written.frame_of_reference_uid,
            verified: Checks { passed, total: verified.checks.len() },
            registration: None,
        };
        Ok(Made { product: (), facts: Some(export), warnings })
    }
}

fn export_error(error: supine_dicom::Error) -> RunError {
    match error {
        supine_dicom::Error::Stopped(_) => RunError::Stopped,
        other => RunError::Export(other),
    }
}

/// What made the volume, beside its voxels: two cases never share an identifier.
fn identity(source: &Source, case: &Case) -> [u8; 32] {
    let parts = [source.series_uid(), texts::derivation(case)];
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(part.as_bytes()).update(b"\0");
    }
    *hasher.finalize().as_bytes()
}

//! The series for the planning system, read back and verified.

use super::{Fit, Import, Solve, Source, Warp};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::shared::{IMAGE_COMMENTS, derivation, series_description};
use crate::spec::Case;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;
use supine_dicom::{Accept, Expected, ExportParams, Original, Policy};
use supine_report::{Checks, TissueFit};
use supine_space::{Side, Warning};
use supine_volume::Ct;

pub(crate) struct Export;

#[derive(Serialize, Clone)]
pub(crate) struct NodeInputs {
    /// For the texts that name a modulus which is known later.
    #[serde(skip)]
    typed: Arc<Case>,
    derivation: String,
    series_description: String,
    left: bool,
    new_study: bool,
    keep_equipment: bool,
    same_frame: bool,
    clip_padding: bool,
    ct: InputFile,
    assume_hu: bool,
    equalise_steps: bool,
    /// Where the case names one; that of the run does not make a result stale.
    #[serde(skip_serializing_if = "Option::is_none")]
    clock: Option<String>,
}

impl NodeInputs {
    /// With the texts of the modulus that was fitted.
    fn fitted(&self, fit: Option<&TissueFit>) -> Result<Self, Error> {
        let Some(fit) = fit else { return Ok(self.clone()) };
        let case = self.typed.fitted(fit);
        let (derivation, series_description) = (derivation(&case)?, series_description(&case)?);
        Ok(Self { derivation, series_description, ..self.clone() })
    }
}

/// What was exported.
#[derive(Debug)]
pub(crate) struct Exported {
    /// The folder of the series; none when the CT did not come as DICOM.
    pub(crate) series: Option<PathBuf>,
    pub(crate) facts: Facts,
}

#[derive(Serialize, Deserialize, Clone, Debug)]
pub(crate) struct Facts {
    /// Short name of the result.
    pub(crate) id: String,
    pub(crate) export: Option<supine_report::Export>,
}

impl Node for Export {
    const ID: NodeId = NodeId::Export;
    const METHOD: u32 = 2;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Source, Fit, Solve, Warp);
    type Out = Exported;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let Policy { new_study, keep_equipment, same_frame, clip_padding } = case.export.policy;
        Ok(NodeInputs {
            typed: Arc::clone(case),
            derivation: derivation(case)?,
            series_description: series_description(case)?,
            left: case.breast()? == Side::Left,
            new_study,
            keep_equipment,
            same_frame,
            clip_padding,
            ct: case_state.file("ct", case.ct()?)?,
            assume_hu: case.accept.assume_hu,
            equalise_steps: case.accept.equalise_steps,
            clock: case.export.clock.as_ref().map(ToString::to_string),
        })
    }

    fn run(
        inputs: &NodeInputs,
        (input, named, fit, solved, warped): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Exported, Error> {
        let inputs = &inputs.fitted(fit.tissue())?;
        let series_uid = named.as_ref().as_ref().map(|named| named.source.series_uid());
        let identity = identity(series_uid.as_deref(), &inputs.derivation, &warped.ct);
        let id = format!("{:02x}{:02x}", identity[2], identity[3]);
        let Some(named) = named.as_ref() else {
            let path = work.place("volume")?;
            supine_exchange::write_ct_nrrd(&warped.ct, &path, &inputs.derivation, work.progress)
                .map_err(Error::product)?;
            let text = "the CT did not come as DICOM, so there is no patient to export a series for: \
                        the deformed CT is ct.nrrd";
            work.warn(Warning::new("no-series", text));
            return Ok(Exported { series: None, facts: Facts { id, export: None } });
        };
        let source = &named.source;
        let policy = inputs.policy();
        let params = ExportParams {
            series_description: format!("{} {id}", inputs.series_description),
            derivation: inputs.derivation.clone(),
            image_comments: IMAGE_COMMENTS.into(),
            laterality: if inputs.left { Side::Left } else { Side::Right },
            clock: work.clock_of(inputs.clock.as_deref(), named),
            software_version: env!("CARGO_PKG_VERSION").into(),
            identity,
            reach_mm: solved.facts.solve.max_displacement_mm,
            policy,
        };
        let folder = work.place("series")?;
        let (write, verify) = (work.progress.part(0.0, 0.6), work.progress.part(0.6, 1.0));
        let written = supine_dicom::write_series(&warped.ct, source, &params, &folder, write)
            .map_err(export_error)?;
        let accept = Accept { assume_hu: inputs.assume_hu, equalise_steps: inputs.equalise_steps };
        let expected = Expected { policy, anonymiser: named.anonymiser.as_ref(), accept };
        let read = |source| Original::Read { ct: &input.ct, source };
        let original = input.source.as_ref().map(read);
        let verified = supine_dicom::verify_export(&folder, original, expected, verify)
            .map_err(export_error)?;
        work.warn_all(written.warnings);
        let failed = verified.checks.iter().filter(|c| c.passed == Some(false));
        work.warn_all(failed.map(|c| {
            Warning::new("check-failed", format!("check {} failed: {}", c.rule, c.detail))
        }));
        let export = supine_report::Export {
            folder: "ct".into(),
            files: written.files.len(),
            series_description: params.series_description,
            series_uid: written.series_uid,
            frame_of_reference_uid: written.frame_of_reference_uid,
            verified: Checks {
                passed: verified.checks.iter().filter(|c| c.passed == Some(true)).count(),
                // One that cannot be made has not failed.
                total: verified.checks.iter().filter(|c| c.passed.is_some()).count(),
            },
            registration: None,
        };
        Ok(Exported { series: Some(folder), facts: Facts { id, export: Some(export) } })
    }

    fn facts(out: &Exported) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Exported, Error> {
        let facts: Facts = serde_json::from_value(facts)?;
        let series = facts.export.as_ref().map(|_| work.place("series")).transpose()?;
        Ok(Exported { series, facts })
    }
}

impl NodeInputs {
    fn policy(&self) -> Policy {
        let Self { new_study, keep_equipment, same_frame, clip_padding, .. } = *self;
        Policy { new_study, keep_equipment, same_frame, clip_padding }
    }
}

fn export_error(error: supine_dicom::Error) -> Error {
    match error {
        supine_dicom::Error::Stopped(_) => Error::Stopped,
        other => Error::Export(other),
    }
}

/// Hash of the volume and of what made it: two results never share an identifier.
fn identity(series_uid: Option<&str>, derivation: &str, ct: &Ct) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for part in [series_uid.unwrap_or(""), derivation] {
        hasher.update(part.as_bytes()).update(b"\0");
    }
    for part in ct.data().chunks(1 << 16) {
        let bytes: Vec<u8> = part.iter().flat_map(|hu| hu.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
    *hasher.finalize().as_bytes()
}

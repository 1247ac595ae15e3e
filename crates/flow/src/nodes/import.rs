//! The CT.

use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::shared::{CtInput, read_ct};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_dicom::{Accept, ReadInfo, ReadParams, Source};
use supine_report::{CtFacts, LeftOut};
use supine_space::{Posture, Warning};
use supine_volume::{Ct, Field};

pub(crate) struct Import;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    ct: InputFile,
    series: Option<String>,
    exclude: Vec<String>,
    assume_hu: bool,
    equalise_steps: bool,
    #[serde(skip_serializing_if = "Taken::is_supine")]
    position: Taken,
}

/// How the patient is taken to lie, by the name that case files give it.
#[derive(Serialize, Clone, Copy, Debug)]
pub(crate) struct Taken(&'static str);

impl Taken {
    pub(crate) fn of(posture: Posture) -> Self {
        Self(posture.name())
    }

    /// Whether it is the posture without which nothing was said before.
    pub(crate) fn is_supine(&self) -> bool {
        self.posture() == Posture::Supine
    }

    /// What is said of a posture that a CT does not tell.
    fn unchecked(self) -> Option<Warning> {
        let text = "the patient is taken to be upright: nothing in the CT tells whether she was";
        let upright = self.posture() == Posture::Upright;
        upright.then(|| Warning::new("posture-unchecked", text))
    }

    pub(crate) fn posture(self) -> Posture {
        Posture::named(self.0).unwrap_or_default()
    }
}

/// The CT as it was read.
#[derive(Debug)]
pub(crate) struct Imported {
    /// HU.
    pub(crate) ct: Arc<Ct>,
    /// What was measured of it.
    pub(crate) field: Field,
    /// The series it came from; `None` for NRRD and NIfTI, which carry no patient.
    pub(crate) source: Option<Source>,
    pub(crate) facts: CtFacts,
    /// The files it came from.
    pub(crate) origin: supine_report::Input,
}

impl Imported {
    /// A CT that is given in place of being read.
    pub(crate) fn given(ct: Arc<Ct>, origin: supine_report::Input) -> Self {
        let (field, facts) = (Field::found(&ct), facts(&ct, None));
        Self { ct, field, source: None, facts, origin }
    }
}

impl Node for Import {
    const ID: NodeId = NodeId::Import;
    const METHOD: u32 = 5;
    const KEPT: bool = false;
    type NodeInputs = NodeInputs;
    type Parents = ();
    type Out = Imported;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let Accept { assume_hu, equalise_steps } = case.accept;
        let (ct, series) = (case_state.file("ct", case.ct()?)?, case.series.clone());
        let exclude = case.exclude.clone();
        Ok(NodeInputs {
            ct,
            series,
            exclude,
            assume_hu,
            equalise_steps,
            position: Taken::of(case.position),
        })
    }

    fn run(inputs: &NodeInputs, (): Outs<Self>, work: &Work<'_>) -> Result<Imported, Error> {
        let accept = Accept { assume_hu: inputs.assume_hu, equalise_steps: inputs.equalise_steps };
        let (series, exclude) = (inputs.series.clone(), inputs.exclude.clone());
        let params = ReadParams { series, exclude, accept };
        let read = read_ct(&inputs.ct.path, &params, work.progress)?;
        inputs.ct.check_unchanged()?;
        let read = read.not_deformed(&inputs.ct.path)?.in_hu()?;
        let field = read.field();
        let CtInput { ct, dicom, warnings, .. } = read;
        let (source, info) = dicom.unzip();
        let position = info.as_ref().map_or("", |info| info.patient_position.as_str());
        if let Some(why) = supine_dicom::lay_otherwise(position, inputs.position.posture()) {
            return Err(Error::LayOtherwise { path: inputs.ct.path.clone(), why });
        }
        work.warn_all(warnings.into_iter().chain(inputs.position.unchecked()));
        let facts = facts(&ct, info.as_ref());
        Ok(Imported { ct: Arc::new(ct), field, source, facts, origin: inputs.ct.told("ct") })
    }

    fn bytes(out: &Imported) -> usize {
        2 * out.ct.grid().len()
    }
}

fn facts(ct: &Ct, info: Option<&ReadInfo>) -> CtFacts {
    let grid = ct.grid();
    let left_out = info.into_iter().flat_map(|info| &info.left_out);
    CtFacts {
        size: grid.size(),
        spacing_mm: grid.spacing().into(),
        origin_mm: grid.origin().coords.into(),
        slices: grid.size()[2],
        patient_position: info.map(|i| i.patient_position.clone()).unwrap_or_default(),
        left_out: left_out
            .map(|l| LeftOut { file: l.file.clone(), reason: l.reason.to_string() })
            .collect(),
    }
}

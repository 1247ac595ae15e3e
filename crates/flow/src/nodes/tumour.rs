//! The tumour, held against the CT before the long work is done: drawn on this very scan, in
//! tissue, in the half of the body that the case names.

use super::Import;
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::shared::{PlacedTumour, of_the_ct, of_the_patient};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use supine_report::SphereRecord;
use supine_segment::tumour_place;
use supine_space::{Side, Warning};

pub(crate) struct Tumour;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    left: bool,
    tumour: SphereRecord,
    /// The structure set that it came from, and the frame of reference of its region.
    drawn: Option<(InputFile, String)>,
    /// What is odd about how it was drawn; the file tells it too.
    #[serde(skip)]
    warnings: Vec<Warning>,
}

/// What the CT shows at its place.
#[derive(Serialize, Deserialize, Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Mean about its centre, HU.
    pub(crate) mean_hu: f64,
}

impl Node for Tumour {
    const ID: NodeId = NodeId::Tumour;
    const METHOD: u32 = 4;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import,);
    type Out = Placed;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let left = case_state.case.breast()? == Side::Left;
        let PlacedTumour { sphere, drawn, warnings } = case_state.tumour()?;
        Ok(NodeInputs { left, tumour: sphere.into(), drawn, warnings })
    }

    fn run(inputs: &NodeInputs, (input,): Outs<Self>, work: &Work<'_>) -> Result<Placed, Error> {
        if let Some((file, frame)) = &inputs.drawn {
            work.warn_all(of_the_patient(&file.path, input.source.as_ref())?);
            work.warn_all(of_the_ct(frame, input.source.as_ref())?);
        }
        work.warn_all(inputs.warnings.iter().cloned());
        let side = if inputs.left { Side::Left } else { Side::Right };
        let placed = tumour_place(&input.ct, inputs.tumour.sphere()?, Some(side))?;
        Ok(Placed { mean_hu: placed.mean_hu })
    }

    fn facts(out: &Placed) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Placed, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

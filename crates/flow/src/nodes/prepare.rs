//! The CT made ready for the segmentation: all of it that no seed changes.

use super::import::Taken;
use super::{Import, Imported};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_segment::{Params, Segmenter};

pub(crate) struct Prepare;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    /// Labels that are supplied need nothing.
    needed: bool,
    #[serde(skip_serializing_if = "Taken::is_supine")]
    position: Taken,
}

/// What finds the labels.
#[derive(Debug)]
pub(crate) struct Prepared {
    /// None where labels are supplied.
    pub(crate) segmenter: Option<Arc<Segmenter>>,
}

/// Memory of what is held for each voxel of the CT, bytes: the CT with less noise, what is known of
/// each voxel, and what the search for the wall needs.
const PER_VOXEL: usize = 7;

impl Node for Prepare {
    const ID: NodeId = NodeId::Prepare;
    const METHOD: u32 = 2;
    const KEPT: bool = false;
    type NodeInputs = NodeInputs;
    type Parents = (Import,);
    type Out = Prepared;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        Ok(NodeInputs { needed: case.labels.is_none(), position: Taken::of(case.position) })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Prepared> {
        (!inputs.needed).then_some(Prepared { segmenter: None })
    }

    fn run(inputs: &NodeInputs, (input,): Outs<Self>, work: &Work<'_>) -> Result<Prepared, Error> {
        let Imported { ct, field, .. } = &*input;
        let params = Params { posture: inputs.position.posture(), ..Params::default() };
        let segmenter = Segmenter::new(Arc::clone(ct), field, &params, work.progress)?;
        Ok(Prepared { segmenter: Some(Arc::new(segmenter)) })
    }

    fn bytes(out: &Prepared) -> usize {
        out.segmenter.as_ref().map_or(0, |segmenter| PER_VOXEL * segmenter.voxels())
    }
}

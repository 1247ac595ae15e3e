//! The labels as a DICOM segmentation of the CT they belong to.

use super::{Segment, Source};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::shared::write_dicom_labels;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;

pub(crate) struct LabelsObject;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    /// Where the case names one.
    clock: Option<String>,
}

impl Node for LabelsObject {
    const ID: NodeId = NodeId::LabelsObject;
    const METHOD: u32 = 3;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Source, Segment);
    type Out = ();

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let clock = case_state.case.export.clock.as_ref();
        Ok(NodeInputs { clock: clock.map(ToString::to_string) })
    }

    fn run(
        inputs: &NodeInputs,
        (named, segmented): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<(), Error> {
        let Some(named) = named.as_ref() else { return Ok(()) };
        let path = work.place("labels")?;
        let clock = work.clock_of(inputs.clock.as_deref(), named);
        write_dicom_labels(&segmented.labels, (&named.source, clock), segmented.facts.origin, &path)
    }

    fn load(_: serde_json::Value, _: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }
}

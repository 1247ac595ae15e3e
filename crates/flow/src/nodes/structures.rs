//! Body, chest wall, breast and tumour on the exported series, as a structure set: what a planning
//! system begins with.

use super::{Export, Import, Segment, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::shared::{OwnRegions, write_own_regions};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use supine_report::SphereRecord;

pub(crate) struct Structures;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    tumour: SphereRecord,
    asked: bool,
}

impl Node for Structures {
    const ID: NodeId = NodeId::Structures;
    const METHOD: u32 = 3;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Segment, Solve, Export);
    type Out = ();

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        Ok(NodeInputs {
            tumour: case_state.tumour()?.sphere.into(),
            asked: case_state.case.export.structures,
        })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<()> {
        (!inputs.asked).then_some(())
    }

    fn run(
        inputs: &NodeInputs,
        (input, segmented, solved, exported): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<(), Error> {
        let Some(series) = &exported.series else { return Ok(()) };
        let regions = OwnRegions {
            ct: &input.ct,
            labels: &segmented.labels,
            deformation: &solved.deformation,
            tumour: inputs.tumour.sphere()?,
        };
        let warnings =
            write_own_regions(&regions, series, &work.place("structures")?, work.progress)?;
        work.warn_all(warnings);
        Ok(())
    }

    fn load(_: serde_json::Value, _: &Work<'_>) -> Result<(), Error> {
        Ok(())
    }
}

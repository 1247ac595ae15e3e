//! Registrations of the exported series with the CT, when the case asks for them.

use super::{Export, Fields, Import, Solve, Source};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::shared::{RegisteredSeries, write_registration};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

pub(crate) struct Registration;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    asked: bool,
}

/// What was written.
#[derive(Debug, Default)]
pub(crate) struct Registered {
    /// The deformable registration.
    pub(crate) deformable: Option<PathBuf>,
    pub(crate) facts: Option<supine_report::Registration>,
}

impl Node for Registration {
    const ID: NodeId = NodeId::Registration;
    const METHOD: u32 = 5;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Source, Solve, Export, Fields);
    type Out = Registered;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        Ok(NodeInputs { asked: case_state.case.export.registration })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Registered> {
        (!inputs.asked).then(Registered::default)
    }

    fn run(
        _: &NodeInputs,
        (input, named, solved, exported, fields): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Registered, Error> {
        let (Some(named), Some(series)) = (named.as_ref(), &exported.series) else {
            return Ok(Registered::default());
        };
        let (ct, progress) = (input.ct.grid(), work.progress);
        let between = RegisteredSeries { ct, source: &named.source, exported: series };
        let deformation = &solved.deformation;
        let map = match fields.held() {
            Some(held) => held,
            // As the node of the fields makes them: what is said of the vectors is the same whoever
            // made them.
            None => {
                let params = supine_warp::Params::default();
                let part = progress.part(0.0, 0.5);
                Arc::new(supine_warp::moving_part(ct, deformation, &params, part)?)
            }
        };
        let part = progress.part(0.5, 1.0);
        let facts = work.fill("registrations", |folder| {
            write_registration(&between, deformation, &map.fields, folder, part)
        })?;
        let folder = work.place("registrations")?;
        Ok(Registered { deformable: Some(deformable(&folder)), facts: Some(facts) })
    }

    fn facts(out: &Registered) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.facts)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Registered, Error> {
        let facts: Option<supine_report::Registration> = serde_json::from_value(facts)?;
        let folder = facts.as_ref().map(|_| work.place("registrations")).transpose()?;
        Ok(Registered { deformable: folder.as_deref().map(deformable), facts })
    }
}

fn deformable(folder: &std::path::Path) -> PathBuf {
    folder.join(crate::shared::DEFORMABLE)
}

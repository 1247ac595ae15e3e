//! The patient's own doses, structures and segmentations, held against the CT before the long work
//! is done.

use super::{Import, Source};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::shared::CarriedKind;
use crate::shared::carry::{CarryContext, GivenObject};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;

pub(crate) struct Objects;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    objects: Vec<(CarriedKind, InputFile)>,
}

/// The objects that a case names, with what they hold.
pub(crate) fn named(case_state: &CaseState) -> Result<Vec<(CarriedKind, InputFile)>, Error> {
    let one = |file: &crate::shared::CarriedFile| {
        Ok((file.kind, case_state.file(file.kind.key(), &file.path)?))
    };
    case_state.case.carried.iter().map(one).collect()
}

impl Node for Objects {
    const ID: NodeId = NodeId::Objects;
    const METHOD: u32 = 2;
    const KEPT: bool = false;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Source);
    /// In the order of the case.
    type Out = Vec<GivenObject>;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        Ok(NodeInputs { objects: named(case_state)? })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Vec<GivenObject>> {
        inputs.objects.is_empty().then(Vec::new)
    }

    fn run(
        inputs: &NodeInputs,
        (input, export_source): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Vec<GivenObject>, Error> {
        let (Some(source), Some(named)) = (&input.source, export_source.as_ref()) else {
            return Err(Error::NoSeries);
        };
        let context = CarryContext::ahead(source, named);
        let all = inputs.objects.len() as f64;
        let read = inputs.objects.iter().enumerate().map(|(n, (kind, file))| {
            work.progress.at(n as f64 / all)?;
            let object = GivenObject::read(*kind, &file.path, &context, input.ct.grid())?;
            file.check_unchanged()?;
            Ok(object)
        });
        read.collect()
    }

    fn bytes(out: &Vec<GivenObject>) -> usize {
        out.iter().map(GivenObject::bytes).sum()
    }
}

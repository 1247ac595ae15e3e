//! The patient's own doses, structures and segmentations where the tissue carries them.

use super::{Import, Objects, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::objects::named;
use crate::shared::carry::{MovedObject, histograms};
use crate::work::Work;
use crate::{Error, NodeId};
use supine_report::DoseVolumeHistogram;
use supine_space::Warning;

pub(crate) struct MovedObjects;

/// What was moved, in the order of the case, and the doses of the structures before and after.
#[derive(Debug, Default)]
pub(crate) struct Moved {
    pub(crate) objects: Vec<MovedObject>,
    pub(crate) histograms: Vec<DoseVolumeHistogram>,
    /// Of the histograms.
    pub(crate) warnings: Vec<Warning>,
}

impl Node for MovedObjects {
    const ID: NodeId = NodeId::MovedObjects;
    const METHOD: u32 = 3;
    const KEPT: bool = false;
    /// Whether there are none.
    type NodeInputs = bool;
    type Parents = (Import, Objects, Solve);
    type Out = Moved;

    fn inputs(case_state: &CaseState) -> Result<bool, Error> {
        Ok(named(case_state)?.is_empty())
    }

    fn not_asked(none: &bool) -> Option<Moved> {
        none.then(Moved::default)
    }

    fn run(_: &bool, (input, given, solved): Outs<Self>, work: &Work<'_>) -> Result<Moved, Error> {
        let mut moved = Moved::default();
        let share = |n: usize| 0.9 * n as f64 / given.len() as f64;
        for (n, object) in given.iter().enumerate() {
            let part = work.progress.part(share(n), share(n + 1));
            moved.objects.push(object.moved(&input.ct, &solved.deformation, part)?);
        }
        let part = work.progress.part(0.9, 1.0);
        (moved.histograms, moved.warnings) =
            histograms(&given, &moved.objects, input.ct.grid(), part)?;
        Ok(moved)
    }

    fn bytes(out: &Moved) -> usize {
        out.objects.iter().map(MovedObject::bytes).sum()
    }
}

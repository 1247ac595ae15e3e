//! The map as fields on the voxels of the CT that it moves, both ways, and its Jacobian.

use super::{Import, Imported, Solve, Solved};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use std::sync::{Arc, Mutex};
use supine_exchange::{FieldKind, write_field, write_scalar, write_transform};
use supine_report::Consistency;
use supine_space::Progress;
use supine_warp::MovingPart;

pub(crate) struct Fields;

/// How well the fields undo each other, and the fields themselves until they are written.
#[derive(Debug)]
pub(crate) struct FieldsOut {
    pub(crate) consistency: Option<Consistency>,
    map: Mutex<Option<Arc<MovingPart>>>,
}

impl FieldsOut {
    /// The fields while they are in memory.
    pub(crate) fn held(&self) -> Option<Arc<MovingPart>> {
        self.map.lock().ok()?.clone()
    }
}

impl Fields {
    /// The fields of a displacement on the grid of the CT.
    pub(crate) fn map(
        input: &Imported,
        solved: &Solved,
        progress: Progress<'_>,
    ) -> Result<MovingPart, Error> {
        let (grid, params) = (input.ct.grid(), supine_warp::Params::default());
        Ok(supine_warp::moving_part(grid, &solved.deformation, &params, progress)?)
    }
}

impl Node for Fields {
    const ID: NodeId = NodeId::Fields;
    const METHOD: u32 = 3;
    const KEPT: bool = true;
    type NodeInputs = ();
    type Parents = (Import, Solve);
    type Out = FieldsOut;

    fn inputs(_: &CaseState) -> Result<(), Error> {
        Ok(())
    }

    fn run((): &(), (input, solved): Outs<Self>, work: &Work<'_>) -> Result<FieldsOut, Error> {
        let progress = work.progress;
        let map = Self::map(&input, &solved, progress.part(0.0, 0.9))?;
        // Of the map itself: beyond its mesh the vectors that resample lead to air, not back.
        let consistency = supine_warp::consistency(&map.fields);
        progress.at(1.0)?;
        Ok(FieldsOut { consistency, map: Mutex::new(Some(Arc::new(map))) })
    }

    fn save(out: &FieldsOut, work: &Work<'_>) -> Result<(), Error> {
        let Some(map) = out.held() else { return Ok(()) };
        let none = Progress::none();
        let backward = || {
            let (path, transform) = (work.place("deformed_to_ct")?, work.place("transform")?);
            write_field(&map.resampling, &path, FieldKind::Resampling, none)
                .and_then(|()| write_transform(&map.resampling, &transform, none))
                .map_err(Error::product)
        };
        let forward = || {
            let path = work.place("ct_to_deformed")?;
            write_field(&map.points, &path, FieldKind::Modeling, none).map_err(Error::product)?;
            write_scalar(map.fields.jacobian(), &work.place("jacobian")?, none)
                .map_err(Error::product)
        };
        // Each is compressed by one thread.
        let (backward, forward) = rayon::join(backward, forward);
        backward.and(forward)
    }

    fn facts(out: &FieldsOut) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out.consistency)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<FieldsOut, Error> {
        Ok(FieldsOut { consistency: serde_json::from_value(facts)?, map: Mutex::new(None) })
    }

    fn bytes(out: &FieldsOut) -> usize {
        // Four fields of three single numbers, and one of one.
        out.held().map_or(0, |map| 52 * map.resampling.grid().len())
    }
}

//! The map as fields on the grid of the CT, both ways, and its Jacobian.

use super::{Import, Solve};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::work::Work;
use crate::{Error, NodeId};
use std::sync::{Arc, Mutex};
use supine_exchange::{FieldKind, write_field, write_scalar};
use supine_report::Consistency;
use supine_space::Progress;

pub(crate) struct Fields;

/// How well the fields undo each other, and the fields themselves until they are written.
#[derive(Debug)]
pub(crate) struct FieldsOut {
    pub(crate) consistency: Option<Consistency>,
    fields: Mutex<Option<Arc<supine_warp::Fields>>>,
}

impl FieldsOut {
    /// The fields while they are in memory.
    pub(crate) fn held(&self) -> Option<Arc<supine_warp::Fields>> {
        self.fields.lock().ok()?.clone()
    }
}

impl Node for Fields {
    const ID: NodeId = NodeId::Fields;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type Own = ();
    type Parents = (Import, Solve);
    type Out = FieldsOut;

    fn own(_: &Ground) -> Result<(), Error> {
        Ok(())
    }

    fn run((): &(), (input, solved): Outs<Self>, work: &Work<'_>) -> Result<FieldsOut, Error> {
        let (deformation, progress) = (&solved.deformation, work.progress);
        let params = supine_warp::Params::default();
        let fields =
            supine_warp::fields(input.ct.grid(), deformation, &params, progress.part(0.0, 0.7))?;
        let consistency = supine_warp::consistency(&fields).map(|c| Consistency {
            voxels: c.voxels,
            mean_mm: c.mean_mm,
            p99_mm: c.p99_mm,
            max_mm: c.max_mm,
        });
        progress.at(1.0)?;
        Ok(FieldsOut { consistency, fields: Mutex::new(Some(Arc::new(fields))) })
    }

    fn save(out: &FieldsOut, work: &Work<'_>) -> Result<(), Error> {
        let Some(fields) = out.held() else { return Ok(()) };
        let none = Progress::none();
        let backward = || {
            let path = work.place("deformed_to_ct")?;
            write_field(fields.deformed_to_ct(), &path, FieldKind::Resampling, none)
                .map_err(Error::product)
        };
        let forward = || {
            let path = work.place("ct_to_deformed")?;
            write_field(fields.ct_to_deformed(), &path, FieldKind::Modeling, none)
                .map_err(Error::product)?;
            write_scalar(fields.jacobian(), &work.place("jacobian")?, none).map_err(Error::product)
        };
        // Each is compressed by one thread.
        let (backward, forward) = rayon::join(backward, forward);
        backward.and(forward)
    }

    fn facts(out: &FieldsOut) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(&out.consistency)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<FieldsOut, Error> {
        Ok(FieldsOut { consistency: serde_json::from_value(facts)?, fields: Mutex::new(None) })
    }

    fn bytes(out: &FieldsOut) -> usize {
        // Two fields of three single numbers, and one of one.
        out.held().map_or(0, |fields| 28 * fields.jacobian().grid().len())
    }
}

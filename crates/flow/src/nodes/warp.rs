//! The CT on the table.

use super::{Import, Solve};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::work::Work;
use crate::{Error, NodeId};
use std::sync::Arc;
use supine_report::Jacobian;
use supine_volume::Ct;
use supine_warp::{Info, Interpolation, Params};

pub(crate) struct Warp;

/// The deformed CT.
#[derive(Debug)]
pub(crate) struct Warped {
    /// HU.
    pub(crate) ct: Arc<Ct>,
    pub(crate) facts: supine_report::Warp,
}

impl Node for Warp {
    const ID: NodeId = NodeId::Warp;
    const METHOD: u32 = 1;
    /// Made again in less time than it is read.
    const KEPT: bool = false;
    /// The interpolation.
    type Own = &'static str;
    type Parents = (Import, Solve);
    type Out = Warped;

    fn own(ground: &Ground) -> Result<&'static str, Error> {
        Ok(ground.case.interpolation.name())
    }

    fn run(
        own: &&'static str,
        (input, solved): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Warped, Error> {
        let named = Interpolation::ALL.into_iter().find(|i| i.name() == *own);
        let params = Params { interpolation: named.unwrap_or_default(), ..Params::default() };
        let (ct, info) = supine_warp::warp(&input.ct, &solved.deformation, &params, work.progress)?;
        let facts = warp_facts(&info);
        work.warn_all(info.warnings);
        Ok(Warped { ct: Arc::new(ct), facts })
    }

    fn bytes(out: &Warped) -> usize {
        2 * out.ct.grid().len()
    }
}

/// The warp's part of the summary; how well the fields undo each other is known only to them.
pub(crate) fn warp_facts(info: &Info) -> supine_report::Warp {
    supine_report::Warp {
        fade_mm: info.fade_mm,
        moved_voxels: info.moved_voxels,
        vacated_voxels: info.vacated_voxels,
        folded_voxels: info.folded_voxels,
        jacobian: Jacobian {
            min: info.jacobian_min,
            p01: info.jacobian_p01,
            mean: info.jacobian_mean,
            p99: info.jacobian_p99,
            max: info.jacobian_max,
        },
        forward_then_backward: None,
    }
}

//! The displacement under the table's gravity.

use crate::bench::{Bench, Done, Made};
use crate::{Case, RunError, Stage};
use serde::{Deserialize, Serialize};
use supine_exchange::{read_vtu, write_vtu};
use supine_fem::Body;
use supine_mesh::{Displacement, TetMesh};

/// What is known of the solution beside the displacement.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) solve: supine_report::Solve,
    pub(crate) unknowns: usize,
}

/// Below this an element is squeezed so much that the law is out of its depth.
const SQUEEZED_DET_F: f64 = 0.3;

pub(crate) fn solve(
    bench: &mut Bench<'_>,
    case: &Case,
    mesh: &Done<TetMesh, supine_report::Mesh>,
) -> Result<Done<Displacement, Facts>, RunError> {
    let (params, load) = (case.solver(), case.load());
    let decided = format!("{params:?} {load:?} {:?}", case.tissue);
    bench.stage(
        Stage::Solve,
        &[&mesh.key, &decided],
        |store, _| {
            let path = store.path("mesh/deformed.vtu")?;
            let (_, displacement) = read_vtu(&path).map_err(RunError::Product)?;
            displacement.ok_or(RunError::NoDisplacement { path })
        },
        |store, progress| {
            let (displacement, info) = supine_fem::solve(
                &Body::new(&mesh.product, &case.tissue),
                &load,
                &params,
                progress,
            )?;
            let path = store.path("mesh/deformed.vtu")?;
            write_vtu(&mesh.product, Some(&displacement), &path).map_err(RunError::Product)?;
            let solve = supine_report::Solve {
                iterations: info.iterations,
                indefinite: info.indefinite,
                load_steps: info.load_steps,
                residual: info.residual,
                min_det_f: info.min_det_f,
                max_det_f: info.max_det_f,
                max_displacement_mm: info.max_displacement_mm,
            };
            let mut warnings = info.warnings;
            if info.min_det_f < SQUEEZED_DET_F {
                warnings.push(format!(
                    "an element is squeezed to {:.2} of its volume (below {SQUEEZED_DET_F}): the \
                     tissue law is out of its depth there",
                    info.min_det_f
                ));
            }
            let facts = Facts { solve, unknowns: info.unknowns };
            Ok(Made { product: displacement, facts, warnings })
        },
    )
}

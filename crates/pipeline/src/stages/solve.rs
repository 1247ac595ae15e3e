//! The displacement under the table's gravity.

use super::import::Imported;
use super::mesh::read_curved;
use super::tissues::Labelled;
use crate::bench::{Bench, Done, Made};
use crate::facts::movement;
use crate::moduli::{Map, moduli};
use crate::{Case, RunError, Stage};
use serde::{Deserialize, Serialize};
use supine_exchange::{read_vtu, write_vtu};
use supine_fem::{Body, between};
use supine_mesh::{Displacement, TetMesh};
use supine_report::{Moduli, ModulusInterval, Movement};
use supine_space::Progress;

/// What is known of the solution beside the displacement.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) solve: supine_report::Solve,
    pub(crate) unknowns: usize,
    pub(crate) moduli: Option<Moduli>,
    pub(crate) interval: Option<ModulusInterval>,
}

/// Below this an element is squeezed so much that the law is out of its depth.
const SQUEEZED_DET_F: f64 = 0.3;

pub(crate) fn solve(
    bench: &mut Bench<'_>,
    case: &Case,
    mesh: &Done<TetMesh, supine_report::Mesh>,
    (input, tissues): (&Imported, &Labelled),
) -> Result<Done<Displacement, Facts>, RunError> {
    let (params, load) = (case.solver(), case.load());
    let Case { stiffness, young_interval_kpa, tissue, .. } = case;
    let decided = format!("{params:?} {load:?} {tissue:?} {stiffness:?} {young_interval_kpa:?}");
    let map = if stiffness.is_some() { &tissues.key } else { "" };
    bench.stage(
        Stage::Solve,
        &[&mesh.key, &decided, map],
        |store, _| {
            let path = store.path("mesh/deformed.vtu")?;
            let (_, displacement) = read_vtu(&path).map_err(RunError::Product)?;
            displacement.ok_or(RunError::NoDisplacement { path })
        },
        |store, progress| {
            let by_tissue = by_tissue(case, &mesh.product, input, tissues);
            let (values, told) = by_tissue.unzip();
            let young_kpa = values.as_deref();
            let offsets = read_curved(store, case)?;
            let curved = offsets.as_ref();
            let body = Body { young_kpa, curved, ..Body::new(&mesh.product, &case.tissue) };
            let part = progress.part(0.0, if young_interval_kpa.is_some() { 0.4 } else { 1.0 });
            let (displacement, info) = supine_fem::solve(&body, &load, &params, part)?;
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
            let interval = interval(case, &body, &mut warnings, progress.part(0.4, 1.0))?;
            let facts = Facts { solve, unknowns: info.unknowns, moduli: told, interval };
            Ok(Made { product: displacement, facts, warnings })
        },
    )
}

/// The modulus of each tetrahedron, when the case asks for moduli by tissue.
fn by_tissue(
    case: &Case,
    mesh: &TetMesh,
    input: &Imported,
    tissues: &Labelled,
) -> Option<(Vec<f64>, Moduli)> {
    let (wish, labels, facts) =
        (case.stiffness.as_ref()?, tissues.product.as_ref()?, tissues.facts.as_ref()?);
    let levels_hu = (facts.fat_hu, facts.gland_hu);
    Some(moduli(mesh, &Map { labels, ct: &input.input.ct, levels_hu }, wish))
}

/// Where the tumour comes to at both ends of the case's interval of moduli; a warning and nothing where
/// one of them has no solution.
fn interval(
    case: &Case,
    body: &Body<'_>,
    warnings: &mut Vec<String>,
    progress: Progress<'_>,
) -> Result<Option<ModulusInterval>, RunError> {
    let Some(young_kpa) = case.young_interval_kpa else { return Ok(None) };
    let found = match between(body, &case.load(), &case.solver(), young_kpa, progress) {
        Ok(found) => found,
        Err(stopped @ supine_fem::Error::Stopped(_)) => return Err(stopped.into()),
        Err(error) => {
            let [low, high] = young_kpa;
            warnings.push(format!("no displacement between {low} and {high} kPa: {error}"));
            return Ok(None);
        }
    };
    warnings.extend(found.warnings);
    let centre = case.tumour.centre();
    let end = |u: &Displacement| -> Result<Movement, RunError> {
        let params = supine_warp::Params::default();
        let after = supine_warp::carry_points(body.mesh, u, &params, &[centre])?;
        Ok(movement(centre, after[0]))
    };
    let tumour = [end(&found.low)?, end(&found.high)?];
    Ok(Some(ModulusInterval { young_kpa, tumour, overshoot_mm: found.overshoot_mm }))
}

//! The CT, the fields and the points in the operating position.

use super::import::Imported;
use super::region::Chosen;
use super::solve::Facts as SolveFacts;
use crate::bench::{Bench, Done, Made};
use crate::facts::movement;
use crate::store::{Store, hash_of};
use crate::{Case, RunError, Stage, texts};
use serde::{Deserialize, Serialize};
use supine_exchange::{self as exchange, FieldKind, NamedPoint};
use supine_mesh::{Displacement, TetMesh};
use supine_report::{CarriedPoint, Consistency, Jacobian, Movement};
use supine_space::{Point, Progress};
use supine_volume::Ct;

/// What is known of the warp beside the volume.
#[derive(Serialize, Deserialize, Debug, Clone)]
pub(crate) struct Facts {
    pub(crate) warp: supine_report::Warp,
    pub(crate) tumour: Movement,
    pub(crate) nipple: Option<Movement>,
    pub(crate) points: Vec<CarriedPoint>,
}

/// The stored volume; DICOM is made from it by the export.
const VOLUME: &str = ".stages/warped.nrrd";

pub(crate) fn warp(
    bench: &mut Bench<'_>,
    case: &Case,
    input: &Imported,
    region: &Chosen,
    mesh: &Done<TetMesh, supine_report::Mesh>,
    solved: &Done<Displacement, SolveFacts>,
) -> Result<Done<Ct, Facts>, RunError> {
    let params =
        supine_warp::Params { interpolation: case.interpolation, ..supine_warp::Params::default() };
    let points = points(case, region.nipple)?;
    let decided = format!("{params:?} {points:?}");
    bench.stage(
        Stage::Warp,
        &[&input.key, &solved.key, &decided],
        |store, progress| {
            exchange::read_ct(&store.path(VOLUME)?, progress).map_err(RunError::product)
        },
        |store, progress| {
            let (mesh, field) = (&mesh.product, &solved.product);
            let ct = &input.input.ct;
            let (warped, info) =
                supine_warp::warp(ct, mesh, field, &params, progress.part(0.0, 0.4))?;
            let note = texts::derivation(case);
            exchange::write_ct_nrrd(&warped, &store.path(VOLUME)?, &note, progress.part(0.4, 0.5))
                .map_err(RunError::product)?;
            let undone = write_fields(store, ct, mesh, field, progress.part(0.5, 1.0))?;
            let positions: Vec<_> = points.iter().map(|p| p.position).collect();
            let after = supine_warp::carry_points(mesh, field, &params, &positions)?;
            let facts = facts(case, (&info, undone), &points, &after);
            write_points(store, &points, &after)?;
            let mut warnings = info.warnings;
            warnings.extend(not_carried(&points, &after));
            Ok(Made { product: warped, facts, warnings })
        },
    )
}

/// The tumour, the nipple when it is found, and the points of the case's lists, in this order.
fn points(case: &Case, nipple: Option<Point>) -> Result<Vec<NamedPoint>, RunError> {
    let mut points = vec![NamedPoint { name: "tumour".into(), position: case.tumour.centre() }];
    if let Some(position) = nipple {
        points.push(NamedPoint { name: "nipple".into(), position });
    }
    for path in &case.points {
        hash_of(path).map_err(|source| RunError::Missing {
            role: "`carry.points`",
            path: path.clone(),
            source,
        })?;
        let read = exchange::read_points(path)
            .map_err(|source| RunError::File { role: "`carry.points`", source })?;
        points.extend(read);
    }
    Ok(points)
}

/// Writes the fields; how well they undo each other.
fn write_fields(
    store: &Store,
    ct: &Ct,
    mesh: &TetMesh,
    displacement: &Displacement,
    progress: Progress<'_>,
) -> Result<Option<Consistency>, RunError> {
    let params = supine_warp::Params::default();
    let part = progress.part(0.0, 0.4);
    let fields = supine_warp::fields(ct.grid(), mesh, displacement, &params, part)?;
    let path = |name: &str| store.path(&format!("field/{name}.nrrd"));
    for (field, name, kind, from) in [
        (&fields.deformed_to_ct, "deformed_to_ct", FieldKind::Resampling, 0.4),
        (&fields.ct_to_deformed, "ct_to_deformed", FieldKind::Modeling, 0.65),
    ] {
        exchange::write_field(field, &path(name)?, kind, progress.part(from, from + 0.25))
            .map_err(RunError::product)?;
    }
    exchange::write_scalar(&fields.jacobian, &path("jacobian")?, progress.part(0.9, 1.0))
        .map_err(RunError::product)?;
    Ok(supine_warp::consistency(&fields).map(|c| Consistency {
        voxels: c.voxels,
        mean_mm: c.mean_mm,
        p99_mm: c.p99_mm,
        max_mm: c.max_mm,
    }))
}

fn facts(
    case: &Case,
    (info, undone): (&supine_warp::Info, Option<Consistency>),
    points: &[NamedPoint],
    after: &[Option<Point>],
) -> Facts {
    let moved = |name: &str| {
        let at = points.iter().position(|p| p.name == name)?;
        Some(movement(points[at].position, Some(after[at]?)))
    };
    let own = 1 + usize::from(points.get(1).is_some_and(|p| p.name == "nipple"));
    Facts {
        warp: supine_report::Warp {
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
            forward_then_backward: undone,
        },
        tumour: movement(case.tumour.centre(), after[0]),
        nipple: if own == 2 { moved("nipple") } else { None },
        points: points
            .iter()
            .zip(after)
            .skip(own)
            .map(|(p, after)| CarriedPoint {
                name: p.name.clone(),
                before_mm: p.position.coords.into(),
                after_mm: after.unwrap_or(p.position).coords.into(),
                inside: after.is_some(),
            })
            .collect(),
    }
}

fn write_points(
    store: &Store,
    points: &[NamedPoint],
    after: &[Option<Point>],
) -> Result<(), RunError> {
    let carried: Vec<NamedPoint> = points
        .iter()
        .zip(after)
        .map(|(p, a)| NamedPoint { name: p.name.clone(), position: a.unwrap_or(p.position) })
        .collect();
    exchange::write_points(&carried, &store.path("points.csv")?).map_err(RunError::Product)
}

/// A warning that names the points outside the mesh, which stay where they were.
fn not_carried(points: &[NamedPoint], after: &[Option<Point>]) -> Option<String> {
    let names: Vec<&str> = points
        .iter()
        .zip(after)
        .filter(|(_, a)| a.is_none())
        .map(|(p, _)| p.name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!("outside the modelled tissue and therefore not moved: {}", names.join(", "))
    })
}

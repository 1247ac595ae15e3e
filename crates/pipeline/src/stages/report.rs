//! The report and `summary.json`.

use super::carry::{self, Carried};
use super::export::Exported;
use super::import::Imported;
use super::region::Chosen;
use super::segment::Facts as SegmentFacts;
use super::solve::Facts as SolveFacts;
use super::tissues::Labelled;
use super::warp::Facts as WarpFacts;
use crate::bench::{Bench, Done, Made};
use crate::store::{form, hash_of};
use crate::{Case, RunError, Stage, texts};
use supine_mesh::{Displacement, TetMesh};
use supine_report::{
    Ball, Bed, Input, MeshParameters, Parameters, RegionParameters, Run, Scene, Segmentation,
    Summary, Tissue, Tool,
};
use supine_space::{Point, Sphere};
use supine_volume::{Ct, LabelMap};

/// Everything the stages made.
pub(crate) struct Flow {
    pub(crate) input: Imported,
    pub(crate) labels: Done<LabelMap, SegmentFacts>,
    pub(crate) region: Chosen,
    pub(crate) mesh: Done<TetMesh, supine_report::Mesh>,
    pub(crate) solved: Done<Displacement, SolveFacts>,
    pub(crate) warped: Done<Ct, WarpFacts>,
    pub(crate) export: Exported,
    pub(crate) carried: Carried,
    pub(crate) tissues: Labelled,
}

/// Writes the report, then the summary, which is the last file of a run: where it is, the run is
/// complete.
pub(crate) fn report(mut bench: Bench<'_>, case: &Case, flow: &Flow) -> Result<Summary, RunError> {
    let mut summary = summarise(&bench, case, flow)?;
    let decided = summary.to_json();
    let done = bench.stage(
        Stage::Report,
        &[&flow.export.key, &flow.carried.key, &flow.labels.key, &flow.tissues.key, &decided],
        |_, _| Ok(()),
        |store, progress| {
            let folder = store.path("report")?;
            let (mesh, solved) = (&flow.mesh.product, &flow.solved.product);
            let (faded, _) = supine_warp::fade(mesh, solved, &supine_warp::Params::default())?;
            let scene = scene(case, flow, &faded);
            let volumes = supine_report::volume_changes(&scene, progress.part(0.0, 0.1))?;
            let agreement = supine_report::agreement(&scene);
            let shown = Summary {
                volumes: volumes.clone(),
                agreement: Some(agreement.clone()),
                ..summary.clone()
            };
            let info = supine_report::write(&shown, &scene, &folder, progress.part(0.1, 1.0))?;
            Ok(Made { product: (), facts: (volumes, agreement), warnings: info.warnings })
        },
    )?;
    let (volumes, agreement) = done.facts;
    (summary.volumes, summary.agreement) = (volumes, Some(agreement));
    summary.outputs = bench.store.outputs();
    summary.warnings.clone_from(&bench.warnings);
    let peaks = bench.times.iter().filter_map(|t| t.peak_memory_mb);
    summary.run = Run {
        total_seconds: bench.times.iter().map(|t| t.seconds).sum(),
        peak_memory_mb: peaks.reduce(f64::max),
        threads: rayon::current_num_threads(),
        stages: bench.times,
    };
    supine_report::write_summary(&summary, &bench.store.path("summary.json")?)?;
    Ok(summary)
}

fn scene<'a>(case: &Case, flow: &'a Flow, displacement: &'a Displacement) -> Scene<'a> {
    Scene {
        ct: &flow.input.input.ct,
        deformed: &flow.warped.product,
        labels: &flow.labels.product,
        doubt: flow.region.doubt.as_ref(),
        tissues: flow.tissues.product.as_ref(),
        mesh: &flow.mesh.product,
        displacement,
        sphere: flow.region.sphere,
        tumour: Some(case.tumour),
        tumour_after: Some(Point::from(flow.warped.facts.tumour.after_mm)),
        nipple: flow.region.nipple,
        side: case.breast,
    }
}

/// The summary without what differs from run to run.
fn summarise(bench: &Bench<'_>, case: &Case, flow: &Flow) -> Result<Summary, RunError> {
    let mut mesh = flow.mesh.facts.clone();
    mesh.unknowns = flow.solved.facts.unknowns;
    Ok(Summary {
        tool: Tool { name: "supine".into(), version: env!("CARGO_PKG_VERSION").into() },
        must_not_be_used_for: supine_report::must_not_be_used_for(),
        case: supine_report::Case {
            breast: case.breast.to_string(),
            bed: Bed {
                ap_deg: case.bed.ap_deg,
                lat_deg: case.bed.lat_deg,
                gravity: case.bed.gravity().into(),
            },
            tumour: Some(ball(case.tumour)),
        },
        inputs: inputs(case, flow)?,
        parameters: parameters(case, flow),
        ct: flow.input.facts.clone(),
        segmentation: Segmentation {
            fat_hu: flow.labels.facts.fat_hu,
            muscle_hu: flow.labels.facts.muscle_hu,
            soft_tissue_ml: flow.region.soft_tissue_ml,
            chest_wall_ml: flow.region.chest_wall_ml,
            doubt: flow.region.wall_doubt.clone(),
            gates: flow.labels.facts.gates.iter().chain(&flow.region.gates).cloned().collect(),
            tissues: flow.tissues.facts.clone(),
        },
        mesh,
        solve: flow.solved.facts.solve.clone(),
        warp: flow.warped.facts.warp.clone(),
        volumes: Vec::new(),
        agreement: None,
        tumour: Some(flow.warped.facts.tumour.clone()),
        modulus_interval: flow.solved.facts.interval.clone(),
        nipple: flow.warped.facts.nipple.clone(),
        points: flow.warped.facts.points.clone(),
        carried: flow.carried.facts.clone(),
        export: flow.export.facts.clone(),
        warnings: bench.warnings.clone(),
        outputs: bench.store.outputs().into_iter().filter(|o| o.path != "report").collect(),
        run: Run { stages: vec![], total_seconds: 0.0, peak_memory_mb: None, threads: 0 },
    })
}

fn ball(sphere: Sphere) -> Ball {
    Ball { centre_mm: sphere.centre().coords.into(), radius_mm: sphere.radius() }
}

fn inputs(case: &Case, flow: &Flow) -> Result<Vec<Input>, RunError> {
    let mut inputs = vec![flow.input.origin.clone()];
    inputs.extend(flow.labels.facts.inputs.iter().cloned());
    for path in &case.points {
        let hashed = hash_of(path).map_err(|source| RunError::Missing {
            role: "`carry.points`",
            path: path.clone(),
            source,
        })?;
        inputs.push(Input {
            role: "points".into(),
            form: form(path),
            files: hashed.files,
            blake3: hashed.blake3,
        });
    }
    inputs.extend(carry::inputs(case)?);
    Ok(inputs)
}

fn parameters(case: &Case, flow: &Flow) -> Parameters {
    let region = ball(flow.region.sphere);
    let moduli = flow.solved.facts.moduli.clone();
    Parameters {
        tissue: Tissue {
            young_kpa: moduli.as_ref().map_or(case.tissue.young_kpa, |m| m.mean_kpa),
            moduli,
            poisson: case.tissue.poisson,
            density_kg_m3: case.tissue.density_kg_m3,
            rest: texts::rest_name(case.rest).into(),
            order: case.mesh.order.number(),
            cut: texts::cut_name(case.cut).into(),
        },
        mesh: MeshParameters {
            tetrahedra: case.mesh.tetrahedra,
            mesher: case.mesh.mesher.name().into(),
            refine: case.mesh.refine.name().into(),
        },
        region: RegionParameters {
            centre_mm: region.centre_mm,
            radius_mm: region.radius_mm,
            proposed: flow.region.proposed,
        },
        interpolation: case.interpolation.name().into(),
        fade_mm: flow.warped.facts.warp.fade_mm,
    }
}

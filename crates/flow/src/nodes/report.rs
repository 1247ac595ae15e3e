//! The report and the summary that it shows.

use super::{
    Carry, Export, Fields, Import, Interval, Mesh, Moduli, Points, Region, Registration, Segment,
    Solve, Tissues, Warp,
};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::nodes::region::Ball as OwnBall;
use crate::spec::Case;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_report::{
    Ball, Bed, Input, LeftOut, MeshParameters, Parameters, RegionParameters, Run, Scene,
    Segmentation, Shown, Summary, Tissue, Tool,
};
use supine_space::Point;

pub(crate) struct Report;

#[derive(Serialize)]
pub(crate) struct Own {
    /// The canonical case; of a de-identified run without its paths.
    case: serde_json::Map<String, serde_json::Value>,
    anonymise: bool,
    #[serde(skip)]
    typed: Arc<Case>,
}

/// The summary without what differs from run to run.
pub(crate) type Reported = Summary;

impl Node for Report {
    const ID: NodeId = NodeId::Report;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type Own = Own;
    type Parents = (
        Import,
        Segment,
        Region,
        Tissues,
        Mesh,
        Moduli,
        Solve,
        Interval,
        Warp,
        Export,
        Fields,
        Points,
        Registration,
        Carry,
    );
    type Out = Reported;

    fn own(ground: &Ground) -> Result<Own, Error> {
        let case = &ground.case;
        let anonymise = case.export.anonymise;
        let canonical = if anonymise { without_paths(case) } else { case.canonical() };
        Ok(Own { case: canonical, anonymise, typed: Arc::clone(case) })
    }

    fn run(own: &Own, parents: Outs<Self>, work: &Work<'_>) -> Result<Reported, Error> {
        let mut summary = summarise(own, &parents, work)?;
        let (input, segmented, region, tissues, _, _, solved, _, warped, _, _, points, ..) =
            &parents;
        let params = supine_warp::Params::default();
        let faded = supine_warp::fade(&solved.deformation, &params)?.deformation;
        let scene = Scene {
            ct: &input.ct,
            deformed: &warped.ct,
            labels: &segmented.labels,
            uncertainty: segmented.uncertainty.as_deref(),
            tissues: tissues.labels.as_deref(),
            deformation: &faded,
            sphere: region.sphere()?,
            tumour: own.typed.tumour,
            tumour_after: Some(Point::from(points.tumour.after_mm)),
            nipple: region.nipple(),
            side: own.typed.breast()?,
        };
        let progress = work.progress;
        summary.volumes = supine_report::volume_changes(&scene, progress.part(0.0, 0.1))?;
        summary.agreement = Some(supine_report::agreement(&scene));
        let shown = Shown::from(&summary);
        let pictures = supine_report::draw(&shown, &scene, progress.part(0.1, 0.9))?;
        work.warn_all(pictures.warnings.clone());
        let folder = work.place("report")?;
        supine_report::write(&summary, &pictures, &folder, progress.part(0.9, 1.0))?;
        Ok(summary)
    }

    fn facts(out: &Reported) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Reported, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

/// The canonical case without what names files.
fn without_paths(case: &Case) -> serde_json::Map<String, serde_json::Value> {
    let mut nameless = case.clone();
    nameless.ct = None;
    nameless.series = None;
    nameless.labels = None;
    nameless.seeds.files.clear();
    nameless.points.clear();
    nameless.carried.clear();
    nameless.canonical()
}

/// The summary as far as the nodes before decide it.
fn summarise(own: &Own, parents: &Outs<Report>, work: &Work<'_>) -> Result<Summary, Error> {
    let (
        input,
        segmented,
        region,
        tissues,
        meshed,
        moduli,
        solved,
        interval,
        warped,
        exported,
        fields,
        points,
        registered,
        carried,
    ) = parents;
    let case = &own.typed;
    let mut mesh = meshed.facts.clone();
    mesh.unknowns = solved.facts.unknowns;
    let mut warp = warped.facts.clone();
    warp.forward_then_backward.clone_from(&fields.consistency);
    let mut export = exported.facts.export.clone();
    if let Some(export) = &mut export {
        export.registration.clone_from(&registered.facts);
    }
    let mut ct = input.facts.clone();
    if own.anonymise {
        // Sites name files after patients.
        ct.left_out.iter_mut().enumerate().for_each(|(n, l)| nameless(n, l));
    }
    Ok(Summary {
        schema: Summary::SCHEMA,
        tool: Tool { name: "supine".into(), version: env!("CARGO_PKG_VERSION").into() },
        must_not_be_used_for: supine_report::must_not_be_used_for(),
        case: own.case.clone(),
        position: position(case)?,
        inputs: inputs(&[
            std::slice::from_ref(&input.origin),
            &segmented.facts.inputs,
            &points.inputs,
            &carried.inputs,
        ]),
        parameters: Parameters {
            tissue: tissue(case, moduli.as_ref().as_ref().map(|by| by.facts.clone())),
            mesh: MeshParameters {
                tetrahedra: case.mesh.tetrahedra,
                mesher: case.mesh.mesher.name().into(),
                refine: case.mesh.refine.name().into(),
            },
            region: region_parameters(region)?,
            interpolation: case.interpolation.name().into(),
            fade_mm: warp.fade_mm,
        },
        ct,
        segmentation: Segmentation {
            fat_hu: segmented.facts.fat_hu,
            muscle_hu: segmented.facts.muscle_hu,
            soft_tissue_ml: region.soft_tissue_ml,
            chest_wall_ml: region.chest_wall_ml,
            uncertainty: region.uncertainty.clone(),
            quality_checks: segmented.facts.checks.iter().chain(&region.checks).cloned().collect(),
            tissues: tissues.facts.clone(),
        },
        mesh,
        solve: solved.facts.solve.clone(),
        warp,
        volumes: Vec::new(),
        agreement: None,
        tumour: Some(points.tumour.clone()),
        modulus_interval: interval.as_ref().clone(),
        nipple: points.nipple.clone(),
        points: points.points.clone(),
        carried: carried.objects.clone(),
        export,
        warnings: work.warned.to_vec(),
        outputs: work.written.to_vec(),
        chain: vec![],
        run: Run::default(),
    })
}

fn nameless(n: usize, left_out: &mut LeftOut) {
    left_out.file = format!("file {}", n + 1);
}

fn position(case: &Case) -> Result<supine_report::Position, Error> {
    let bed = case.bed()?;
    Ok(supine_report::Position {
        breast: case.breast()?.to_string(),
        bed: Bed { ap_deg: bed.ap_deg, lat_deg: bed.lat_deg, gravity: bed.gravity().into() },
        tumour: case.tumour.map(|tumour| ball(tumour.into())),
    })
}

fn ball(OwnBall { centre_mm, radius_mm }: OwnBall) -> Ball {
    Ball { centre_mm, radius_mm }
}

fn inputs(all: &[&[Input]]) -> Vec<Input> {
    all.concat()
}

fn tissue(case: &Case, moduli: Option<supine_report::Moduli>) -> Tissue {
    Tissue {
        young_kpa: moduli.as_ref().map_or(case.tissue.young_kpa, |m| m.mean_kpa),
        moduli,
        poisson: case.tissue.poisson,
        density_kg_m3: case.tissue.density_kg_m3,
        rest: crate::shared::rest_name(case.rest).into(),
        order: case.mesh.order.number(),
        cut: crate::shared::cut_name(case.cut).into(),
    }
}

fn region_parameters(region: &super::Chosen) -> Result<RegionParameters, Error> {
    let Ball { centre_mm, radius_mm } = ball(region.sphere()?.into());
    Ok(RegionParameters { centre_mm, radius_mm, proposed: region.proposed })
}

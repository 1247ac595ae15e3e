//! The report and the summary that it shows.

use super::{
    Carry, Evaluation, Export, Fields, Fit, Import, Interval, Moduli, Pictures, Points, Region,
    Registration, Segment, Solve, Structures, Warp,
};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::moduli::ByTissue;
use crate::shared::warning_id;
use crate::spec::Case;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use std::sync::Arc;
use supine_report::{
    Input, LeftOut, MeshParameters, Parameters, RegionParameters, Run, SourceSeries, SphereRecord,
    Summary, TablePosition, Tissue, Tool, Verdict, Warning,
};

pub(crate) struct Report;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    /// The canonical case; of a de-identified run without its paths.
    case: serde_json::Map<String, serde_json::Value>,
    anonymise: bool,
    /// The planner's ticks, which a de-identified case does not hold.
    seen: Vec<String>,
    tumour: SphereRecord,
    #[serde(skip)]
    typed: Arc<Case>,
}

/// The summary without what differs from run to run.
pub(crate) type Reported = Summary;

impl Node for Report {
    const ID: NodeId = NodeId::Report;
    const METHOD: u32 = 23;
    const KEPT: bool = true;
    const WRITES: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (
        Import,
        Segment,
        Region,
        Moduli,
        Fit,
        Solve,
        Interval,
        Warp,
        Export,
        Fields,
        Points,
        Evaluation,
        Registration,
        Structures,
        Carry,
        Pictures,
    );
    type Out = Reported;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let anonymise = case.export.anonymise;
        let canonical = if anonymise { case.nameless() } else { case.canonical().clone() };
        let tumour = case_state.tumour()?.sphere.into();
        let seen = case.names("report.seen");
        Ok(NodeInputs { case: canonical, anonymise, seen, tumour, typed: Arc::clone(case) })
    }

    fn run(inputs: &NodeInputs, parents: Outs<Self>, work: &Work<'_>) -> Result<Reported, Error> {
        let summary = summarise(inputs, &parents, work)?;
        let (.., drawn) = &parents;
        let folder = work.place("report")?;
        let (input, ..) = &parents;
        let whose =
            input.source.as_ref().filter(|_| !inputs.anonymise).map(|source| source.whose());
        let shown = (&summary, whose.as_ref());
        supine_report::write(shown, &drawn.pictures, &folder, work.progress)?;
        Ok(summary)
    }

    fn facts(out: &Reported) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Reported, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

/// The summary as far as the nodes before decide it.
fn summarise(
    inputs: &NodeInputs,
    parents: &Outs<Report>,
    work: &Work<'_>,
) -> Result<Summary, Error> {
    let (
        input,
        segmented,
        region,
        moduli,
        fit,
        solved,
        known,
        warped,
        exported,
        fields,
        points,
        evaluated,
        registered,
        _,
        carried,
        drawn,
    ) = parents;
    let fitted = fit.tissue().map(|fit| inputs.typed.fitted(fit));
    let case = fitted.as_ref().unwrap_or(&inputs.typed);
    let mut warp = warped.facts.clone();
    warp.forward_then_backward.clone_from(&fields.consistency);
    let mut export = exported.facts.export.clone();
    if let Some(export) = &mut export {
        export.registration.clone_from(&registered.facts);
    }
    let mut ct = input.facts.clone();
    if inputs.anonymise {
        // Sites name files after patients.
        ct.left_out.iter_mut().enumerate().for_each(|(n, l)| nameless(n, l));
    }
    let mut summary = Summary {
        schema: Summary::SCHEMA,
        id: Some(exported.facts.id.clone()),
        status: Verdict::default().status(),
        verdict: Verdict::default(),
        tool: Tool { name: "supine".into(), version: env!("CARGO_PKG_VERSION").into() },
        must_not_be_used_for: supine_report::must_not_be_used_for(),
        case: inputs.case.clone(),
        position: position(case, inputs.tumour)?,
        inputs: all_inputs(&[
            std::slice::from_ref(&input.origin),
            &segmented.facts.inputs,
            fit.inputs(),
            &points.inputs,
            &evaluated.inputs,
            &carried.inputs,
        ]),
        parameters: Parameters {
            tissue: tissue(case, fit.moduli().or(moduli.as_ref().as_ref().map(ByTissue::facts))),
            mesh: mesh_parameters(case),
            region: region_parameters(region)?,
            interpolation: case.interpolation.name().into(),
            fade_mm: warp.fade_mm,
        },
        source: input.source.as_ref().filter(|_| !inputs.anonymise).map(source_series),
        ct,
        segmentation: drawn.segmentation.clone(),
        mesh: drawn.mesh.clone(),
        fit: fit.tissue().cloned(),
        solve: solved.facts.solve.clone(),
        warp,
        volumes: drawn.volumes.clone(),
        agreement: Some(drawn.agreement.clone()),
        tumour: Some(points.tumour.clone()),
        tumour_interval: known.interval.clone(),
        evaluation: evaluated.facts.clone(),
        nipple: points.nipple.clone(),
        points: points.points.clone(),
        carried: carried.objects.clone(),
        dose_volume: carried.histograms.clone(),
        export,
        warnings: ticked(work.warned, &inputs.seen),
        outputs: work.written.to_vec(),
        chain: vec![],
        run: Run::default(),
    };
    let verdict = supine_report::verdict(&summary, case.tolerance.mm());
    summary.verdict = Verdict { dose: case.tolerance.dose, ..verdict };
    summary.status = summary.verdict.status();
    Ok(summary)
}

/// Warnings with the planner's ticks.
fn ticked(warned: &[Warning], seen: &[String]) -> Vec<Warning> {
    let tick = |warning: &Warning| Warning {
        seen: seen.contains(&warning_id(warning)),
        ..warning.clone()
    };
    warned.iter().map(tick).collect()
}

fn mesh_parameters(case: &Case) -> MeshParameters {
    MeshParameters {
        tetrahedra: case.mesh.tetrahedra,
        mesher: case.mesh.mesher.name().into(),
        refine: case.mesh.refine.name().into(),
    }
}

fn source_series(source: &supine_dicom::Source) -> SourceSeries {
    SourceSeries {
        study_uid: source.study_uid(),
        series_uid: source.series_uid(),
        frame_of_reference_uid: source.frame_of_reference_uid(),
        instance_uids: source.instance_uids(),
    }
}

fn nameless(n: usize, left_out: &mut LeftOut) {
    left_out.file = format!("file {}", n + 1);
}

fn position(case: &Case, tumour: SphereRecord) -> Result<supine_report::Position, Error> {
    let pose = case.table_pose()?;
    Ok(supine_report::Position {
        breast: case.breast()?.to_string(),
        table: TablePosition {
            ap_deg: pose.ap_deg,
            lat_deg: pose.lat_deg,
            gravity: pose.gravity().into(),
        },
        tumour: Some(tumour),
    })
}

/// Each once: two stages may read one file.
fn all_inputs(all: &[&[Input]]) -> Vec<Input> {
    let mut once: Vec<Input> = Vec::new();
    for input in all.iter().copied().flatten() {
        if !once.contains(input) {
            once.push(input.clone());
        }
    }
    once
}

fn tissue(case: &Case, moduli: Option<&supine_report::Moduli>) -> Tissue {
    let fibred = case.tissue.fibres > 0.0;
    Tissue {
        young_kpa: moduli.map_or(case.tissue.young_kpa, |moduli| moduli.mean_kpa),
        moduli: moduli.cloned(),
        poisson: case.tissue.poisson,
        density_kg_m3: case.tissue.density_kg_m3,
        law: case.tissue.law,
        stiffening: Some(case.tissue.stiffening).filter(|_| !case.tissue.law.is_default()),
        fibres: Some(case.tissue.fibres).filter(|_| fibred),
        fibre_stiffening: Some(case.tissue.fibre_stiffening).filter(|_| fibred),
        fibre_direction: case.tissue.fibre_direction,
        sliding: case.sliding,
        skin: case.skin,
        rest: case.rest,
        order: case.mesh.order.number(),
        cut: case.cut,
    }
}

fn region_parameters(region: &super::Chosen) -> Result<RegionParameters, Error> {
    let SphereRecord { centre_mm, radius_mm } = region.sphere()?.into();
    Ok(RegionParameters { centre_mm, radius_mm, proposed: region.proposed })
}

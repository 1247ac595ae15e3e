//! The pictures of the report, and what is measured on what they show. Nothing that is exported is
//! in them, so that they are drawn while the export is written.

use super::{
    Evaluation, Fit, Import, Interval, Mesh, Points, Region, Segment, Solve, Tissues, Warp,
};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::Serialize;
use supine_report::SphereRecord;
use supine_report::{Agreement, Scene, Segmentation, Shown, VolumeChange};
use supine_space::{Point, Progress, Side};

pub(crate) struct Pictures;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    left: bool,
    tumour: SphereRecord,
}

/// Pictures, and what the summary tells of what they show.
#[derive(Debug)]
pub(crate) struct Drawn {
    pub(crate) pictures: supine_report::Pictures,
    pub(crate) segmentation: Segmentation,
    pub(crate) mesh: supine_report::Mesh,
    pub(crate) volumes: Vec<VolumeChange>,
    pub(crate) agreement: Agreement,
}

impl Node for Pictures {
    const ID: NodeId = NodeId::Pictures;
    const METHOD: u32 = 9;
    const KEPT: bool = false;
    type NodeInputs = NodeInputs;
    type Parents =
        (Import, Segment, Region, Tissues, Mesh, Solve, Warp, Points, Interval, Fit, Evaluation);
    type Out = Drawn;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        Ok(NodeInputs {
            left: case.breast()? == Side::Left,
            tumour: case_state.tumour()?.sphere.into(),
        })
    }

    fn run(inputs: &NodeInputs, parents: Outs<Self>, work: &Work<'_>) -> Result<Drawn, Error> {
        let (
            input,
            segmented,
            region,
            tissues,
            meshed,
            solved,
            warped,
            points,
            known,
            fit,
            evaluated,
        ) = parents;
        let uncertainty = segmented.uncertainty(Progress::none())?;
        let surfaces = segmented.drawn(Progress::none())?;
        let scene = Scene {
            ct: &input.ct,
            deformed: &warped.ct,
            labels: &segmented.labels,
            surfaces: &surfaces,
            uncertainty: uncertainty.as_deref(),
            tissues: tissues.labels.as_deref(),
            deformation: &warped.carried,
            tissue: solved.deformation.displacement(),
            sphere: region.sphere()?,
            tumour: Some(inputs.tumour.sphere()?),
            tumour_after: Some(Point::from(points.tumour.after_mm)),
            tumour_within: known.interval.as_ref().map(|interval| &interval.ellipsoid),
            nipple: region.nipple(),
            side: if inputs.left { Side::Left } else { Side::Right },
        };
        let segmentation = Segmentation {
            fat_hu: segmented.facts.fat_hu,
            muscle_hu: segmented.facts.muscle_hu,
            soft_tissue_ml: region.soft_tissue_ml,
            chest_wall_ml: region.chest_wall_ml,
            uncertainty: region.uncertainty.clone(),
            quality_checks: segmented.facts.checks.iter().chain(&region.checks).cloned().collect(),
            tissues: tissues.facts.clone(),
        };
        let segmentation = with_effects(segmentation, &known.effects_mm);
        let mesh = supine_report::Mesh { unknowns: solved.facts.unknowns, ..meshed.facts.clone() };
        let progress = work.progress;
        let volumes = supine_report::volume_changes(&scene, progress.part(0.0, 0.1))?;
        let agreement = supine_report::agreement(&scene);
        let (nipple, told) = (points.nipple.as_ref(), &segmentation);
        let shown = Shown {
            segmentation: told,
            mesh: &mesh,
            volumes: &volumes,
            nipple,
            sitting: fit.tissue().zip(fit.distances()),
            intraop: evaluated.facts.as_ref().zip(evaluated.distances()),
        };
        let pictures = supine_report::draw(&shown, &scene, progress.part(0.1, 1.0))?;
        work.warn_all(pictures.warnings.clone());
        Ok(Drawn { pictures, segmentation, mesh, volumes, agreement })
    }

    fn bytes(out: &Drawn) -> usize {
        out.pictures.bytes()
    }
}

/// What the uncertain places of the wall do to the tumour.
fn with_effects(mut told: Segmentation, effects_mm: &[f64]) -> Segmentation {
    let patches = told.uncertainty.iter_mut().flat_map(|uncertainty| &mut uncertainty.patches);
    patches.zip(effects_mm).for_each(|(patch, mm)| patch.effect_mm = Some(*mm));
    told
}

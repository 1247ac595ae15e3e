//! A scan of the patient on the operating table held against the result.

use super::{Import, Mesh, Points, Region, Segment, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::nodes::Meshed;
use crate::nodes::law::Law;
use crate::shared::{PosedScan, landmarks, other_breast, skin_distance};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_exchange::{read_scan_distances, write_scan_distances};
use supine_fem::{RestState, Tissue};
use supine_mesh::{Deformation, ScanDistances};
use supine_personalise::{Carried, EvaluationQuestion, NEAR_MM, evaluate};
use supine_register::Skin;
use supine_report::{
    EvaluatedSurface, Evaluation as Told, FEW_POINTS, Input, SkinDistances, TORSO_MM,
};
use supine_space::{Failure, Point, Progress, Side, Warning};

pub(crate) struct Evaluation;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    left: bool,
    scans: Option<Scans>,
    /// The default tissue on this table; none when the run has it.
    default: Option<Law>,
}

#[derive(Serialize)]
struct Scans {
    intraop: InputFile,
    landmarks: Option<InputFile>,
    unit: Option<&'static str>,
}

/// How far the scan lies off; nothing when the case names none.
#[derive(Serialize, Deserialize, Clone, Debug, Default)]
pub(crate) struct Evaluated {
    pub(crate) facts: Option<Told>,
    pub(crate) inputs: Vec<Input>,
    #[serde(skip)]
    distances: Option<Arc<ScanDistances>>,
}

impl Evaluated {
    pub(crate) fn distances(&self) -> Option<&ScanDistances> {
        self.distances.as_deref()
    }

    pub(crate) fn shared_distances(&self) -> Option<Arc<ScanDistances>> {
        self.distances.clone()
    }
}

impl Node for Evaluation {
    const ID: NodeId = NodeId::Evaluation;
    const METHOD: u32 = 4;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Segment, Region, Mesh, Solve, Points);
    type Out = Evaluated;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let scans = case.scans.as_ref().and_then(|scans| Some((scans, scans.intraop.as_ref()?)));
        let scans = scans.map(|(scans, intraop)| {
            let landmarks = scans.landmarks.as_ref();
            Ok::<_, Error>(Scans {
                intraop: case_state.file("scans.intraop", intraop)?,
                landmarks: landmarks
                    .map(|path| case_state.file("scans.landmarks", path))
                    .transpose()?,
                unit: scans.unit,
            })
        });
        let own_tissue = case.fit_scans().is_some()
            || case.stiffness.is_some()
            || case.tissue != Tissue::default()
            || case.rest != RestState::default();
        let default = own_tissue.then(|| {
            let mut plain = case.as_ref().clone();
            (plain.tissue, plain.rest, plain.stiffness) =
                (Tissue::default(), RestState::default(), None);
            Law::of(&plain)
        });
        let left = case.breast == Some(Side::Left);
        Ok(NodeInputs { left, scans: scans.transpose()?, default: default.transpose()? })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Evaluated> {
        inputs.scans.is_none().then(Evaluated::default)
    }

    fn run(inputs: &NodeInputs, parents: Outs<Self>, work: &Work<'_>) -> Result<Evaluated, Error> {
        let (input, segmented, region, meshed, solved, points) = parents;
        let Some(scans) = &inputs.scans else { return Ok(Evaluated::default()) };
        let (sphere, progress) = (region.sphere()?, work.progress);
        let skin = Skin::of(&*skin_distance(&input, &segmented, Progress::none())?);
        let other = other_breast(inputs.left, &segmented, &skin, sphere);
        let carried = Carried::new(&skin, &meshed.mesh, other.as_ref());
        let default = match &inputs.default {
            Some(law) => by_default(law, &meshed, work)?,
            None => None,
        };
        let marks = landmarks(scans.landmarks.as_ref())?;
        let read = PosedScan::read(&scans.intraop, ("intraop", scans.unit), &marks, work)?;
        let mut models = Vec::new();
        models.extend(default.as_ref().map(|found| ("default", found.displacement())));
        models.push(("run", solved.deformation.displacement()));
        let question = EvaluationQuestion {
            carried: &carried,
            models: &models,
            scan: &read.scan,
            pose: read.pose,
            centre: sphere.centre(),
            tumour: Point::from(points.tumour.after_mm),
        };
        let evaluation = evaluate(&question, progress.part(0.5, 1.0)).map_err(Error::Evaluation)?;
        let files = [Some(&scans.intraop), scans.landmarks.as_ref()];
        let inputs = files.into_iter().flatten().map(|file| file.told(file.key)).collect();
        let facts = told(&evaluation);
        warn(&facts, work);
        let distances = Some(Arc::new(evaluation.distances));
        Ok(Evaluated { facts: Some(facts), inputs, distances })
    }

    fn save(out: &Evaluated, work: &Work<'_>) -> Result<(), Error> {
        let (Some(facts), Some(distances)) = (&out.facts, &out.distances) else { return Ok(()) };
        write_scan_distances(distances, &work.place("intraop")?).map_err(Error::product)?;
        supine_report::write_evaluation_table(facts, &work.place("table")?).map_err(Error::Report)
    }

    fn facts(out: &Evaluated) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Evaluated, Error> {
        let mut evaluated: Evaluated = serde_json::from_value(facts)?;
        if evaluated.facts.is_some() {
            let read = read_scan_distances(&work.place("intraop")?).map_err(Error::product)?;
            evaluated.distances = Some(Arc::new(read));
        }
        Ok(evaluated)
    }
}

/// How the default tissue deforms; none, and told, where it has no solution: the result does not
/// rest on it.
fn by_default(law: &Law, meshed: &Meshed, work: &Work<'_>) -> Result<Option<Deformation>, Error> {
    let (body, part) = (law.body(meshed, None, None), work.progress.part(0.1, 0.5));
    match supine_fem::solve(&body, &law.load(), &law.solver(), part) {
        Ok((deformation, _)) => Ok(Some(deformation)),
        Err(error) if error.kind() == Failure::Stopped => Err(error.into()),
        Err(error) => {
            let text = format!(
                "the scan on the operating table is not held against the default tissue: {error}"
            );
            work.warn(Warning::new("default-without-solution", text));
            Ok(None)
        }
    }
}

fn told(found: &supine_personalise::Evaluation) -> Told {
    let surface = |(name, [near, breast]): (&str, [SkinDistances; 2])| EvaluatedSurface {
        name: name.into(),
        near,
        breast,
    };
    Told {
        surfaces: found.spreads().map(surface).collect(),
        near_mm: found.near.coords.into(),
        near_radius_mm: NEAR_MM,
        torso_mm: found.torso_mm,
        patient_from_scan: found.pose.to_homogeneous().transpose().into(),
    }
}

/// Says what speaks against it.
fn warn(facts: &Told, work: &Work<'_>) {
    if facts.torso_mm > TORSO_MM {
        let text = format!(
            "the scan on the operating table lies {:.1} mm rms off the torso of the CT (above {TORSO_MM} mm): it is of another posture \
             or patient, mirrored, or not in its stated unit; its distances from the breast say nothing",
            facts.torso_mm
        );
        work.warn(Warning::new("intraop-scan-apart", text));
    }
    let few = facts.surfaces.iter().any(|surface| surface.near.points < FEW_POINTS);
    if few {
        let text = "the scan on the operating table has hardly a point near the tumour: its distances there say nothing";
        work.warn(Warning::new("intraop-scan-short", text));
    }
}

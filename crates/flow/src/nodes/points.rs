//! The tumour, the nipple and the case's points, carried along.

use super::{Region, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::inputs::InputFile;
use crate::shared::{PlacedTumour, movement, would_lie_in};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use supine_exchange::{NamedPoint, read_points, write_points};
use supine_mesh::TetMesh;
use supine_report::SphereRecord;
use supine_report::{CarriedPoint, Movement};
use supine_space::{Failure, Point, Warning};

pub(crate) struct Points;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    tumour: SphereRecord,
    /// The structure set that it came from.
    #[serde(skip_serializing_if = "Option::is_none")]
    drawn: Option<InputFile>,
    files: Vec<InputFile>,
}

/// Where they come to.
#[derive(Serialize, Deserialize, Clone, Debug)]
pub(crate) struct Carried {
    pub(crate) tumour: Movement,
    pub(crate) nipple: Option<Movement>,
    pub(crate) points: Vec<CarriedPoint>,
    pub(crate) inputs: Vec<supine_report::Input>,
    /// All of them, as the file lists them.
    #[serde(skip)]
    listed: Vec<NamedPoint>,
}

impl NodeInputs {
    fn files_read(&self) -> Vec<supine_report::Input> {
        let tumour = self.drawn.iter().map(|file| file.told("tumour"));
        tumour.chain(self.files.iter().map(|file| file.told("points"))).collect()
    }
}

impl Node for Points {
    const ID: NodeId = NodeId::Points;
    const METHOD: u32 = 2;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Region, Solve);
    type Out = Carried;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let files = case_state.files("carry.points", &case.points)?;
        let PlacedTumour { sphere, drawn, .. } = case_state.tumour()?;
        Ok(NodeInputs { tumour: sphere.into(), drawn: drawn.map(|(file, _)| file), files })
    }

    fn run(
        inputs: &NodeInputs,
        (chosen, solved): Outs<Self>,
        work: &Work<'_>,
    ) -> Result<Carried, Error> {
        let tumour = inputs.tumour.sphere()?.centre();
        let mut points = vec![NamedPoint { name: "tumour".into(), position: tumour }];
        if let Some(position) = chosen.nipple() {
            points.push(NamedPoint { name: "nipple".into(), position });
        }
        let own_points = points.len();
        for file in &inputs.files {
            let read = read_points(&file.path);
            points.extend(read.map_err(|e| Error::file("carry.points", e))?);
            file.check_unchanged()?;
        }
        refuse_nowhere(&points, solved.deformation.mesh())?;
        let positions: Vec<Point> = points.iter().map(|p| p.position).collect();
        let params = supine_warp::Params::default();
        let after = supine_warp::carry_points(&solved.deformation, &params, &positions)?;
        work.warn_all(not_carried(&points, &after, solved.deformation.mesh()));
        let nipple = chosen.nipple().zip(after.get(1).copied().flatten());
        let listed = points
            .iter()
            .zip(&after)
            .map(|(p, a)| NamedPoint { name: p.name.clone(), position: a.unwrap_or(p.position) });
        Ok(Carried {
            tumour: movement(tumour, after[0]),
            nipple: nipple.map(|(before, after)| movement(before, Some(after))),
            points: points.iter().zip(&after).skip(own_points).map(|(p, a)| told(p, *a)).collect(),
            inputs: inputs.files_read(),
            listed: listed.collect(),
        })
    }

    fn save(out: &Carried, work: &Work<'_>) -> Result<(), Error> {
        write_points(&out.listed, &work.place("points")?).map_err(Error::product)
    }

    fn facts(out: &Carried) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Carried, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

fn told(point: &NamedPoint, after: Option<Point>) -> CarriedPoint {
    CarriedPoint {
        name: point.name.clone(),
        before_mm: point.position.coords.into(),
        after_mm: after.unwrap_or(point.position).coords.into(),
        inside: after.is_some(),
    }
}

/// A point further than this from the modelled tissue is none of the patient, mm.
const FARTHEST_MM: f64 = 2000.0;

/// Refuses points that lie nowhere near the patient: a coordinate is mistyped.
pub(crate) fn refuse_nowhere(points: &[NamedPoint], mesh: &TetMesh) -> Result<(), Error> {
    let Some(first) = mesh.points().first() else { return Ok(()) };
    // What is no number is no place either.
    let near = |p: &&NamedPoint| (p.position - first).norm() <= FARTHEST_MM;
    let Some(far) = points.iter().find(|p| !near(p)) else { return Ok(()) };
    let [x, y, z] = <[f64; 3]>::from(far.position.coords);
    let message = format!(
        "the point {:?} at ({x:?}, {y:?}, {z:?}) mm lies metres away from the patient: a coordinate is mistyped, or the \
         points belong to another CT",
        far.name
    );
    Err(Error::Refused { kind: Failure::Input, message })
}

/// A warning that names the points outside the mesh, which stay where they were; with the unit or
/// the axes in which all of them would lie in it.
pub(crate) fn not_carried(
    points: &[NamedPoint],
    after: &[Option<Point>],
    mesh: &TetMesh,
) -> Option<Warning> {
    let outside = || points.iter().zip(after).filter(|(_, a)| a.is_none()).map(|(p, _)| p);
    let names: Vec<&str> = outside().map(|p| p.name.as_str()).collect();
    let places: Vec<Point> = outside().map(|p| p.position).collect();
    let hint = would_lie_in(&places, mesh);
    let hint = hint.map_or(String::new(), |reading| format!("; they would lie in it {reading}"));
    let text = "outside the modelled tissue and therefore not moved: ";
    (!names.is_empty()).then(|| Warning::new("points-outside", text).names(names).text(hint))
}

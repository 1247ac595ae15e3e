//! The modulus that fits a scan of the sitting patient, in each rest state.

use super::{Import, Mesh, Moduli as ModuliNode, Region, Segment, Tissues as TissuesNode};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::fit_by_law::{FitByLaw, fit_by_law};
use crate::nodes::fit_scans::Scans;
use crate::nodes::interval::{coarser, wall_error_mm};
use crate::nodes::law::Law;
use crate::nodes::moduli::{ByTissue, tissue_map};
use crate::nodes::segment::Segmented;
use crate::shared::{TissueMap, other_breast, read_scans, skin_distance};
use crate::spec::{Case, StiffnessMap};
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_exchange::{read_scan_distances, write_scan_distances};
use supine_fem::{Body, Params, RestState};
use supine_mesh::{BoundaryTag, ScanDistances, TetMesh};
use supine_personalise::{
    Choice, DECIDES, FitQuestion, Tissues, UPRIGHT_DEG, compare, fit, with_additions,
};
use supine_register::Skin;
use supine_report::{FittedTissues, Input, Moduli, OneModulus, STRUCTURED_MM, StateFit, TissueFit};
use supine_segment::UNCERTAIN_MM;
use supine_space::{Failure, Progress, Side, Warning};
use supine_tetrahedralise::Refinement;

pub(crate) struct Fit;

/// Tetrahedra of the mesh on which the modulus is searched.
const COARSE: usize = 1600;
/// Another pose of the scan that fits so nearly as well, as a factor of the objective, is told.
const OTHER_POSE: f64 = 1.3;
/// The chest wall as a whole is off by this much, one standard deviation, mm: on four real CTs the
/// mean offset was 0.05, 0.51, 0.05 and 0.01 mm.
const WALL_MM: f64 = 0.3;
/// Of the uncertainty of its places so much is common to all. Chosen, not measured.
const WALL_SHARE: f64 = 0.4;
/// Standard deviations on each side of the median that hold 95 %.
const NORMAL_95: f64 = 1.96;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    left: bool,
    /// As the patient sits.
    law: Law,
    scans: Option<Scans>,
    /// Whether the proportions of the tissues' moduli are fitted too; those that are taken for
    /// likely.
    tissues: Option<[f64; 4]>,
    /// Whether labels tell fat from gland; else HU.
    by_labels: bool,
}

/// The tissue that was fitted; none when the case names no scans.
#[derive(Serialize, Deserialize, Clone, Debug, Default)]
pub(crate) struct Fitted {
    tissue: Option<TissueFit>,
    /// Those of the tissues with what was fitted.
    moduli: Option<Moduli>,
    /// Moduli by tissue that the scan spoke for; the case does not ask for any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    by_tissue: Option<ByTissue>,
    inputs: Vec<Input>,
    /// Of the sitting scan from the skin of the CT, and from the model's with what was fitted.
    #[serde(skip)]
    distances: Option<Arc<ScanDistances>>,
}

impl Fitted {
    pub(crate) fn tissue(&self) -> Option<&TissueFit> {
        self.tissue.as_ref()
    }

    pub(crate) fn moduli(&self) -> Option<&Moduli> {
        self.moduli.as_ref()
    }

    /// Moduli by tissue that the scan spoke for.
    pub(crate) fn by_tissue(&self) -> Option<&ByTissue> {
        self.by_tissue.as_ref()
    }

    /// The moduli by tissue that are gone on with: those, or what the case asks for.
    pub(crate) fn stiffness<'a>(&'a self, asked: &'a Option<ByTissue>) -> Option<&'a ByTissue> {
        self.by_tissue().or(asked.as_ref())
    }

    pub(crate) fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    pub(crate) fn distances(&self) -> Option<&ScanDistances> {
        self.distances.as_deref()
    }

    pub(crate) fn shared_distances(&self) -> Option<Arc<ScanDistances>> {
        self.distances.clone()
    }
}

impl Case {
    /// The case with the tissue that was fitted.
    pub(crate) fn fitted(&self, fit: &TissueFit) -> Self {
        let mut case = self.clone();
        let held = Params { sliding: case.sliding, skin: case.skin, ..Params::default() };
        let (tissue, params) = with_additions(fit.additions(), &case.tissue, &held);
        (case.tissue, case.sliding, case.skin) = (tissue, params.sliding, params.skin);
        case.tissue.young_kpa = fit.best().young_kpa;
        case.rest = fit.best().rest;
        if let Some(stiffness) = &mut case.stiffness {
            stiffness.mean_kpa = Some(fit.best().young_kpa);
            stiffness.kpa =
                fit.best().tissues.as_ref().map_or(stiffness.kpa, FittedTissues::proportions);
        }
        case
    }
}

impl Node for Fit {
    const ID: NodeId = NodeId::Fit;
    const METHOD: u32 = 11;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Import, Segment, Region, TissuesNode, Mesh, ModuliNode);
    type Out = Fitted;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let load = case.load_of_sitting();
        let left = case.breast == Some(Side::Left);
        let tissues = case.stiffness.filter(|stiffness| !stiffness.given).map(|s| s.kpa);
        let by_labels = case.stiffness.is_some_and(|s| s.map == StiffnessMap::Labels);
        let law = Law::under(case, load);
        Ok(NodeInputs { left, law, scans: Scans::of(case_state)?, tissues, by_labels })
    }

    fn not_asked(inputs: &NodeInputs) -> Option<Fitted> {
        inputs.scans.is_none().then(Fitted::default)
    }

    fn run(inputs: &NodeInputs, parents: Outs<Self>, work: &Work<'_>) -> Result<Fitted, Error> {
        let (input, segmented, region, tissues, meshed, moduli) = parents;
        let Some(scans) = &inputs.scans else { return Ok(Fitted::default()) };
        let sphere = region.sphere()?;
        let skin = Skin::of(&*skin_distance(&input, &segmented, Progress::none())?);
        let read = read_scans(scans, &skin, sphere, work)?;
        let moduli = moduli.as_ref().as_ref();
        let body = inputs.law.body(&meshed, moduli, None);
        let map = tissue_map(&input, &tissues, inputs.by_labels);
        let (coarse, shares) = coarse(&body, moduli.zip(map), work.progress.part(0.3, 0.4))?;
        let states = RestState::ALL.into_iter();
        let states: Vec<RestState> = states.filter(|rest| scans.states.contains(rest)).collect();
        let other = other_breast(inputs.left, &segmented, &skin, sphere);
        let question = FitQuestion {
            body: &body,
            coarse: &coarse,
            load: &inputs.law.load(),
            params: &inputs.law.solver(),
            states: &states,
            skin: &skin,
            centre: sphere.centre(),
            other: other.as_ref(),
            scan: &read.sitting,
            poses: &read.poses,
            wall_mm: wall_mm(&segmented, &meshed.mesh)?,
            tissues: inputs.tissues.zip(moduli).map(|(likely, by)| Tissues {
                shares: &by.shares,
                coarse: &shares,
                likely,
            }),
        };
        let FitByLaw { fit: best_fit, laws, by_tissue } = match scans.laws {
            true => {
                fit_by_law(&question, (scans, (&*input, &*segmented, &*region, &*meshed)), work)?
            }
            false => {
                let fit = fit(&question, work.progress.part(0.4, 0.98)).map_err(Error::Fit)?;
                FitByLaw { fit, laws: vec![], by_tissue: None }
            }
        };
        let mut tissue = TissueFit { laws, ..told(&best_fit, read.supine) };
        tissue.one_modulus = one_modulus(&question, &best_fit, work.progress.part(0.98, 1.0))?;
        let by = by_tissue.as_ref().or(moduli);
        warn(&tissue, (by.is_some(), scans.lean_deg), work);
        let moduli = by.map(|by| by.fitted(&meshed.mesh, tissue.best()).1);
        let files = [Some(&scans.sitting), scans.supine.as_ref(), scans.landmarks.as_ref()];
        let inputs = files.into_iter().flatten().map(|file| file.told(file.key)).collect();
        let distances = Some(Arc::new(best_fit.distances));
        Ok(Fitted { tissue: Some(tissue), moduli, by_tissue, inputs, distances })
    }

    fn save(out: &Fitted, work: &Work<'_>) -> Result<(), Error> {
        let (Some(tissue), Some(distances)) = (&out.tissue, &out.distances) else { return Ok(()) };
        write_scan_distances(distances, &work.place("sitting")?).map_err(Error::product)?;
        supine_report::write_fit_table(tissue, &work.place("table")?).map_err(Error::Report)
    }

    fn facts(out: &Fitted) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, work: &Work<'_>) -> Result<Fitted, Error> {
        let mut fitted: Fitted = serde_json::from_value(facts)?;
        if fitted.tissue.is_some() {
            let read = read_scan_distances(&work.place("sitting")?).map_err(Error::product)?;
            fitted.distances = Some(Arc::new(read));
        }
        Ok(fitted)
    }
}

/// One modulus for all tissues where the case has one for each: whether the scan speaks for it.
/// None too where it has no solution.
fn one_modulus(
    question: &FitQuestion<'_>,
    found: &supine_personalise::Fit,
    progress: Progress<'_>,
) -> Result<Option<OneModulus>, Error> {
    let rest = found.choice.rest();
    let by_tissue = found.states.iter().find(|state| state.fit.rest == rest);
    let (Some(_), Some(by_tissue)) = (&question.body.young_kpa, by_tissue) else { return Ok(None) };
    let body = Body { young_kpa: None, ..question.body.clone() };
    let coarse = Body { young_kpa: None, ..question.coarse.clone() };
    let alone =
        FitQuestion { body: &body, coarse: &coarse, states: &[rest], tissues: None, ..*question };
    let fitted = match fit(&alone, progress) {
        Ok(fitted) => fitted,
        Err(error) if error.kind() == Failure::Stopped => return Err(Error::Fit(error)),
        Err(_) => return Ok(None),
    };
    let one = fitted.states.first();
    Ok(one.map(|one| OneModulus {
        young_kpa: one.fit.young_kpa,
        misfit_mm: one.fit.misfit_mm,
        evidence: compare(question, one, by_tissue),
    }))
}

/// The body on fewer tetrahedra, and which shares of tissues these have.
fn coarse(
    body: &Body,
    by: Option<(&ByTissue, TissueMap<'_>)>,
    progress: Progress<'_>,
) -> Result<(Body, Vec<[f64; 4]>), Error> {
    let bare = Body { young_kpa: None, ..body.clone() };
    let coarse = coarser(&bare, COARSE, &Refinement::None, progress)?;
    let Some((by, map)) = by else { return Ok((coarse, vec![])) };
    let by = by.on(&coarse.mesh, &map);
    Ok((Body { young_kpa: Some(Arc::from(by.young_kpa)), ..coarse }, by.shares))
}

/// How far the chest wall as a whole may be off, one standard deviation, mm.
fn wall_mm(segmented: &Segmented, mesh: &TetMesh) -> Result<f64, Error> {
    let nodes = mesh.points_on(BoundaryTag::ChestWall);
    let map = segmented.uncertainty(Progress::none())?;
    let error = |n: &u32| {
        let place = &mesh.points()[*n as usize];
        map.as_deref().map_or(UNCERTAIN_MM, |map| wall_error_mm(map, place)) / NORMAL_95
    };
    let mean = nodes.iter().map(error).sum::<f64>() / nodes.len().max(1) as f64;
    Ok(WALL_MM.hypot(WALL_SHARE * mean))
}

/// What was found in the words of the summary, the rest state to go on with first.
fn told(found: &supine_personalise::Fit, supine: Option<supine_report::ScanFit>) -> TissueFit {
    let chosen = found.choice.rest();
    let mut states: Vec<StateFit> = found.states.iter().map(|s| s.fit.clone()).collect();
    states.sort_by_key(|state| state.rest != chosen);
    let (decided, evidence) = match found.choice {
        Choice::Asked(_) => (true, None),
        Choice::Decided { evidence, .. } => (true, Some(evidence)),
        Choice::Open { evidence, .. } => (false, Some(evidence)),
    };
    TissueFit { states, decided, evidence, laws: vec![], one_modulus: None, supine }
}

/// Says what speaks against it.
fn warn(fit: &TissueFit, (by_tissue, stated_deg): (bool, f64), work: &Work<'_>) {
    let best = fit.best();
    if best.structured_mm > STRUCTURED_MM {
        let text = format!(
            "the model's skin lies {:.2} mm rms off the scan of the sitting patient, {:.2} mm of it alike over centimetres (above \
             {STRUCTURED_MM} mm), which noise does not explain: {}, or the scan is not of her as she was in the CT; the modulus is an \
             average",
            best.misfit_mm,
            best.structured_mm,
            if by_tissue {
                "these moduli of the tissues do not describe this breast"
            } else {
                "no law that was tried describes this breast (set tissue.map to fit a modulus for gland and one for skin)"
            }
        );
        work.warn(Warning::new("fit-misfit", text));
    }
    if let Some(times) = best.other_pose.filter(|times| *times < OTHER_POSE) {
        let text = format!(
            "the pose of the scan of the sitting patient is open: another one fits nearly as well ({times:.2} times the objective); \
             give landmarks, or a scan of more of the torso"
        );
        work.warn(Warning::new("scan-pose-open", text));
    }
    if let Some(one) = fit.one_modulus.as_ref().filter(|one| one.evidence > DECIDES) {
        let text = format!(
            "the scan of the sitting patient speaks against the moduli by tissue: one modulus of {:.3} kPa lies {:.2} mm rms off it, \
             those by tissue {:.2} mm; leave tissue.map out",
            one.young_kpa, one.misfit_mm, best.misfit_mm
        );
        work.warn(Warning::new("scan-against-map", text));
    }
    if best.lean_deg.abs() > UPRIGHT_DEG {
        let way = if best.lean_deg > 0.0 { "back" } else { "forward" };
        let degrees = best.lean_deg.abs();
        let text = if stated_deg == 0.0 {
            format!(
                "the patient seems to lean {way} by {degrees:.0} degrees in the scan of the sitting patient: the modulus is fitted with \
                 that; have her sit upright, her torso as in the CT, or measure how far she leans back (scans.lean)"
            )
        } else {
            format!(
                "the patient seems to lean {degrees:.0} degrees farther {way} in the scan of the sitting patient than the {stated_deg} \
                 degrees that scans.lean says: the modulus is fitted with that"
            )
        };
        work.warn(Warning::new("scan-leaning", text));
    }
    if let ([one, other, ..], false) = (fit.states.as_slice(), fit.decided) {
        let text = format!(
            "the scan does not tell the rest state: {} with {:.3} kPa and {} with {:.3} kPa fit about as well; the run goes on with \
             the first, and the interval holds both",
            one.rest, one.young_kpa, other.rest, other.young_kpa
        );
        work.warn(Warning::new("rest-state-open", text));
    }
}

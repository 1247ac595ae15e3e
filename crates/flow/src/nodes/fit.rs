//! The modulus that fits a scan of the sitting patient, in each rest state.

use super::{Import, Mesh, Moduli, Region, Segment};
use crate::graph::{Node, Outs};
use crate::ground::Ground;
use crate::inputs::InputFile;
use crate::nodes::import::Imported;
use crate::nodes::interval::{coarser, wall_error_mm};
use crate::nodes::law::Law;
use crate::nodes::segment::Segmented;
use crate::shared::{read_scans, rest_name};
use crate::spec::Case;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_fem::{Body, Load, RestState};
use supine_mesh::{BoundaryTag, TetMesh};
use supine_personalise::{Choice, FitQuestion, fit};
use supine_register::Skin;
use supine_report::{FitStep, Input, StateFit, TissueFit};
use supine_segment::{Breast, UNCERTAIN_MM};
use supine_space::{Side, Sphere, Warning};
use supine_volume::SignedDistance;

pub(crate) struct Fit;

/// Tetrahedra of the mesh on which the modulus is searched.
const COARSE: usize = 1600;
/// Residuals of a breast above which the model does not describe it, mm rms: 0.4 on synthetic patients when it does, 0.9 and
/// more in the wrong rest state or with stiff gland.
const MISFIT_MM: f64 = 0.7;
/// The chest wall as a whole is off by this much, one standard deviation, mm: on four real CTs the mean offset was 0.05, 0.51,
/// 0.05 and 0.01 mm.
const WALL_MM: f64 = 0.3;
/// Of the uncertainty of its places so much is common to all. Chosen, not measured.
const WALL_SHARE: f64 = 0.4;
/// HU between air and skin.
const SKIN_HU: f64 = -400.0;
/// Standard deviations on each side of the median that hold 95 %.
const NORMAL_95: f64 = 1.96;

#[derive(Serialize)]
pub(crate) struct Own {
    left: bool,
    /// As the patient sits.
    law: Law,
    scans: Option<Scans>,
}

/// The scans of a case.
#[derive(Serialize, Clone)]
pub(crate) struct Scans {
    pub(crate) sitting: InputFile,
    pub(crate) supine: Option<InputFile>,
    pub(crate) landmarks: Option<InputFile>,
    pub(crate) unit: Option<&'static str>,
    states: Vec<&'static str>,
}

/// The tissue that was fitted; none when the case names no scans.
#[derive(Serialize, Deserialize, Clone, Debug, Default)]
pub(crate) struct Fitted {
    tissue: Option<TissueFit>,
    inputs: Vec<Input>,
}

impl Fitted {
    pub(crate) fn tissue(&self) -> Option<&TissueFit> {
        self.tissue.as_ref()
    }

    pub(crate) fn inputs(&self) -> &[Input] {
        &self.inputs
    }
}

/// A body whose mean modulus is the one that was fitted.
pub(crate) trait OfMean {
    /// It.
    fn of_mean(self, fit: Option<&TissueFit>) -> Self;
}

impl OfMean for Body {
    fn of_mean(self, fit: Option<&TissueFit>) -> Self {
        match fit {
            Some(fit) if self.young_kpa.is_some() => self.with_mean(fit.best().young_kpa),
            _ => self,
        }
    }
}

impl Case {
    /// The case with the tissue that was fitted.
    pub(crate) fn fitted(&self, fit: &TissueFit) -> Self {
        let mut case = self.clone();
        case.tissue.young_kpa = fit.best().young_kpa;
        case.rest = if fit.best().rest == "net" { RestState::Net } else { RestState::Unloaded };
        if let Some(stiffness) = &mut case.stiffness {
            stiffness.mean_kpa = Some(fit.best().young_kpa);
        }
        case
    }
}

impl Node for Fit {
    const ID: NodeId = NodeId::Fit;
    const METHOD: u32 = 1;
    const KEPT: bool = true;
    type Own = Own;
    type Parents = (Import, Segment, Region, Mesh, Moduli);
    type Out = Fitted;

    fn own(ground: &Ground) -> Result<Own, Error> {
        let case = &ground.case;
        let load = Load { ct: supine_space::supine(), target: supine_space::sitting() };
        let scans = case.scans.as_ref().map(|scans| {
            let file = |key, path: &Option<std::path::PathBuf>| {
                path.as_ref().map(|path| ground.file(key, path)).transpose()
            };
            Ok::<_, Error>(Scans {
                sitting: ground.file("scans.sitting", &scans.sitting)?,
                supine: file("scans.supine", &scans.supine)?,
                landmarks: file("scans.landmarks", &scans.landmarks)?,
                unit: scans.unit,
                states: scans.states.iter().map(|rest| rest_name(*rest)).collect(),
            })
        });
        let left = case.breast == Some(Side::Left);
        Ok(Own { left, law: Law::under(case, load), scans: scans.transpose()? })
    }

    fn not_asked(own: &Own) -> Option<Fitted> {
        own.scans.is_none().then(Fitted::default)
    }

    fn run(own: &Own, parents: Outs<Self>, work: &Work<'_>) -> Result<Fitted, Error> {
        let (input, segmented, region, meshed, moduli) = parents;
        let Some(scans) = &own.scans else { return Ok(Fitted::default()) };
        let sphere = region.sphere()?;
        let skin = Skin::of(&*skin_distance(&input, &segmented)?);
        let read = read_scans(scans, &skin, sphere, work)?;
        let body = own.law.body(&meshed, moduli.as_ref().as_ref());
        let coarse = coarser(&body, COARSE, work.progress.part(0.3, 0.4))?;
        let states = RestState::ALL.into_iter();
        let states: Vec<RestState> =
            states.filter(|rest| scans.states.contains(&rest_name(*rest))).collect();
        let other = other_breast(own.left, &segmented, &skin, sphere);
        let question = FitQuestion {
            body: &body,
            coarse: &coarse,
            load: &own.law.load(),
            params: &own.law.solver(),
            states: &states,
            skin: &skin,
            centre: sphere.centre(),
            other: other.as_ref(),
            scan: &read.sitting,
            poses: &read.poses,
            wall_mm: wall_mm(&segmented, &meshed.mesh),
        };
        let found = fit(&question, work.progress.part(0.4, 1.0)).map_err(Error::Fit)?;
        let tissue = told(&found, read.supine);
        warn(&tissue, work);
        let files = [Some(&scans.sitting), scans.supine.as_ref(), scans.landmarks.as_ref()];
        let inputs = files.into_iter().flatten().map(|file| file.told(file.key)).collect();
        Ok(Fitted { tissue: Some(tissue), inputs })
    }

    fn facts(out: &Fitted) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Fitted, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

/// The skin between the voxels: as segmented, or where labels were supplied by the CT along their border.
fn skin_distance(input: &Imported, segmented: &Segmented) -> Result<Arc<SignedDistance>, Error> {
    if let Some(surfaces) = &segmented.surfaces {
        return Ok(Arc::new(surfaces.get()?.skin.clone()));
    }
    let (labels, ct) = (&segmented.labels, &input.ct);
    let inside = |n: usize| labels.data()[n] != supine_volume::label::OUTSIDE;
    let share = |n: usize, m: usize| {
        let [a, b] = [n, m].map(|n| f64::from(ct.data()[n]));
        if a > SKIN_HU && b < SKIN_HU { ((a - SKIN_HU) / (a - b)) as f32 } else { 0.5 }
    };
    Ok(Arc::new(SignedDistance::new(labels.grid(), SignedDistance::WIDEST_MM, inside, share)))
}

/// The sphere of the other breast; without one in the labels the region's own, mirrored.
fn other_breast(left: bool, segmented: &Segmented, skin: &Skin, region: Sphere) -> Option<Sphere> {
    let side = if left { Side::Right } else { Side::Left };
    let found = Breast::find(&segmented.labels, side, None);
    if let Ok((sphere, _)) = found.and_then(|breast| breast.region(&segmented.labels, None)) {
        return Some(sphere);
    }
    let x = skin.points().iter().map(|p| p.x);
    let (low, high) = x.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    let mut centre = region.centre();
    centre.x = low + high - centre.x;
    Sphere::new(centre, region.radius()).ok()
}

/// How far the chest wall as a whole may be off, one standard deviation, mm.
fn wall_mm(segmented: &Segmented, mesh: &TetMesh) -> f64 {
    let nodes = mesh.points_on(BoundaryTag::ChestWall);
    let map = segmented.uncertainty.as_deref();
    let error = |n: &u32| {
        let place = &mesh.points()[*n as usize];
        map.map_or(UNCERTAIN_MM, |map| wall_error_mm(map, place)) / NORMAL_95
    };
    let mean = nodes.iter().map(error).sum::<f64>() / nodes.len().max(1) as f64;
    WALL_MM.hypot(WALL_SHARE * mean)
}

/// What was found in the words of the summary, the rest state to go on with first.
fn told(found: &supine_personalise::Fit, supine: Option<supine_report::ScanFit>) -> TissueFit {
    let chosen = found.choice.rest();
    let mut states: Vec<StateFit> = found.states.iter().map(state).collect();
    states.sort_by_key(|state| state.rest != rest_name(chosen));
    let (decided, evidence) = match found.choice {
        Choice::Asked(_) => (true, None),
        Choice::Decided { evidence, .. } => (true, Some(evidence)),
        Choice::Open { evidence, .. } => (false, Some(evidence)),
    };
    TissueFit { states, decided, evidence, supine }
}

fn state(state: &supine_personalise::StateFit) -> StateFit {
    let end = |side: f64| state.young_kpa * (side * NORMAL_95 * state.deviation).exp();
    let path = state.path.iter();
    StateFit {
        rest: rest_name(state.rest).into(),
        young_kpa: state.young_kpa,
        interval_kpa: [end(-1.0), end(1.0)],
        deviation: state.deviation,
        misfit_mm: state.misfit_mm,
        patient_from_scan: state.aligned.pose.to_homogeneous().transpose().into(),
        path: path
            .map(|&(young_kpa, objective_mm2)| FitStep { young_kpa, objective_mm2 })
            .collect(),
        ended: state.ended.clone(),
    }
}

/// Says what speaks against it.
fn warn(fit: &TissueFit, work: &Work<'_>) {
    let best = fit.best();
    if best.misfit_mm > MISFIT_MM {
        let text = format!(
            "the model's skin lies {:.2} mm rms off the scan of the sitting patient (above {MISFIT_MM} mm): one modulus does not \
             describe this breast, or the scan is not of her as she was in the CT; the modulus is an average",
            best.misfit_mm
        );
        work.warn(Warning::new("fit-misfit", text));
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

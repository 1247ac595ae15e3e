//! How sure the displacement of the tumour is.

use super::{Evaluation, Fit, Mesh, Moduli, Region, Segment, Solve};
use crate::case_state::CaseState;
use crate::graph::{Node, Outs};
use crate::nodes::law::Law;
use crate::spec::PostureSpec;
use crate::work::Work;
use crate::{Error, NodeId};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use supine_fem::Body;
use supine_mesh::Locator;
use supine_personalise::{
    LEVEL, LogNormal, ModulusPrior, Posture, Question, other_laws, tumour_interval, untold,
};
use supine_report::SphereRecord;
use supine_report::{Ellipsoid, ModulusKnown, OtherRest, StateFit, TissueFit, TumourInterval};
use supine_segment::{UNCERTAIN_MM, UNCERTAINTY_PER_MM};
use supine_space::{Failure, Point, Progress, Vector, Warning};
use supine_tetrahedralise::Refinement;
use supine_volume::Volume;

/// The mesh smooths the wall: its nodes lie this near to the voxels that carry its error, mm.
const WALL_MM: f64 = 2.0;

/// Tetrahedra of the mesh for the curves over the modulus.
const COARSE: usize = 1200;

pub(crate) struct Interval;

#[derive(Serialize)]
pub(crate) struct NodeInputs {
    tumour: SphereRecord,
    law: Law,
    /// That of the case; else what the literature has counts.
    young_kpa: Option<[f64; 2]>,
    /// The probability that the arms lie otherwise than in the CT, and how far breath takes the
    /// breast.
    arms_moved: f64,
    breathing_mm: f64,
}

/// How sure the displacement is, and what each uncertain place of the wall does to it.
#[derive(Serialize, Deserialize, Debug, Clone, Default)]
pub(crate) struct Known {
    /// None where the tumour lies in no tissue that was modelled, or where the run's rest state has
    /// no solution in the interval.
    pub(crate) interval: Option<TumourInterval>,
    /// Change of the tumour's displacement, mm, in the order of the region's uncertain places.
    pub(crate) effects_mm: Vec<f64>,
}

impl Node for Interval {
    const ID: NodeId = NodeId::Interval;
    const METHOD: u32 = 12;
    const KEPT: bool = true;
    type NodeInputs = NodeInputs;
    type Parents = (Segment, Region, Mesh, Moduli, Fit, Solve, Evaluation);
    type Out = Known;

    fn inputs(case_state: &CaseState) -> Result<NodeInputs, Error> {
        let case = &case_state.case;
        let (tumour, law) = (case_state.tumour()?.sphere.into(), Law::of(case)?);
        let PostureSpec { arms_moved, breathing_mm } = case.posture;
        let young_kpa = case.young_interval_kpa;
        Ok(NodeInputs { tumour, law, young_kpa, arms_moved, breathing_mm })
    }

    fn run(inputs: &NodeInputs, parents: Outs<Self>, work: &Work<'_>) -> Result<Known, Error> {
        let (segmented, region, meshed, moduli, fit, solved, evaluated) = parents;
        let tumour = inputs.tumour.sphere()?;
        if Locator::new(solved.deformation.mesh().clone()).locate(&tumour.centre()).is_none() {
            // What takes no part does not move, and nothing is unsure about that.
            return Ok(Known::default());
        }
        let law = inputs.law.fitted(fit.tissue());
        let moduli = fit.stiffness(&moduli);
        let body = law.body(&meshed, moduli, fit.tissue());
        let tissues: Vec<Body> = other_tissues(fit.tissue())
            .iter()
            .map(|fit| law.body(&meshed, moduli, Some(fit)))
            .collect();
        let (load, params) = (law.load(), law.solver());
        let coarse = coarser(&body, COARSE, &Refinement::None, work.progress.part(0.0, 0.3))?;
        let plain = Body { tissue: inputs.law.tissue(), ..coarse.clone() };
        let solver = (&load, &inputs.law.solver());
        let laws = fit.tissue().map_or(&[][..], |fit| &fit.laws);
        let (centre, part) = (tumour.centre(), work.progress.part(0.3, 0.4));
        let others = other_laws(laws, &plain, solver, &centre, part).map_err(Error::Fit)?;
        let posture = Posture::new(inputs.arms_moved, inputs.breathing_mm);
        let seen = evaluated.facts.as_ref().and_then(supine_report::seen_near_mm);
        let map = segmented.uncertainty(Progress::none())?;
        let question = Question {
            body: &body,
            coarse: &coarse,
            load: &load,
            params: &params,
            solved: &solved.deformation,
            tumour,
            prior: prior(inputs.young_kpa, fit.tissue())?,
            wall_error_mm: &|place| {
                map.as_deref().map_or(UNCERTAIN_MM, |map| wall_error_mm(map, place))
            },
            patches: region.patches(),
            tissues: &tissues,
            others: &others,
            untold: untold(fit.tissue().map(|fit| fit.best().structured_mm)),
            posture: seen.map_or(posture, |off_mm| posture.seen(off_mm)),
        };
        match tumour_interval(&question, work.progress.part(0.4, 1.0)) {
            Ok(found) => Ok(told(&question, found, work)),
            Err(error) if stopped(&error) => Err(error.into()),
            Err(error) => {
                let text = format!(
                    "the uncertainty of the tumour position could not be computed: {error}"
                );
                work.warn(Warning::new("interval-without-solution", text));
                Ok(Known::default())
            }
        }
    }

    fn facts(out: &Known) -> Result<serde_json::Value, Error> {
        Ok(serde_json::to_value(out)?)
    }

    fn load(facts: serde_json::Value, _: &Work<'_>) -> Result<Known, Error> {
        Ok(serde_json::from_value(facts)?)
    }
}

/// What was fitted with the proportion of gland, of skin, and of the tumour, another one by a
/// standard deviation.
fn other_tissues(fit: Option<&TissueFit>) -> Vec<TissueFit> {
    let of = |which: usize| {
        let mut other = fit?.clone();
        let by = other.states.first_mut()?.tissues.as_mut()?;
        let factor = by.deviations[which].exp();
        *[&mut by.gland, &mut by.skin, &mut by.tumour][which] *= factor;
        Some(other)
    };
    [0, 1, 2].into_iter().filter_map(of).collect()
}

/// What is known of the modulus: what was fitted, what the case says, or what the literature has.
fn prior(given: Option<[f64; 2]>, fit: Option<&TissueFit>) -> Result<ModulusPrior, Error> {
    let Some(fit) = fit else {
        return Ok(given.map_or_else(|| Ok(ModulusPrior::literature()), ModulusPrior::given)?);
    };
    let known = |state: &StateFit| LogNormal::new(state.young_kpa, state.deviation);
    let other = fit.states.get(1).filter(|_| !fit.decided);
    Ok(ModulusPrior::fitted(known(fit.best()), other.map(known)))
}

/// The same tissue on fewer tetrahedra, where that saves time: the curves over the modulus hardly
/// depend on the mesh.
pub(crate) fn coarser(
    body: &Body,
    count: usize,
    refinement: &Refinement,
    progress: Progress<'_>,
) -> Result<Body, Error> {
    // Moduli that differ belong to the tetrahedra that they were found for.
    if body.mesh.tets().len() < 2 * count || body.young_kpa.is_some() {
        return Ok(body.clone());
    }
    match supine_tetrahedralise::coarsen(&body.mesh, count, refinement, progress) {
        Ok((mesh, _)) => Ok(Body::new(Arc::new(mesh), body.tissue)),
        Err(error) if error.kind() == Failure::Stopped => Err(Error::Mesh(error)),
        // A shape that wants more tetrahedra has them: slower, not worse.
        Err(_) => Ok(body.clone()),
    }
}

/// Whether the user stopped it.
fn stopped(error: &supine_personalise::Error) -> bool {
    error.kind() == Failure::Stopped
}

/// The error at a place of the wall, mm: that of the voxels around that know one, at most
/// [`WALL_MM`] away; [`UNCERTAIN_MM`] where none does.
pub(crate) fn wall_error_mm(map: &Volume<u8>, place: &Point) -> f64 {
    let Ok(around) = supine_space::Sphere::new(*place, WALL_MM) else { return UNCERTAIN_MM };
    let Some((start, part)) = map.grid().around(&around) else { return UNCERTAIN_MM };
    let whole = |n: usize| {
        let voxel = part.voxel(n);
        [0, 1, 2].map(|a| voxel[a] + start[a])
    };
    let largest = (0..part.len()).map(|n| map.at(whole(n))).max().unwrap_or(0);
    match largest {
        0 => UNCERTAIN_MM,
        tenths => f64::from(tenths) / f64::from(UNCERTAINTY_PER_MM),
    }
}

/// What was found in the words of the summary.
fn told(
    question: &Question<'_>,
    found: supine_personalise::TumourInterval,
    work: &Work<'_>,
) -> Known {
    work.warn_all(found.warnings);
    let centre = question.tumour.centre();
    let prior = question.prior;
    let modulus = ModulusKnown {
        young_kpa: prior.known().interval_kpa(),
        median_kpa: prior.known().median_kpa(),
        origin: prior.origin(),
        softest_unloaded_kpa: found.softest_unloaded_kpa,
    };
    let interval = TumourInterval {
        level: LEVEL,
        within_mm: found.within_mm,
        length_mm: found.length_mm,
        components_mm: found.components_mm,
        ellipsoid: Ellipsoid {
            centre_mm: (centre + found.ellipsoid.centre).coords.into(),
            semi_axes_mm: found.ellipsoid.axes.map(<[f64; 3]>::from),
        },
        modulus,
        other_rest: found.other.map(|other| OtherRest {
            rest: other.rest,
            displacement_mm: other.displacement.map(|u: Vector| u.into()),
        }),
        shares: found.shares.clone(),
    };
    Known { interval: Some(interval), effects_mm: found.patch_effects_mm.clone() }
}

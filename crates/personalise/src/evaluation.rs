//! A scan on the operating table held against the model.
//!
//! The pose comes from the torso beside the breasts alone: on the breast a wrong model would draw
//! it along and look right. What is measured is how far the skin lies off along its normal. That is
//! not the error of the tumour: skin that slides, and what happens below it, is not seen.

use crate::distances::{distances, spread};
use crate::fit::REACH_MM;
use crate::{Carried, Error, Part};
use supine_mesh::{Displacement, Scan, ScanDistances};
use supine_record::SkinDistances;
use supine_register::{Params, Rigid, Start, align, candidates};
use supine_space::{Point, Pose, Progress};

/// Radius of the part of the skin around the point that is nearest to the tumour, mm. Source: the
/// paper that this program follows, table 2.
pub const NEAR_MM: f64 = 20.0;
/// Name of the skin of the CT as it lies.
const CT: &str = "ct";
/// Reach of the loss at first and at last, mm.
const REACH: [f64; 2] = [20.0, REACH_MM];
/// Poses that are followed when none is given.
const POSES: usize = 3;

/// What is held against what.
#[derive(Clone, Copy, Debug)]
pub struct EvaluationQuestion<'a> {
    /// The skin with respect to the mesh.
    pub carried: &'a Carried,
    /// How the mesh is displaced in each model that is compared, with its name; the last is that of
    /// the run.
    pub models: &'a [(&'a str, &'a Displacement)],
    /// The scan, in a frame of its own.
    pub scan: &'a Scan,
    /// Its pose, roughly; searched when absent.
    pub pose: Option<Pose>,
    /// The middle of the breast, LPS, mm.
    pub centre: Point,
    /// Where the run says that the tumour comes to, LPS, mm.
    pub tumour: Point,
}

/// How far the scan lies off the skin of the CT, and off that of each model.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// From the scan's frame to the patient's.
    pub pose: Pose,
    /// Residuals of the torso, mm rms.
    pub torso_mm: f64,
    /// The point of the run's skin nearest to the tumour, LPS, mm.
    pub near: Point,
    /// Its points: first their distances from the skin of the CT, then from each model.
    pub distances: ScanDistances,
}

impl Evaluation {
    /// Of each surface its name, and what the distances from it come to near the tumour and on the
    /// whole breast.
    pub fn spreads(&self) -> impl Iterator<Item = (&str, [SkinDistances; 2])> {
        let all = &self.distances;
        let near = |n: usize| (all.places[n] - self.near).norm() <= NEAR_MM;
        all.surfaces.iter().map(move |surface| {
            let spreads = [spread(all, surface, near), spread(all, surface, |n| all.breast[n])];
            (surface.name.as_str(), spreads)
        })
    }
}

/// Holds a scan against the skin of a CT and that of models.
///
/// # Errors
/// When the scan does not lie on the torso, and when the user stops.
pub fn evaluate(
    question: &EvaluationQuestion<'_>,
    progress: Progress<'_>,
) -> Result<Evaluation, Error> {
    let carried = question.carried;
    let (pose, torso_mm) = on_torso(question, progress.part(0.0, 0.8))?;
    let mut surfaces = vec![(CT, carried.points.clone())];
    let moved = question.models.iter();
    surfaces.extend(moved.map(|(name, u)| (*name, carried.displaced(&carried.carry(u)))));
    let last = surfaces.last().map_or(&carried.points, |(_, points)| points);
    let near = nearest(carried, last, &question.tumour);
    let distances = distances(question.scan, &pose, carried, &surfaces);
    progress.at(1.0)?;
    Ok(Evaluation { pose, torso_mm, near, distances })
}

/// The pose of the scan on the torso, and what is left there, mm rms.
fn on_torso(
    question: &EvaluationQuestion<'_>,
    progress: Progress<'_>,
) -> Result<(Pose, f64), Error> {
    // The breast tells where the scan lies, roughly: it moves by centimetres at most.
    let starts = match question.pose {
        Some(pose) => vec![pose],
        None => {
            let whole = skin_of(question.carried, |part| part != Part::Unknown);
            let ranked = candidates(question.scan, &whole, &[], progress.part(0.0, 0.8))?;
            ranked.into_iter().take(POSES).map(|(_, pose)| pose).collect()
        }
    };
    let torso = skin_of(question.carried, |part| part == Part::Torso);
    let params = Params {
        centre: question.centre,
        reach_mm: REACH,
        iterations: 60,
        pose: true,
        prior_mm2: 0.0,
        counts: None,
    };
    let on = |pose: Pose| {
        let start = Start { pose, values: vec![] };
        align(question.scan, &torso, &start, &params, progress.part(0.8, 1.0))
    };
    let mut aligned = starts.into_iter().map(on).collect::<Result<Vec<_>, _>>()?;
    aligned.sort_by(|a, b| a.objective_mm2.total_cmp(&b.objective_mm2));
    let points = question.scan.points().len();
    let best = aligned.first().ok_or(supine_register::Error::Apart { matched: 0, points })?;
    let near = best.matches.0.iter().map(|m| m.residual_mm);
    let near: Vec<f64> = near.filter(|r| r.abs() < REACH_MM).collect();
    let squares = near.iter().map(|r| r * r).sum::<f64>();
    Ok((best.pose, (squares / near.len().max(1) as f64).sqrt()))
}

/// The skin of the CT, of which some parts count.
fn skin_of(carried: &Carried, counts: impl Fn(Part) -> bool) -> Rigid {
    Rigid {
        points: carried.points.clone(),
        triangles: carried.triangles.clone(),
        weights: carried.parts.iter().map(|part| f64::from(u8::from(counts(*part)))).collect(),
    }
}

/// The point of the breast's skin nearest to the tumour.
fn nearest(carried: &Carried, points: &[Point], tumour: &Point) -> Point {
    let parts = carried.parts.iter();
    let own = parts.zip(points).filter(|(part, _)| matches!(part, Part::Breast | Part::Edge));
    let off = |p: &Point| (p - tumour).norm_squared();
    own.map(|(_, p)| *p).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(*tumour)
}

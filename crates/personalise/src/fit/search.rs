//! The path of moduli on the coarse mesh.

use super::FitQuestion;
use super::carried::Carried;
use super::family::Family;
use crate::Error;
use nalgebra::{Rotation3, Unit};
use supine_fem::{Params, RestState, Sequence};
use supine_mesh::Displacement;
use supine_record::FitStep;
use supine_register::{Aligned, Rigid, Shape, Start, align};
use supine_space::{Pose, Progress, Vector};

/// The stiffest modulus tried at first where nothing is known, kPa.
pub(super) const STIFFEST_KPA: f64 = 4.4;
/// The factor from each to the next softer one.
const FACTOR: f64 = 1.38;
/// The path ends at this modulus, kPa: softer tissue than any that was measured.
const SOFTEST_KPA: f64 = 0.12;
/// Stiffer than this no breast moves enough to tell, kPa.
const RIGID_KPA: f64 = 25.0;
/// Distance of the points of the scan along the path, mm.
const PATH_MM: f64 = 6.0;
/// Of those for the joint fit, and where laws are compared.
pub(super) const JOINT_MM: f64 = 3.0;
/// Moduli that are tried before the stiffest of them is said to fit best.
const FIRST: usize = 5;
/// The turn of gravity that is solved, degrees.
const TURN_DEG: f64 = 5.0;
/// Most iterations of an alignment.
const ITERATIONS: usize = 40;
/// Iterations of Newton's method on the path: where more are needed the shape is near its end.
const PATIENCE: usize = 25;

/// Relative residual of solutions that are held against a scan: they are then right to 1e-4 mm.
const TOLERANCE: f64 = 1e-6;

/// What the path found.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) aligned: Aligned,
    pub(super) path: Vec<FitStep>,
    pub(super) ended: Option<String>,
    /// As of [`super::StateFit::other_pose`].
    pub(super) other_pose: Option<f64>,
}

/// Poses nearer than this are one: mm at the breast, and degrees.
const SAME: (f64, f64) = (10.0, 8.0);

/// The best of a path.
struct Best {
    objective: f64,
    kpa: f64,
    pose: Pose,
    /// The objective of the next pose that is another, over that of the best.
    other: Option<f64>,
}

/// The best modulus and pose on the coarse mesh, from a modulus (kPa) to softer ones.
pub(super) fn search(
    question: &FitQuestion<'_>,
    carried: &Carried,
    rest: RestState,
    from_kpa: f64,
    progress: Progress<'_>,
) -> Result<Found, Error> {
    let sparse = question.scan.thinned(PATH_MM);
    let params = Params { max_iterations: PATIENCE, ..question.solver(rest) };
    let mut sequence = Sequence::new(question.coarse, question.load.ct, &params)?;
    let mut family = Family::new(carried);
    let mut path: Vec<FitStep> = Vec::new();
    let (mut best, mut ended): (Option<Best>, Option<String>) = (None, None);
    let mut poses = question.poses.to_vec();
    let mut kpa = from_kpa;
    while kpa > SOFTEST_KPA && !risen(&path) {
        progress.at((path.len() as f64 / 10.0).min(0.9))?;
        match Solved::at(question, &mut sequence, (kpa, false), Progress::none()) {
            Ok(solved) => solved.add_to(&mut family),
            Err(stopped @ supine_fem::Error::Stopped(_)) => return Err(stopped.into()),
            Err(_) if path.is_empty() && kpa < RIGID_KPA => {
                kpa *= FACTOR;
                continue;
            }
            Err(error) => {
                ended = Some(error.to_string());
                break;
            }
        }
        let reach_mm = if path.is_empty() { [20.0, 6.0] } else { [8.0, 6.0] };
        let fixed = fixed(&family, carried, kpa);
        let mut ranked: Vec<(f64, Pose)> = Vec::new();
        for pose in &mut poses {
            let start = Start { pose: *pose, values: vec![] };
            let params = question.params_of(reach_mm, ITERATIONS);
            let aligned = align(&sparse, &fixed, &start, &params, progress)?;
            *pose = aligned.pose;
            ranked.push((aligned.objective_mm2, aligned.pose));
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let Some(&(objective, pose)) = ranked.first() else { break };
        path.push(FitStep { young_kpa: kpa, objective_mm2: objective });
        // The loss of a small residual r is r²/2.
        let off_mm = (2.0 * objective).sqrt();
        progress.found(&format!("{}: {kpa:.3} kPa, scan {off_mm:.2} mm off", rest.name()));
        if best.as_ref().is_none_or(|best| objective < best.objective) {
            let other = question.other_than(&pose, &ranked).map(|other| other / objective);
            best = Some(Best { objective, kpa, pose, other });
        }
        kpa /= FACTOR;
    }
    let Some(Best { kpa, pose, other: other_pose, .. }) = best else {
        return Err(Error::NoPath { rest, why: ended.unwrap_or_default() });
    };
    // Stiffer tissue moves less and less: the scan then tells that the breast hardly moved.
    if path.len() > 1 && path[0].young_kpa <= kpa {
        return Err(Error::Still { rest, young_kpa: kpa });
    }
    let start = Start { pose, values: vec![kpa.ln()] };
    let scan = question.scan.thinned(JOINT_MM);
    let aligned = align(
        &scan,
        &family,
        &start,
        &question.params_of([6.0, 4.0], ITERATIONS),
        progress.part(0.9, 1.0),
    )?;
    Ok(Found { aligned, path, ended, other_pose })
}

/// What the mechanics gives at a modulus.
pub(super) struct Solved {
    kpa: f64,
    displacement: Displacement,
    /// By the modulus, mm/kPa.
    slope: Displacement,
    /// With gravity turned by [`TURN_DEG`].
    turned: Option<Displacement>,
}

impl Solved {
    pub(super) fn at(
        question: &FitQuestion<'_>,
        sequence: &mut Sequence,
        (kpa, turned): (f64, bool),
        progress: Progress<'_>,
    ) -> Result<Self, supine_fem::Error> {
        let solution = sequence.at(kpa, question.load.target, true, progress.part(0.0, 0.5))?;
        let slope = solution.slope.ok_or(supine_fem::Error::Singular)?;
        let turned = match turned {
            true => {
                let gravity = question.turned(TURN_DEG);
                let there = sequence.at(kpa, gravity, false, progress.part(0.5, 1.0))?;
                Some(there.deformation.displacement().clone())
            }
            false => None,
        };
        let displacement = solution.deformation.displacement().clone();
        Ok(Self { kpa, displacement, slope, turned })
    }

    pub(super) fn add_to(&self, family: &mut Family<'_>) {
        let turned = self.turned.as_ref().map(|turned| (turned, TURN_DEG));
        family.add(self.kpa, &self.displacement, &self.slope, turned);
    }
}

/// The skin at one modulus.
fn fixed(family: &Family<'_>, carried: &Carried, kpa: f64) -> Rigid {
    Rigid {
        points: family.points(&[kpa.ln()]),
        triangles: carried.triangles.clone(),
        weights: carried.weights.clone(),
    }
}

/// Whether the objective has risen since its least: the best modulus then lies between its
/// neighbours. That of the first is not believed at once: the pose is still rough there.
fn risen(path: &[FitStep]) -> bool {
    let least = path.iter().map(|p| p.objective_mm2).fold(f64::INFINITY, f64::min);
    let at = path.iter().position(|p| p.objective_mm2 <= least).unwrap_or(0);
    path.len() > if at == 0 { FIRST } else { at + 1 }
}

impl FitQuestion<'_> {
    /// How solutions are found that are held against the scan.
    pub(super) fn solver(&self, rest: RestState) -> Params {
        Params { rest, tolerance: TOLERANCE, ..*self.params }
    }

    /// Gravity of the scan turned so far towards that of the CT: the patient leans back.
    fn turned(&self, degrees: f64) -> Vector {
        let axis = self.load.target.cross(&self.load.ct);
        let Some(axis) = Unit::try_new(axis, 1e-9) else { return self.load.target };
        Rotation3::from_axis_angle(&axis, degrees.to_radians()) * self.load.target
    }

    /// The least objective of those of another pose.
    fn other_than(&self, pose: &Pose, found: &[(f64, Pose)]) -> Option<f64> {
        let apart = |other: &Pose| {
            let moved = (other * (pose.inverse() * self.centre) - self.centre).norm();
            let turn = other.rotation.angle_to(&pose.rotation).to_degrees();
            moved > SAME.0 || turn > SAME.1
        };
        found.iter().find(|(_, other)| apart(other)).map(|(objective, _)| *objective)
    }

    /// How poses and moduli are sought.
    pub(super) fn params_of(
        &self,
        reach_mm: [f64; 2],
        iterations: usize,
    ) -> supine_register::Params<'_> {
        supine_register::Params {
            centre: self.centre,
            reach_mm,
            iterations,
            pose: true,
            prior_mm2: 0.0,
            counts: None,
        }
    }
}

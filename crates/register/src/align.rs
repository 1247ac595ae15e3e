//! Pose and shape together, by Gauss-Newton on robust distances to planes.
//!
//! Each point s of the scan belongs to the nearest point V of the surface with normal n; its
//! residual is r = n · (R s + t − V(p)). Sought is the minimum of Σ w ρ(r) / Σ w over the pose (R,
//! t) and the parameters p, with ρ Tukey's biweight, whose reach falls from iteration to iteration.
//! A step solves the normal equations of the derivatives of r: (q × n, n) by a turn about and a
//! shift of the centre, with q the place from there, and −n · ∂V/∂p.
//!
//! Source: point-to-plane distance, Chen and Medioni, Image Vision Comput. 10, 1992; the reach that
//! falls, as in graduated non-convexity, Blake and Zisserman 1987.

use crate::{Error, Match, Matches, Posed, Shape, Tukey};
use nalgebra::{DMatrix, DVector, Translation3, UnitQuaternion};
use rayon::prelude::*;
use supine_mesh::Scan;
use supine_space::{Point, Pose, Progress, Vector};

/// Factor of the reach from one iteration to the next.
const NARROWER: f64 = 0.7;
/// A point of the scan farther from the surface than this many reaches is not looked at, nor one
/// nearer left out: mm.
const WITHIN: (f64, f64) = (3.0, 8.0);
/// A step below this length, mm, at the rim of the breast ends the iteration.
const STEP_MM: f64 = 2e-3;
/// Distance of the rim of a breast from its centre, mm: what a turn moves.
const LEVER_MM: f64 = 80.0;
/// A change of the parameters by this share of what is one iteration's largest counts as one of
/// [`STEP_MM`].
const STEP_SHARE: f64 = 4e-4;
/// The iteration also ends when the objective has not fallen by this share in as many iterations:
/// nearest points flicker.
const FLAT: (f64, usize) = (1e-5, 4);
/// So few points fix no pose.
const LEAST: usize = 200;
/// Points whose sums are made by one thread: fixed, so that the sum is the same on any number.
const CHUNK: usize = 512;

/// Where to begin.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// From the scan's frame to the patient's.
    pub pose: Pose,
    /// Of the shape's parameters.
    pub values: Vec<f64>,
}

/// How to align.
#[derive(Clone, Copy, Debug)]
pub struct Params<'a> {
    /// What the pose turns about, LPS, mm: the middle of what counts.
    pub centre: Point,
    /// Reach of the loss at first and at last, mm.
    pub reach_mm: [f64; 2],
    /// Most iterations.
    pub iterations: usize,
    /// Whether the pose is sought too.
    pub pose: bool,
    /// Variance of the residuals over the number of points that tell on their own, mm²: what a
    /// deviation of a parameter from its prior costs beside them.
    pub prior_mm2: f64,
    /// How often each point of the scan counts; all once when absent.
    pub counts: Option<&'a [f64]>,
}

/// A scan on a surface.
#[derive(Clone, Debug)]
pub struct Aligned {
    /// From the scan's frame to the patient's.
    pub pose: Pose,
    /// Of the shape's parameters.
    pub values: Vec<f64>,
    /// Σ w ρ(r) / Σ w at the last reach, mm²; the priors' part is in it.
    pub objective_mm2: f64,
    /// Second derivatives of the objective by turn (rad), shift (mm) and parameters, without those
    /// of the loss.
    pub information: DMatrix<f64>,
    /// The points that belong to the surface.
    pub matches: Matches,
    /// Whether each parameter ended at the end of its range.
    pub at_end: Vec<bool>,
    /// Iterations made.
    pub iterations: usize,
}

/// The pose of a scan on a shape and the shape's parameters.
///
/// # Errors
/// [`Error::Apart`] when hardly a point of the scan lies on the surface, [`Error::Open`] when they
/// leave the pose open, and when the user stops.
pub fn align(
    scan: &Scan,
    shape: &dyn Shape,
    start: &Start,
    params: &Params<'_>,
    progress: Progress<'_>,
) -> Result<Aligned, Error> {
    let posed = Posed::new(shape, &start.values);
    let search = Search { scan, shape, params, pose: start.pose, values: start.values.clone() };
    search.run(posed, false, progress)
}

/// As [`align`], from a shape at the start's values that is known, for parameters that hardly
/// change: its points move along their slopes, and which of them is nearest and the normals stay.
///
/// # Errors
/// As [`align`].
pub fn align_near(
    scan: &Scan,
    shape: &dyn Shape,
    posed: &Posed,
    start: &Start,
    params: &Params<'_>,
) -> Result<Aligned, Error> {
    let search = Search { scan, shape, params, pose: start.pose, values: start.values.clone() };
    search.run(posed.clone(), true, Progress::none())
}

/// What changes from iteration to iteration.
struct Search<'a> {
    scan: &'a Scan,
    shape: &'a dyn Shape,
    params: &'a Params<'a>,
    pose: Pose,
    values: Vec<f64>,
}

/// Sums over matches.
struct Sums {
    /// Σ w w_ρ J Jᵀ.
    h: DMatrix<f64>,
    /// Σ w w_ρ r J.
    g: DVector<f64>,
    /// Σ w ρ(r), mm².
    loss: f64,
    /// Σ w.
    weight: f64,
}

impl Search<'_> {
    /// Iterates from where it stands; `near` as of [`align_near`].
    fn run(
        mut self,
        mut posed: Posed,
        near: bool,
        progress: Progress<'_>,
    ) -> Result<Aligned, Error> {
        let [mut reach, last] = self.params.reach_mm;
        let (mut best, mut since, mut iterations) = (f64::INFINITY, 0, 0);
        while iterations < self.params.iterations {
            progress.at(iterations as f64 / self.params.iterations as f64)?;
            iterations += 1;
            let matches = self.matches(&posed, reach);
            let sums = self.sums(&posed, &matches, reach)?;
            let step = self.step(&sums)?;
            let before = self.values.clone();
            match (self.take(&step), near) {
                (false, _) => {}
                (true, false) => posed = Posed::new(self.shape, &self.values),
                (true, true) => {
                    let pairs = self.values.iter().zip(&before);
                    posed.shift(&pairs.map(|(new, old)| new - old).collect::<Vec<_>>());
                }
            }
            if reach > last {
                reach = (reach * NARROWER).max(last);
                continue;
            }
            let objective = sums.loss / sums.weight;
            since = if objective < best * (1.0 - FLAT.0) { 0 } else { since + 1 };
            best = best.min(objective);
            if self.length(&step) < STEP_MM || since >= FLAT.1 {
                break;
            }
        }
        self.end(&posed, last, iterations)
    }

    /// Sought numbers: turn, shift, parameters.
    fn unknowns(&self) -> usize {
        6 + self.values.len()
    }

    fn matches(&self, posed: &Posed, reach_mm: f64) -> Matches {
        let within = (WITHIN.0 * reach_mm).max(WITHIN.1);
        Matches::new(self.scan, &self.pose, posed, self.shape.weights(), within)
    }

    /// The normal equations.
    fn sums(&self, posed: &Posed, matches: &Matches, reach_mm: f64) -> Result<Sums, Error> {
        if matches.0.len() < LEAST {
            let (matched, points) = (matches.0.len(), self.scan.points().len());
            return Err(Error::Apart { matched, points });
        }
        let (n, loss) = (self.unknowns(), Tukey { reach_mm });
        let zero =
            || Sums { h: DMatrix::zeros(n, n), g: DVector::zeros(n), loss: 0.0, weight: 0.0 };
        let part = |chunk: &[Match]| {
            let mut sums = zero();
            let mut row = vec![0.0; n];
            for m in chunk {
                let weight =
                    m.weight * self.params.counts.map_or(1.0, |counts| counts[m.of as usize]);
                self.row(posed, m, &mut row);
                sums.add(&row, m.residual_mm, weight, loss);
            }
            sums
        };
        let parts: Vec<Sums> = matches.0.par_chunks(CHUNK).map(part).collect();
        Ok(parts.into_iter().fold(zero(), Sums::plus))
    }

    /// Derivatives of a residual.
    fn row(&self, posed: &Posed, m: &Match, row: &mut [f64]) {
        let nearest = m.nearest as usize;
        let normal = &posed.normals[nearest];
        let turn = (m.place - self.params.centre).cross(normal);
        for a in 0..3 {
            let pose = f64::from(u8::from(self.params.pose));
            (row[a], row[3 + a]) = (pose * turn[a], pose * normal[a]);
        }
        for (slot, slopes) in row[6..].iter_mut().zip(posed.slopes.iter()) {
            *slot = -normal.dot(&slopes[nearest]);
        }
    }

    /// The Gauss-Newton step, priors included.
    fn step(&self, sums: &Sums) -> Result<DVector<f64>, Error> {
        let (mut h, mut g) = (&sums.h / sums.weight, &sums.g / sums.weight);
        for (k, (prior, value)) in self.shape.priors().iter().zip(&self.values).enumerate() {
            let pull = self.params.prior_mm2 / prior.deviation.powi(2);
            h[(6 + k, 6 + k)] += pull;
            g[6 + k] += pull * (value - prior.mean);
        }
        if !self.params.pose {
            (0..6).for_each(|k| h[(k, k)] = 1.0);
        }
        let factor = h.cholesky().ok_or(Error::Open)?;
        let mut step = -factor.solve(&g);
        for (k, prior) in self.shape.priors().iter().enumerate() {
            step[6 + k] = step[6 + k].clamp(-prior.step, prior.step);
        }
        Ok(step)
    }

    /// Goes a step; whether a parameter changed.
    fn take(&mut self, step: &DVector<f64>) -> bool {
        let turn = UnitQuaternion::from_scaled_axis(Vector::new(step[0], step[1], step[2]));
        let about = self.params.centre;
        let moved = Pose::rotation_wrt_point(turn, about) * self.pose;
        self.pose = Translation3::new(step[3], step[4], step[5]) * moved;
        let old = self.values.clone();
        for (k, prior) in self.shape.priors().iter().enumerate() {
            self.values[k] = (self.values[k] + step[6 + k]).clamp(prior.range[0], prior.range[1]);
        }
        old != self.values
    }

    /// How far a step moves the surface, mm; a step of the parameters in proportion to their
    /// largest.
    fn length(&self, step: &DVector<f64>) -> f64 {
        let turn = LEVER_MM * step.rows(0, 3).amax();
        let priors = self.shape.priors().iter().enumerate();
        let values = priors.map(|(k, prior)| step[6 + k].abs() / prior.step * STEP_MM / STEP_SHARE);
        values.fold(turn.max(step.rows(3, 3).amax()), f64::max)
    }

    fn end(&self, posed: &Posed, reach_mm: f64, iterations: usize) -> Result<Aligned, Error> {
        let matches = self.matches(posed, reach_mm);
        let sums = self.sums(posed, &matches, reach_mm)?;
        let priors = self.shape.priors();
        let pulls = priors.iter().zip(&self.values).map(|(prior, value)| {
            0.5 * self.params.prior_mm2 * ((value - prior.mean) / prior.deviation).powi(2)
        });
        let at_end = priors.iter().zip(&self.values).map(|(prior, v)| prior.range.contains(v));
        Ok(Aligned {
            pose: self.pose,
            values: self.values.clone(),
            objective_mm2: sums.loss / sums.weight + pulls.sum::<f64>(),
            information: sums.h / sums.weight,
            at_end: at_end.collect(),
            matches,
            iterations,
        })
    }
}

impl Sums {
    fn add(&mut self, row: &[f64], residual: f64, weight: f64, loss: Tukey) {
        let pull = weight * loss.weight(residual);
        for (i, a) in row.iter().enumerate() {
            self.g[i] += pull * residual * a;
            for (j, b) in row.iter().enumerate() {
                self.h[(i, j)] += pull * a * b;
            }
        }
        self.loss += weight * loss.loss(residual);
        self.weight += weight;
    }

    fn plus(mut self, other: Self) -> Self {
        self.h += other.h;
        self.g += other.g;
        self.loss += other.loss;
        self.weight += other.weight;
        self
    }
}

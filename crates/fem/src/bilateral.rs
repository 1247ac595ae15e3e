//! Tissue that follows a rigid body or slides on it: steps from one pose to the next.

use crate::newton::{Limits, Newton};
use crate::outcome::{Cause, NonConvergence, SolveError, Step};
use crate::quasi_newton::{Budget, Memory, error_mm, largest};
use crate::site::{ContactSite, MOTIONS, Responses, TissueState};
use crate::tangent::Tangent;
use supine_space::{Pose, Progress, Vector};

/// Corrections of a step; more mean that the factor is too old.
const CORRECTIONS: usize = 10;
/// The first guess how much of an error a correction leaves when the rigid body has moved by its
/// size since the factor was made; how fast a guess that proved too high falls; and the lowest that
/// is believed.
const FIRST_RATE: f64 = 4.0;
const RATE_FALL: f64 = 0.8;
const MIN_RATE: f64 = 0.05;
/// A correction may be so many times the one before.
const GROWTH: f64 = 2.0;
/// Newton iterations of a part of a motion; one that needs more is halved. Chosen, not measured.
const ITERATIONS: usize = 40;
/// The smallest part of a motion that is tried alone.
const SMALLEST_PART: f64 = 1.0 / 64.0;

/// What the last step taught.
struct PredictorCorrection {
    motion: [f64; MOTIONS],
    /// What its prediction lacked.
    lack: Vec<f64>,
}

/// What is kept of tissue that follows a rigid body.
pub(crate) struct BilateralContact {
    responses: Responses,
    /// Room of the responses before the last ones.
    spare: Option<Tangent>,
    correction: Option<PredictorCorrection>,
    /// What corrections have shown of the stiffness since the factor was made.
    memory: Memory,
    /// Share of the error that a correction leaves when the body has moved by its size since the
    /// factor was made; in between it is taken for proportional to the way.
    rate: f64,
}

impl BilateralContact {
    /// Begins with these responses.
    pub(crate) fn new(responses: Responses) -> Self {
        let memory = Memory::default();
        Self { responses, spare: None, correction: None, memory, rate: FIRST_RATE }
    }

    /// Settles the tissue at the first pose, and makes the responses there.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn begin<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        place: &mut TissueState,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<(), SolveError> {
        self.settle((site, place), &Pose::identity(), goal, progress)?;
        if let Some(responses) = site.responses(place, self.spare.take())? {
            self.adopt(responses);
        }
        Ok(())
    }

    /// Takes responses made for another place of the same site.
    pub(crate) fn adopt(&mut self, responses: Responses) {
        let before = std::mem::replace(&mut self.responses, responses);
        self.spare = Some(before.tangent);
        self.memory = Memory::default();
    }

    /// Room for new responses.
    pub(crate) fn take_spare(&mut self) -> Option<Tangent> {
        self.spare.take()
    }

    /// Moves the rigid body to `pose` and lets the tissue follow.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn step<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        place: &mut TissueState,
        pose: &Pose,
    ) -> Result<Step, SolveError> {
        if let Some(made) = self.step_quickly(site, place, pose, Budget::whole(CORRECTIONS)) {
            return Ok(made);
        }
        self.settle((site, place), pose, 1e-8, Progress::none())
    }

    /// Moves the rigid body to `pose` by the factor at hand; `None`, and nothing has moved, when
    /// that does not suffice.
    pub(crate) fn step_quickly<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        place: &mut TissueState,
        pose: &Pose,
        budget: Budget,
    ) -> Option<Step> {
        let Some((found, made)) = self.corrected((site, place), pose, budget) else {
            self.correction = None;
            self.memory = Memory::default();
            return None;
        };
        *place = found;
        Some(made)
    }

    /// The new place by prediction and corrections with the factor at hand; `None` when they do not
    /// reach it.
    fn corrected<const N: usize, const Q: usize>(
        &mut self,
        (site, place): (&ContactSite<N, Q>, &TissueState),
        pose: &Pose,
        budget: Budget,
    ) -> Option<(TissueState, Step)> {
        let motion = site.motion(&place.pose, pose);
        let slide = site.slide(pose);
        let (mut u, curvature) = self.predicted((site, place), pose, &motion)?;
        self.memory.rest();
        let mut lack = curvature;
        let mut last = f64::INFINITY;
        let way = site.motion(&self.responses.pose, pose);
        let way = way.iter().map(|v| v * v).sum::<f64>().sqrt() / site.size_mm;
        // What a correction leaves of the error.
        let mut left = (self.rate * way).clamp(MIN_RATE, 1.0);
        for corrections in 1..=budget.corrections {
            let mut forces = site.out_of_balance(&u)?;
            if let Some(slide) = &slide {
                slide.project(&u, &mut forces)?;
            }
            let residual = site.pattern.gather(&forces);
            let tangent = &mut self.responses.tangent;
            let step = self.memory.step(residual, |x| tangent.apply_factor(x))?;
            let size = largest(&step);
            if size.is_nan() || size > (GROWTH * last).min(site.size_mm) {
                return None;
            }
            site.pattern.add_to(&mut u, &step);
            if slide.as_ref().is_some_and(|slide| !slide.bring(&mut u)) {
                return None;
            }
            lack.iter_mut().zip(&step).for_each(|(lack, step)| *lack += step);
            if corrections > 1 {
                let seen = size / last;
                self.rate = (seen / way).max(RATE_FALL * self.rate);
                left = left.max(seen);
            }
            let error_mm = error_mm(size, left);
            if budget.is_met(corrections, error_mm, size < last) {
                self.correction = Some(PredictorCorrection { motion, lack });
                let made = Step { corrections, error_mm, by_newton: false };
                return Some((TissueState { pose: *pose, u }, made));
            }
            last = size;
        }
        None
    }

    /// The displacement at `pose` to first order, and with what the last step lacked where this one
    /// goes on in its direction: half the second derivative along it. The second value is that
    /// part. `None` when a node cannot be brought to where it slides.
    pub(crate) fn predicted<const N: usize, const Q: usize>(
        &self,
        (site, place): (&ContactSite<N, Q>, &TissueState),
        pose: &Pose,
        motion: &[f64; MOTIONS],
    ) -> Option<(Vec<Vector>, Vec<f64>)> {
        let mut step = vec![0.0; site.pattern.unknowns()];
        for (length, column) in motion.iter().zip(&self.responses.columns) {
            if *length != 0.0 {
                step.iter_mut().zip(column).for_each(|(step, c)| *step += length * c);
            }
        }
        let mut curvature = vec![0.0; step.len()];
        if let Some(PredictorCorrection { motion: last, lack }) = &self.correction {
            let along: f64 = motion.iter().zip(last).map(|(a, b)| a * b).sum();
            let square: f64 = last.iter().map(|v| v * v).sum();
            let share = if square > 0.0 { (along / square).clamp(0.0, 1.5) } else { 0.0 };
            curvature.iter_mut().zip(lack).for_each(|(c, l)| *c = share * share * l);
            step.iter_mut().zip(&curvature).for_each(|(step, c)| *step += c);
        }
        let mut u = place.u.clone();
        site.pattern.add_to(&mut u, &step);
        site.put(pose, &mut u).then_some((u, curvature))
    }

    /// Moves the rigid body to `pose` by Newton's method, in parts where the whole way folds an
    /// element, to a relative residual of `goal`.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn settle<const N: usize, const Q: usize>(
        &mut self,
        (site, place): (&ContactSite<N, Q>, &mut TissueState),
        pose: &Pose,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Step, SolveError> {
        let first = place.pose;
        let (mut share, mut part) = (0.0, 1.0f64);
        let mut corrections = 0;
        while share < 1.0 {
            let next = (share + part).min(1.0);
            let between = if next < 1.0 { site.between(&first, pose, next) } else { *pose };
            // A shorter part starts from the same place.
            if self.responses.pose != place.pose
                && let Some(responses) = site.responses(place, self.spare.take())?
            {
                self.adopt(responses);
            }
            self.correction = None;
            let motion = site.motion(&place.pose, &between);
            let Some((u, _)) = self.predicted((site, place), &between, &motion) else {
                if part <= SMALLEST_PART {
                    let (cause, residual, u) = (Cause::Start, f64::INFINITY, place.u.clone());
                    return Err(SolveError::NotConverged(NonConvergence {
                        cause,
                        residual,
                        u,
                        load_share: share,
                    }));
                }
                part *= 0.5;
                continue;
            };
            let model = site.model_at(&between);
            let limits = Limits { goal, iterations: ITERATIONS };
            let (tangent, held) = (Tangent::new(&site.pattern)?, &site.held);
            let mut newton = Newton::new(&model, tangent, held, site.weight, ITERATIONS);
            match newton.minimise(&site.load, u, limits, progress.part(share, next)) {
                Ok(found) => {
                    corrections += newton.effort.iterations;
                    *place = TissueState { pose: between, u: found.u };
                    (share, part) = (next, 2.0 * part);
                }
                Err(SolveError::NotConverged(_)) if part > SMALLEST_PART => part *= 0.5,
                Err(other) => return Err(other),
            }
        }
        Ok(Step { corrections, error_mm: 0.0, by_newton: true })
    }
}

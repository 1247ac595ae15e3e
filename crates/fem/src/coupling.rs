//! Tissue that follows a rigid body: steps from one pose to the next.

use crate::analysis::OutOfMemory;
use crate::newton::{Limits, Newton};
use crate::outcome::{Cause, Halt, Stall};
use crate::quasi_newton::{ERROR_MM, Memory, error_mm, largest};
use crate::site::{MOTIONS, Place, Responses, Site};
use crate::tangent::Tangent;
use std::sync::Arc;
use supine_space::{Pose, Progress, Vector};

/// Corrections of a step; more mean that the factor is too old.
const CORRECTIONS: usize = 10;
/// The first guess how much of an error a correction leaves when the rigid body has moved by its size since
/// the factor was made; how fast a guess that proved too high falls; and the lowest that is believed.
const FIRST_RATE: f64 = 4.0;
const RATE_FALL: f64 = 0.8;
const MIN_RATE: f64 = 0.05;
/// A correction may be so many times the one before.
const GROWTH: f64 = 2.0;
/// Newton iterations of a part of a motion; one that needs more is halved. Chosen, not measured.
const ITERATIONS: usize = 40;
/// The smallest part of a motion that is tried alone.
const SMALLEST_PART: f64 = 1.0 / 64.0;

/// How a step went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Corrections made, or Newton iterations.
    pub corrections: usize,
    /// Estimate of the error left at the worst node, mm.
    pub error_mm: f64,
    /// Whether corrections did not suffice and Newton's method took over: this step took its time.
    pub by_newton: bool,
}

/// What the last step taught.
struct Lesson {
    motion: [f64; MOTIONS],
    /// What its prediction lacked.
    lack: Vec<f64>,
}

/// The tissue around a rigid body that moves.
pub(crate) struct Coupling<const N: usize, const Q: usize> {
    pub(crate) site: Arc<Site<N, Q>>,
    pub(crate) place: Place,
    responses: Responses,
    /// Room of the responses before the last ones.
    spare: Option<Tangent>,
    lesson: Option<Lesson>,
    /// Share of the error that a correction leaves when the body has moved by its size since the factor was
    /// made; in between it is taken for proportional to the way.
    rate: f64,
}

impl<const N: usize, const Q: usize> Coupling<N, Q> {
    /// Begins at displacement `u` (mm) with the body at its first pose; `None` when the stiffness there has no
    /// factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(site: Site<N, Q>, u: Vec<Vector>) -> Result<Option<Self>, OutOfMemory> {
        let (site, place) = (Arc::new(site), Place { pose: Pose::identity(), u });
        let Some(responses) = site.responses(&place, None)? else { return Ok(None) };
        Ok(Some(Self { site, place, responses, spare: None, lesson: None, rate: FIRST_RATE }))
    }

    /// Settles the tissue at the first pose, and makes the responses there.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn begin(&mut self, goal: f64, progress: Progress<'_>) -> Result<(), Halt> {
        self.settle(&Pose::identity(), goal, progress)?;
        if let Some(responses) = self.site.responses(&self.place, self.spare.take())? {
            self.adopt(responses);
        }
        Ok(())
    }

    /// Takes responses made for another place of the same site.
    pub(crate) fn adopt(&mut self, responses: Responses) {
        let before = std::mem::replace(&mut self.responses, responses);
        self.spare = Some(before.tangent);
    }

    /// Room for new responses.
    pub(crate) fn take_spare(&mut self) -> Option<Tangent> {
        self.spare.take()
    }

    /// Moves the rigid body to `pose` and lets the tissue follow.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn step(&mut self, pose: &Pose) -> Result<Step, Halt> {
        if let Some((place, made)) = self.corrected(pose) {
            self.place = place;
            return Ok(made);
        }
        self.lesson = None;
        self.settle(pose, 1e-8, Progress::none())
    }

    /// The new place by prediction and corrections with the factor at hand; `None` when they do not reach
    /// it.
    fn corrected(&mut self, pose: &Pose) -> Option<(Place, Step)> {
        let motion = self.site.motion(&self.place.pose, pose);
        let slide = self.site.slide(pose);
        let (mut u, curvature) = self.predicted(pose, &motion)?;
        let mut memory = Memory::default();
        let mut lack = curvature;
        let mut last = f64::INFINITY;
        let way = self.site.motion(&self.responses.pose, pose);
        let way = way.iter().map(|v| v * v).sum::<f64>().sqrt() / self.site.size_mm;
        // What a correction leaves of the error.
        let mut left = (self.rate * way).clamp(MIN_RATE, 1.0);
        for corrections in 1..=CORRECTIONS {
            let mut forces = self.site.out_of_balance(&u)?;
            if let Some(slide) = &slide {
                slide.project(&u, &mut forces)?;
            }
            let residual = self.site.pattern.gather(&forces);
            let step = memory.step(residual, |x| self.responses.tangent.apply_factor(x))?;
            let size = largest(&step);
            if size.is_nan() || size > (GROWTH * last).min(self.site.size_mm) {
                return None;
            }
            self.site.pattern.add_to(&mut u, &step);
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
            if error_mm <= ERROR_MM {
                self.lesson = Some(Lesson { motion, lack });
                let made = Step { corrections, error_mm, by_newton: false };
                return Some((Place { pose: *pose, u }, made));
            }
            last = size;
        }
        None
    }

    /// The displacement at `pose` to first order, and with what the last step lacked where this one goes on
    /// in its direction: half the second derivative along it. The second value is that part. `None` when a
    /// node cannot be brought to where it slides.
    pub(crate) fn predicted(
        &self,
        pose: &Pose,
        motion: &[f64; MOTIONS],
    ) -> Option<(Vec<Vector>, Vec<f64>)> {
        let mut step = vec![0.0; self.site.pattern.unknowns()];
        for (length, column) in motion.iter().zip(&self.responses.columns) {
            if *length != 0.0 {
                step.iter_mut().zip(column).for_each(|(step, c)| *step += length * c);
            }
        }
        let mut curvature = vec![0.0; step.len()];
        if let Some(Lesson { motion: last, lack }) = &self.lesson {
            let along: f64 = motion.iter().zip(last).map(|(a, b)| a * b).sum();
            let square: f64 = last.iter().map(|v| v * v).sum();
            let share = if square > 0.0 { (along / square).clamp(0.0, 1.5) } else { 0.0 };
            curvature.iter_mut().zip(lack).for_each(|(c, l)| *c = share * share * l);
            step.iter_mut().zip(&curvature).for_each(|(step, c)| *step += c);
        }
        let mut u = self.place.u.clone();
        self.site.pattern.add_to(&mut u, &step);
        self.site.put(pose, &mut u).then_some((u, curvature))
    }

    /// Moves the rigid body to `pose` by Newton's method, in parts where the whole way folds an element, to
    /// a relative residual of `goal`.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn settle(
        &mut self,
        pose: &Pose,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Step, Halt> {
        let (first, site) = (self.place.pose, self.site.clone());
        let (mut share, mut part) = (0.0, 1.0f64);
        let mut corrections = 0;
        while share < 1.0 {
            let next = (share + part).min(1.0);
            let between = if next < 1.0 { site.between(&first, pose, next) } else { *pose };
            // A shorter part starts from the same place.
            if self.responses.pose != self.place.pose
                && let Some(responses) = site.responses(&self.place, self.spare.take())?
            {
                self.adopt(responses);
            }
            self.lesson = None;
            let motion = site.motion(&self.place.pose, &between);
            let Some((u, _)) = self.predicted(&between, &motion) else {
                if part <= SMALLEST_PART {
                    let (cause, residual, u) = (Cause::Start, f64::INFINITY, self.place.u.clone());
                    return Err(Halt::Stalled(Stall { cause, residual, u, load_share: share }));
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
                    self.place = Place { pose: between, u: found.u };
                    (share, part) = (next, 2.0 * part);
                }
                Err(Halt::Stalled(_)) if part > SMALLEST_PART => part *= 0.5,
                Err(other) => return Err(other),
            }
        }
        Ok(Step { corrections, error_mm: 0.0, by_newton: true })
    }
}

//! Tissue that follows a rigid body: steps from one pose to the next.

use crate::applicator::{Pose, Step};
use crate::curved::Straightening;
use crate::linear::OutOfMemory;
use crate::model::Model;
use crate::newton::{Cause, Halt, Newton, Stall};
use crate::pattern::{Pattern, Storage};
use crate::quasi_newton::Memory;
use crate::sliding::{Slide, Sliding};
use crate::tangent::Tangent;
use nalgebra::UnitQuaternion;
use std::sync::Arc;
use supine_space::{Progress, Vector};

/// Directions in which a rigid body moves: three shifts, three turns.
pub(crate) const MOTIONS: usize = 6;
/// A step ends when the error that is left is estimated below this, mm.
const ERROR_MM: f64 = 0.004;
/// Corrections of a step; more mean that the factor is too old.
const CORRECTIONS: usize = 10;
/// The first guess how much of an error a correction leaves when the rigid body has moved by its size since
/// the factor was made; how fast a guess that proved too high falls; and the least that is believed.
const FIRST_RATE: f64 = 4.0;
const RATE_FALL: f64 = 0.8;
const LEAST_RATE: f64 = 0.05;
/// A correction may be so many times the one before.
const GROWTH: f64 = 2.0;
/// The smallest part of a motion that is tried alone.
const SMALLEST_PART: f64 = 1.0 / 64.0;

/// What does not change while the rigid body moves.
pub(crate) struct Site<const N: usize, const Q: usize> {
    pub(crate) model: Model<N, Q>,
    /// Nodal forces of gravity, mN.
    pub(crate) load: Vec<Vector>,
    /// Displacement from the stress-free shape to the CT shape, mm.
    pub(crate) to_ct: Vec<Vector>,
    /// To the nodes of the straight-sided mesh.
    pub(crate) straight: Straightening<N>,
    /// Stress-free positions, mm.
    pub(crate) rest: Vec<Vector>,
    /// The nodes that follow the pose, and where they are at the first one, mm.
    pub(crate) coupled: Vec<(u32, Vector)>,
    /// The nodes that slide.
    pub(crate) sliding: Option<Arc<Sliding>>,
    /// Elements with nodes that follow or slide.
    pub(crate) around: Vec<u32>,
    /// Whether each node is held or follows the pose.
    pub(crate) held: Vec<bool>,
    pub(crate) pattern: Arc<Pattern>,
    /// Centre (mm) and size (mm) of the rigid body at the first pose.
    pub(crate) centre: Vector,
    pub(crate) size_mm: f64,
    /// Norm of the nodal forces of gravity, mN.
    pub(crate) weight: f64,
}

/// A factor of the stiffness and the answers to the rigid body's motions.
pub(crate) struct Answers {
    tangent: Tangent,
    /// Where they were made.
    pose: Pose,
    /// Displacement of the unknowns per mm, for each motion.
    columns: [Vec<f64>; MOTIONS],
}

/// Where the tissue is.
#[derive(Clone)]
pub(crate) struct Place {
    pub(crate) pose: Pose,
    /// Displacement from the stress-free shape, mm.
    pub(crate) u: Vec<Vector>,
}

/// What the last step taught.
struct Lesson {
    motion: [f64; MOTIONS],
    /// What its prediction lacked.
    lack: Vec<f64>,
}

/// The tissue on which a rigid body is to act.
pub(crate) struct Tissue<const N: usize, const Q: usize> {
    pub(crate) model: Model<N, Q>,
    pub(crate) load: Vec<Vector>,
    pub(crate) to_ct: Vec<Vector>,
    pub(crate) straight: Straightening<N>,
    pub(crate) rest: Vec<Vector>,
    pub(crate) weight: f64,
}

/// The tissue around a rigid body that moves.
pub(crate) struct Coupling<const N: usize, const Q: usize> {
    pub(crate) site: Arc<Site<N, Q>>,
    pub(crate) place: Place,
    answers: Answers,
    /// Room of the answers before the last ones.
    spare: Option<Tangent>,
    lesson: Option<Lesson>,
    /// Share of the error that a correction leaves when the body has moved by its size since the factor was
    /// made; in between it is taken for proportional to the way.
    rate: f64,
}

impl<const N: usize, const Q: usize> Site<N, Q> {
    /// The motion from one pose to another, in mm at the body's surface.
    pub(crate) fn motion(&self, from: &Pose, to: &Pose) -> [f64; MOTIONS] {
        let shift = self.centre_at(to) - self.centre_at(from);
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * self.size_mm;
        [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
    }

    /// A share of the way: the centre on a straight line, the turn about one axis.
    pub(crate) fn between(&self, from: &Pose, to: &Pose, share: f64) -> Pose {
        let motion = self.motion(from, to).map(|v| share * v);
        let [shift, turn] = [0, 3].map(|k| Vector::new(motion[k], motion[k + 1], motion[k + 2]));
        let turn = UnitQuaternion::from_scaled_axis(turn / self.size_mm);
        let turned = Pose::rotation_wrt_point(turn, self.centre_at(from).into());
        Pose::translation(shift.x, shift.y, shift.z) * turned * from
    }

    fn centre_at(&self, pose: &Pose) -> Vector {
        pose.transform_point(&self.centre.into()).coords
    }

    /// The nodes on which the body acts.
    pub(crate) fn touched(&self) -> impl Iterator<Item = usize> {
        let sliding = self.sliding.iter().flat_map(|s| s.nodes.iter().map(|slider| slider.node));
        self.coupled.iter().map(|(node, _)| *node).chain(sliding).map(|n| n as usize)
    }

    /// The nodes that slide, with the body at `pose`.
    pub(crate) fn slide(&self, pose: &Pose) -> Option<Slide> {
        self.sliding.clone().map(|sliding| Slide { sliding, pose: *pose })
    }

    /// The tissue with the body at `pose`.
    fn model_at(&self, pose: &Pose) -> Model<N, Q> {
        self.model.sliding(self.slide(pose))
    }

    /// Velocities (mm/mm) of all nodes in one motion of the body with which the nodes on it go, zero but at
    /// these; and how the body turns, radians/mm.
    fn velocities(&self, motion: usize, place: &Place) -> (Vec<Vector>, Vector) {
        let mut velocities = vec![Vector::zeros(); self.held.len()];
        let (axis, centre) = (Vector::ith(motion % 3, 1.0), self.centre_at(&place.pose));
        let (shift, turn) = if motion < 3 {
            (axis, Vector::zeros())
        } else {
            (Vector::zeros(), axis / self.size_mm)
        };
        for n in self.touched() {
            velocities[n] = shift + turn.cross(&(self.rest[n] + place.u[n] - centre));
        }
        (velocities, turn)
    }

    fn at(&self, pose: &Pose, first: &Vector) -> Vector {
        pose.transform_point(&(*first).into()).coords
    }

    /// Moves the nodes on the body to where `pose` has them: those that slide to the nearest such place;
    /// false where one has none.
    fn put(&self, pose: &Pose, u: &mut [Vector]) -> bool {
        for (node, first) in &self.coupled {
            let n = *node as usize;
            u[n] = self.at(pose, first) - self.rest[n];
        }
        self.slide(pose).is_none_or(|slide| slide.bring(u))
    }

    /// The factor at a place, and the answers to the motions there; `None` when there is no factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn answers(
        &self,
        place: &Place,
        spare: Option<Tangent>,
    ) -> Result<Option<Answers>, OutOfMemory> {
        let mut tangent = match spare {
            Some(tangent) => tangent,
            None => Tangent::new(&self.pattern)?,
        };
        if !tangent.renew(&self.model_at(&place.pose), &place.u)? {
            return Ok(None);
        }
        let Some(changes) = self.changes(place) else { return Ok(None) };
        let mut columns: [Vec<f64>; MOTIONS] = Default::default();
        for (forces, column) in changes.iter().zip(&mut columns) {
            *column = self.pattern.gather(forces);
            column.iter_mut().for_each(|v| *v = -*v);
            if !tangent.apply_factor(column) {
                return Ok(None);
            }
        }
        Ok(Some(Answers { tangent, pose: place.pose, columns }))
    }

    /// Change of what is out of balance per mm of each motion, mN/mm, before the others answer.
    fn changes(&self, place: &Place) -> Option<Vec<Vec<Vector>>> {
        let slide = self.slide(&place.pose);
        let forces = slide.is_some().then(|| self.out_of_balance(&place.u));
        let change = |motion: usize| {
            let (mut velocities, turn) = self.velocities(motion, place);
            let (Some(slide), Some(forces)) = (&slide, &forces) else {
                return self.model.slope(&self.around, &place.u, &velocities);
            };
            let turned = slide.drag(&place.u, &turn, forces.as_ref()?, &mut velocities)?;
            let mut change = self.model.slope(&self.around, &place.u, &velocities)?;
            turned.into_iter().for_each(|(n, force)| change[n] += force);
            slide.project(&place.u, &mut change)?;
            Some(change)
        };
        (0..MOTIONS).map(change).collect()
    }

    /// Internal less external forces of all nodes, mN: what the rigid body gives at nodes on it.
    pub(crate) fn out_of_balance(&self, u: &[Vector]) -> Option<Vec<Vector>> {
        let (_, mut forces) = self.model.evaluate(u)?;
        forces.iter_mut().zip(&self.load).for_each(|(f, l)| *f -= l);
        Some(forces)
    }
}

/// The elements with at least one of some nodes.
pub(crate) fn elements_of<const N: usize>(elements: &[[u32; N]], some: &[bool]) -> Vec<u32> {
    let has = |e: &u32| elements[*e as usize].iter().any(|&n| some[n as usize]);
    (0..elements.len() as u32).filter(has).collect()
}

/// Largest motion of a node in a vector of unknowns, mm.
fn largest(unknowns: &[f64]) -> f64 {
    unknowns
        .chunks_exact(3)
        .map(|v| v.iter().map(|v| v * v).sum::<f64>())
        .fold(0.0, f64::max)
        .sqrt()
}

impl<const N: usize, const Q: usize> Coupling<N, Q> {
    /// Begins at displacement `u` (mm), where the body at its first pose takes the nodes that `follow` it or
    /// slide; `None` when the stiffness there has no factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(
        tissue: Tissue<N, Q>,
        u: Vec<Vector>,
        (held, follow): (&[bool], &[bool]),
        sliding: Option<Sliding>,
        (centre, size_mm): (Vector, f64),
    ) -> Result<Option<Self>, OutOfMemory> {
        let Tissue { model, load, to_ct, straight, rest, weight } = tissue;
        let mut touched = follow.to_vec();
        sliding
            .iter()
            .flat_map(|s| &s.nodes)
            .for_each(|slider| touched[slider.node as usize] = true);
        let around = elements_of(&model.elements.nodes, &touched);
        let all = 0..held.len();
        let held: Vec<bool> = all.clone().map(|n| held[n] || follow[n]).collect();
        let pattern = Arc::new(Pattern::new(&model.elements.nodes, &held, Storage::Lower));
        let coupled = all.filter(|&n| follow[n]).map(|n| (n as u32, rest[n] + u[n])).collect();
        let sliding = sliding.map(Arc::new);
        let site = Arc::new(Site {
            model,
            load,
            to_ct,
            straight,
            rest,
            coupled,
            sliding,
            around,
            held,
            pattern,
            centre,
            size_mm,
            weight,
        });
        let place = Place { pose: Pose::identity(), u };
        let Some(answers) = site.answers(&place, None)? else { return Ok(None) };
        Ok(Some(Self { site, place, answers, spare: None, lesson: None, rate: FIRST_RATE }))
    }

    /// Settles the tissue at the first pose, and makes the answers there.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn begin(&mut self, goal: f64, progress: Progress<'_>) -> Result<(), Halt> {
        self.settle(&Pose::identity(), goal, progress)?;
        if let Some(answers) = self.site.answers(&self.place, self.spare.take())? {
            self.adopt(answers);
        }
        Ok(())
    }

    /// Takes answers made for another place of the same site.
    pub(crate) fn adopt(&mut self, answers: Answers) {
        let before = std::mem::replace(&mut self.answers, answers);
        self.spare = Some(before.tangent);
    }

    /// Room for new answers.
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
        let mut before: Option<(Vec<f64>, Vec<f64>)> = None;
        let mut lack = curvature;
        let mut last = f64::INFINITY;
        let way = self.site.motion(&self.answers.pose, pose);
        let way = way.iter().map(|v| v * v).sum::<f64>().sqrt() / self.site.size_mm;
        // What a correction leaves of the error.
        let mut left = (self.rate * way).clamp(LEAST_RATE, 1.0);
        for corrections in 1..=CORRECTIONS {
            let mut forces = self.site.out_of_balance(&u)?;
            if let Some(slide) = &slide {
                slide.project(&u, &mut forces)?;
            }
            let residual = self.site.pattern.gather(&forces);
            if let Some((step, old)) = before.take() {
                let change = residual.iter().zip(&old).map(|(new, old)| new - old).collect();
                memory.keep(step, change);
            }
            let mut step: Vec<f64> = residual.iter().map(|r| -r).collect();
            if !memory.apply(&mut step, |x| self.answers.tangent.apply_factor(x)) {
                return None;
            }
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
            let error_mm = size * left / (1.0 - left).max(0.1);
            if error_mm <= ERROR_MM {
                self.lesson = Some(Lesson { motion, lack });
                let made = Step { corrections, error_mm, anew: false };
                return Some((Place { pose: *pose, u }, made));
            }
            last = size;
            before = Some((step, residual));
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
        for (length, column) in motion.iter().zip(&self.answers.columns) {
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
            if self.answers.pose != self.place.pose
                && let Some(answers) = site.answers(&self.place, self.spare.take())?
            {
                self.adopt(answers);
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
            let mut newton = Newton::new(&model, &site.pattern, &site.held, site.weight, 40)?;
            match newton.minimise(&site.load, u, (goal, 40), progress.part(share, next)) {
                Ok(found) => {
                    corrections += newton.effort.iterations;
                    self.place = Place { pose: between, u: found.u };
                    (share, part) = (next, 2.0 * part);
                }
                Err(Halt::Stalled(_)) if part > SMALLEST_PART => part *= 0.5,
                Err(other) => return Err(other),
            }
        }
        Ok(Step { corrections, error_mm: 0.0, anew: true })
    }
}

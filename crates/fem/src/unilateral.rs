//! Tissue before a rigid body from which it lifts off: steps from one pose to the next.
//!
//! The energy is least under g ≥ 0, g the gaps between the nodes of the tissue's free surface and
//! the smooth parts of the body. In equilibrium the out-of-balance force is r = Σ λ n with λ ≥ 0, g
//! ≥ 0, λ g = 0, n the normals. A correction takes the tissue to be linear with the inverse
//! stiffness H (a kept factor and the changes of the forces over the last corrections), and the
//! body as it is: the displacement is −H (r − Σ λ n), and the λ solve a linear complementarity
//! problem that is set up again with the gaps and normals there, until these stay. Since H knows
//! nothing of the contact, it serves whatever is touched.

use crate::analysis::OutOfMemory;
use crate::compliance::Compliance;
use crate::outcome::{SolveError, Step};
use crate::pairs::Pair;
use crate::press_problem::Problem;
use crate::quasi_newton::{Budget, dot, error_mm, largest};
use crate::site::{ContactSite, TissueState};
use crate::tangent::Tangent;
use crate::wall::{Press, Target, Wall};
use nalgebra::DVector;
use std::sync::Arc;
use supine_space::{Pose, Progress, Vector};

/// Corrections of a step; more mean that the factor is too old.
const CORRECTIONS: usize = 12;
/// How exactly gaps are kept, mm.
pub(crate) const GAP_MM: f64 = 1e-3;
/// A node within the tissue that is this deep in the body is no dent between nodes of the surface,
/// mm.
pub(crate) const BURIED_MM: f64 = 1.0;
/// As for tissue that follows (`following`): the share of an error that a correction leaves.
const FIRST_RATE: f64 = 4.0;
const RATE_FALL: f64 = 0.8;
const MIN_RATE: f64 = 0.05;
const GROWTH: f64 = 2.0;
/// A step is made in parts that are shorter than this share of the body's smallest radius, if it is
/// near: else it could jump over a node. One that needs more parts is made in its own time.
const PART: f64 = 0.5;
const PARTS: usize = 8;
/// Relative residual where a step is made by Newton's method, and where an applicator is put in:
/// with the set of touching nodes changing, rounding can keep it from falling much lower.
pub(crate) const STEP_GOAL: f64 = 1e-8;

/// Where the tissue is and what presses it.
#[derive(Clone)]
pub(crate) struct Balance {
    /// Displacement from the stress-free shape, mm.
    pub(crate) u: Vec<Vector>,
    /// The nodes that are pressed, in rising order.
    pub(crate) presses: Vec<Press>,
    /// The forces that the last correction has put on nodes, mN: those of `presses` when it was a
    /// whole one.
    pub(crate) forces: Vec<(u32, Vector)>,
}

/// A correction.
pub(crate) struct Correction {
    /// Change of the unknowns, mm.
    pub(crate) step: Vec<f64>,
    pub(crate) presses: Vec<Press>,
    /// Forces on the nodes in reach, mN.
    forces: DVector<f64>,
    /// Forces on them before, mN.
    before: DVector<f64>,
}

/// The last correction, from whose end its pair is learnt.
struct Last {
    step: Vec<f64>,
    /// Out of balance before it with the forces then, mN; and H₀ times that, mm.
    residual: Vec<f64>,
    undone: Vec<f64>,
    /// The change of the forces on nodes, mN; and H₀ times that, mm.
    force: Vec<f64>,
    moved: Vec<f64>,
}

/// What is kept of tissue that is pressed.
pub(crate) struct UnilateralContact {
    pub(crate) wall: Arc<Wall>,
    pub(crate) compliance: Compliance,
    /// Room of the factor before the last one.
    pub(crate) spare: Option<Tangent>,
    pub(crate) presses: Vec<Press>,
    pub(crate) forces: Vec<(u32, Vector)>,
    last: Option<Last>,
    /// Share of the error that a correction leaves when the tissue has moved by the body's size
    /// since the factor was made.
    rate: f64,
}

impl UnilateralContact {
    /// Untouched tissue.
    pub(crate) fn new(wall: Arc<Wall>, compliance: Compliance) -> Self {
        let (presses, forces) = (Vec::new(), Vec::new());
        Self { wall, compliance, spare: None, presses, forces, last: None, rate: FIRST_RATE }
    }

    /// Takes a factor made at another place.
    pub(crate) fn adopt(&mut self, compliance: Compliance) {
        let before = std::mem::replace(&mut self.compliance, compliance);
        self.spare = Some(before.into_tangent());
        self.last = None;
    }

    /// Renews the factor and the compliance at a displacement, nodes nearer than so many mm in
    /// reach; false when there is no factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn renew<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        balance: &Balance,
        reach: (Target<'_>, f64),
    ) -> Result<bool, OutOfMemory> {
        let nodes = self.wall.reach(&balance.u, &balance.forces, reach);
        let made = Compliance::new(site, &balance.u, nodes, self.spare.take())?;
        let renewed = made.is_some();
        if let Some(compliance) = made {
            self.adopt(compliance);
        }
        Ok(renewed)
    }

    /// Whether a node that is not in reach has come near: a renewal would spare a step its own.
    pub(crate) fn is_stale(&self, place: &TissueState) -> bool {
        let near = (Target::at(&place.pose), 0.5 * self.wall.margin_mm);
        self.wall.misses(&self.compliance.nodes, &place.u, near)
    }

    /// The nodes that a renewal at a place would have in reach.
    pub(crate) fn reach(&self, place: &TissueState) -> Vec<u32> {
        let near = (Target::at(&place.pose), self.wall.margin_mm);
        self.wall.reach(&place.u, &self.forces, near)
    }

    /// The force of the body on each node that it presses, mN.
    pub(crate) fn on_nodes(&self) -> Vec<(u32, Vector)> {
        let mut forces: Vec<(u32, Vector)> = Vec::with_capacity(self.presses.len());
        for press in &self.presses {
            let force = press.normal * press.force;
            match forces.last_mut() {
                Some((node, sum)) if *node == press.node => *sum += force,
                _ => forces.push((press.node, force)),
            }
        }
        forces
    }

    /// Where the tissue is and what presses it.
    pub(crate) fn balance(&self, place: &TissueState) -> Balance {
        let (presses, forces) = (self.presses.clone(), self.forces.clone());
        Balance { u: place.u.clone(), presses, forces }
    }

    /// Takes an equilibrium.
    pub(crate) fn take(&mut self, place: &mut TissueState, pose: &Pose, balance: Balance) {
        *place = TissueState { pose: *pose, u: balance.u };
        (self.presses, self.forces) = (balance.presses, balance.forces);
    }

    /// Moves the rigid body to `pose` and lets the tissue follow.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory; the tissue is then as it was.
    pub(crate) fn step<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        place: &mut TissueState,
        pose: &Pose,
    ) -> Result<Step, SolveError> {
        let first = place.clone();
        let mut balance = self.balance(place);
        let parts = self.parts(site, place, pose);
        let mut made = Step { corrections: 0, error_mm: 0.0, by_newton: false };
        if parts <= PARTS {
            for part in 1..=parts {
                let share = part as f64 / parts as f64;
                let next =
                    if part < parts { site.between(&first.pose, pose, share) } else { *pose };
                let Some((found, step)) = self.moved(site, &balance, &next)? else {
                    return self.settle((site, place), pose, STEP_GOAL, Progress::none());
                };
                balance = found;
                made = Step { corrections: made.corrections + step.corrections, ..step };
            }
            self.take(place, pose, balance);
            return Ok(made);
        }
        self.settle((site, place), pose, STEP_GOAL, Progress::none())
    }

    /// Moves the rigid body to `pose` by the factor at hand, without parts on the way; `None`, and
    /// nothing has moved, when that does not suffice.
    pub(crate) fn step_quickly<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        place: &mut TissueState,
        pose: &Pose,
        budget: Budget,
    ) -> Option<Step> {
        let target = Target::at(pose);
        let near = self.parts(site, place, pose) == 1;
        let corrected =
            near.then(|| self.corrected(site, self.balance(place), target, budget)).flatten();
        let corrected = corrected
            .filter(|(balance, _)| self.wall.buried(&balance.u, (target, BURIED_MM)).is_none());
        let Some((balance, made)) = corrected else {
            self.last = None;
            self.compliance.pairs.forget();
            return None;
        };
        self.take(place, pose, balance);
        Some(made)
    }

    /// The equilibrium at `pose` by corrections, with a renewed factor where the one at hand does
    /// not suffice.
    ///
    /// # Errors
    /// When there is not enough memory.
    fn moved<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        balance: &Balance,
        pose: &Pose,
    ) -> Result<Option<(Balance, Step)>, OutOfMemory> {
        let target = Target::at(pose);
        for renewed in [false, true] {
            match self.corrected(site, balance.clone(), target, Budget::whole(CORRECTIONS)) {
                Some(found) => {
                    let buried = self.wall.buried(&found.0.u, (target, BURIED_MM));
                    return Ok(buried.is_none().then_some(found));
                }
                None => {
                    self.last = None;
                    self.compliance.pairs.forget();
                    if renewed || !self.renew(site, balance, (target, self.wall.margin_mm))? {
                        return Ok(None);
                    }
                }
            }
        }
        Ok(None)
    }

    /// In how many parts a motion is to be made.
    pub(crate) fn parts<const N: usize, const Q: usize>(
        &self,
        site: &ContactSite<N, Q>,
        place: &TissueState,
        pose: &Pose,
    ) -> usize {
        let way = self.way(site, &place.pose, pose);
        if way <= self.longest() || way < self.wall.clearance(&place.u, Target::at(&place.pose)) {
            return 1;
        }
        let parts = (way / self.longest()).ceil();
        if parts.is_finite() { (parts as usize).max(1) } else { usize::MAX }
    }

    /// The longest part of a motion near the tissue, mm.
    pub(crate) fn longest(&self) -> f64 {
        PART * self.wall.surface.finest_mm
    }

    /// Bound of the motion of the body's surface between two poses, mm.
    pub(crate) fn way<const N: usize, const Q: usize>(
        &self,
        site: &ContactSite<N, Q>,
        from: &Pose,
        to: &Pose,
    ) -> f64 {
        let [x, y, z, a, b, c] = site.motion(from, to);
        let turn = Vector::new(a, b, c).norm() / site.size_mm;
        Vector::new(x, y, z).norm() + turn * self.wall.surface.reach_mm
    }

    /// Corrections from `balance` with the factor at hand; `None` when they do not converge, fold
    /// an element or lead to where a node not in reach lies in the body.
    fn corrected<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        mut balance: Balance,
        target: Target<'_>,
        budget: Budget,
    ) -> Option<(Balance, Step)> {
        let mut last = f64::INFINITY;
        // With the set of the nodes that touch, sizes go up and down.
        let mut recent = [f64::INFINITY; 3];
        let way = self.compliance.age_mm(&balance.u) / site.size_mm;
        // One that is too stiff leaves nearly all of some errors, and the first corrections do not
        // show it.
        let stiffer = self.compliance.is_stiffer();
        let mut left = if stiffer { 1.0 } else { (self.rate * way).clamp(MIN_RATE, 1.0) };
        for corrections in 1..=budget.corrections {
            let forces = site.out_of_balance(&balance.u)?;
            let correction = self.correct(site, &balance, &forces, target)?;
            let size = largest(&correction.step);
            let highest = recent.iter().copied().fold(0.0, f64::max);
            if size.is_nan() || size > (GROWTH * highest).min(site.size_mm) {
                return None;
            }
            recent = [recent[1], recent[2], size];
            balance = self.gone(site, &balance, &correction, 1.0);
            if corrections > 1 {
                let seen = size / last;
                self.rate = (seen / way.max(1e-3)).max(RATE_FALL * self.rate);
                left = left.max(seen);
            }
            let error_mm = error_mm(size, left);
            if budget.is_met(corrections, error_mm, size < last) {
                if self.wall.fits(&balance.u, &balance.presses, (target, GAP_MM)) {
                    let made = Step { corrections, error_mm, by_newton: false };
                    return Some((balance, made));
                }
                if self.wall.misses(&self.compliance.nodes, &balance.u, (target, -GAP_MM)) {
                    return None;
                }
            }
            last = size;
        }
        None
    }

    /// The correction where the forces out of balance, those of the body left out, are `forces`
    /// (mN).
    pub(crate) fn correct<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        balance: &Balance,
        forces: &[Vector],
        target: Target<'_>,
    ) -> Option<Correction> {
        let mut on_nodes = vec![Vector::zeros(); balance.u.len()];
        for (node, force) in &balance.forces {
            self.compliance.nodes.binary_search(node).ok()?;
            on_nodes[*node as usize] = *force;
        }
        let before = self.compliance.local(&site.pattern.gather(&on_nodes));
        let net: Vec<Vector> = forces.iter().zip(&on_nodes).map(|(f, p)| f - p).collect();
        let residual = site.pattern.gather(&net);
        let mut undone = residual.clone();
        if !self.compliance.undo(&mut undone) {
            return None;
        }
        self.learn(&residual, &undone);
        let mut free = undone.clone();
        self.compliance.pairs.add(&residual, &mut free);
        free.iter_mut().for_each(|v| *v = -*v);
        let nodes = &self.compliance.nodes;
        let problem = Problem {
            wall: &self.wall,
            target,
            nodes,
            places: nodes.iter().map(|n| self.wall.place(*n, &balance.u)).collect(),
            learnt: self.compliance.learnt(),
            free: self.compliance.local(&free),
            before: &before,
        };
        let (presses, pressed) = problem.solve(&balance.presses)?;
        let force = self.compliance.spread(&(&pressed - &before));
        let mut moved = force.clone();
        if !self.compliance.undo(&mut moved) {
            return None;
        }
        let mut step: Vec<f64> = free.iter().zip(&moved).map(|(a, b)| a + b).collect();
        self.compliance.pairs.add(&force, &mut step);
        self.last = Some(Last { step: step.clone(), residual, undone, force, moved });
        Some(Correction { step, presses, forces: pressed, before })
    }

    /// Learns from the last correction, now that the residual at its end is known.
    fn learn(&mut self, residual: &[f64], undone: &[f64]) {
        let Some(last) = self.last.take() else { return };
        let change = |new: &[f64], old: &[f64], more: &[f64]| -> Vec<f64> {
            new.iter().zip(old).zip(more).map(|((new, old), more)| new - old + more).collect()
        };
        let change_of_forces = change(residual, &last.residual, &last.force);
        let undone = change(undone, &last.undone, &last.moved);
        // Over such a step the change is rounding.
        if dot(&last.step, &last.step) > 0.0 && largest(&last.step) > 1e-7 {
            self.compliance.pairs.keep(Pair { step: last.step, change: change_of_forces, undone });
        }
    }

    /// Where a share of a correction leads.
    pub(crate) fn gone<const N: usize, const Q: usize>(
        &self,
        site: &ContactSite<N, Q>,
        from: &Balance,
        correction: &Correction,
        share: f64,
    ) -> Balance {
        let Correction { step, presses, forces, before } = correction;
        let step: Vec<f64> = step.iter().map(|v| v * share).collect();
        let mut u = from.u.clone();
        site.pattern.add_to(&mut u, &step);
        let forces = before + (forces - before) * share;
        let nodes = self.compliance.nodes.iter().zip(forces.as_slice().chunks_exact(3));
        let nodes = nodes.map(|(node, f)| (*node, Vector::new(f[0], f[1], f[2])));
        let forces = nodes.filter(|(_, force)| *force != Vector::zeros()).collect();
        Balance { u, presses: presses.clone(), forces }
    }

    /// Of the last correction this share was made, a `step` of the unknowns (mm).
    pub(crate) fn made(&mut self, share: f64, step: Vec<f64>) {
        if let Some(last) = &mut self.last {
            last.force.iter_mut().chain(&mut last.moved).for_each(|v| *v *= share);
            last.step = step;
        }
    }

    /// Forgets what the last correction was to teach: it was not made.
    pub(crate) fn rest(&mut self) {
        self.last = None;
    }
}

//! Tissue before a rigid body from which it lifts off: equilibria in their own time.
//!
//! Newton's method with the corrections of `pressing`, their factor renewed where they do not
//! converge fast, and a search along each for less energy and less tissue in the body: E − f · u +
//! p Σ max(0, −g), p above all λ, whose minimum is the equilibrium (Han, J. Optim. Theory Appl. 22,
//! 1977). Far motions are made in parts. A body that is put in where tissue is grows from one that
//! touches nothing: all gaps are opened by the deepest one, and closed again.

use crate::newton::norm;
use crate::outcome::Step;
use crate::outcome::{Cause, NonConvergence, SolveError};
use crate::site::{ContactSite, TissueState};
use crate::unilateral::{BURIED_MM, Balance, Correction, UnilateralContact};
use crate::wall::Target;
use supine_space::{Pose, Progress, Vector};

/// Corrections of a part.
const ITERATIONS: usize = 100;
/// The smallest part of a motion, or of a growth, that is tried alone.
const SMALLEST_PART: f64 = 1.0 / 64.0;
/// How exactly gaps are kept, mm.
const GAP_MM: f64 = 1e-6;
/// A factor serves on while each correction leaves less than this share of the residual.
const SLOW: f64 = 0.15;
/// One that does not is renewed when the tissue has moved by this share of the body's size since,
/// or after so many corrections.
const OLD: f64 = 0.02;
const USES: usize = 4;
/// The penalty of tissue in the body over the largest force on a node.
const PENALTY: f64 = 2.0;
/// As in `newton`: share of the promised decrease, shortenings, rounding, and the smallest load.
const ARMIJO: f64 = 1e-4;
const SHORTENINGS: usize = 30;
const ENERGY_ROUNDING: f64 = 1e-11;
/// A step that leaves more than this share of the residual is doubled while that lowers the energy,
/// up to this.
const SHORT: f64 = 0.5;
const LONGEST: f64 = 256.0;
const SMALL_LOAD: f64 = 1e-4;
/// Share of the clear way to the tissue that a part may go.
const CLEAR: f64 = 0.9;

/// A balance, looked at.
struct Assessment {
    /// Elastic energy less the work of the load, mN mm.
    potential: f64,
    /// Work of the load, mN mm.
    work: f64,
    /// Internal less external forces of all nodes, mN.
    forces: Vec<Vector>,
    /// Norm of what is out of balance with the body's forces along its normals, over that of load
    /// or reactions.
    residual: f64,
    /// How far tissue lies in the body in all, mm.
    violation: f64,
}

impl UnilateralContact {
    /// Puts the body in at its first pose: from untouched tissue in equilibrium.
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
        let pose = place.pose;
        let depth = (-self.wall.clearance(&place.u, Target::at(&pose))).max(0.0);
        let mut balance = self.balance(place);
        let (mut share, mut part) = (0.0, 1.0f64);
        while share < 1.0 {
            let next = (share + part).min(1.0);
            let target = Target { pose: &pose, opening_mm: depth * (1.0 - next) };
            let limits = (goal, progress.part(share, next));
            match self.minimise(site, balance.clone(), target, limits) {
                Ok((found, _)) => (balance, share, part) = (found, next, 2.0 * part),
                Err(SolveError::NotConverged(_)) if part > SMALLEST_PART => part *= 0.5,
                Err(other) => return Err(other),
            }
        }
        self.renew(site, &balance, (Target::at(&pose), self.wall.margin_mm))?;
        self.take(place, &pose, balance);
        Ok(())
    }

    /// Moves the body to `pose`, in parts near the tissue, to a relative residual of `goal`.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory; the tissue is then as it was.
    pub(crate) fn settle<const N: usize, const Q: usize>(
        &mut self,
        (site, place): (&ContactSite<N, Q>, &mut TissueState),
        pose: &Pose,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Step, SolveError> {
        let first = place.pose;
        let mut balance = self.balance(place);
        let (mut share, mut most, mut corrections) = (0.0, 1.0f64, 0);
        let whole = self.way(site, &first, pose);
        while share < 1.0 {
            let here = if share > 0.0 { site.between(&first, pose, share) } else { first };
            let clear = CLEAR * self.wall.clearance(&balance.u, Target::at(&here));
            // A body that goes farther could jump over a node.
            let free = if whole > 0.0 { self.longest().max(clear) / whole } else { 1.0 };
            let part = most.min(free);
            let next: f64 = if share + part >= 1.0 - 1e-12 { 1.0 } else { share + part };
            let between = if next < 1.0 { site.between(&first, pose, next) } else { *pose };
            let limits = (goal, progress.part(share, next));
            let outcome = self.minimise(site, balance.clone(), Target::at(&between), limits);
            match outcome {
                Ok((equilibrium, _)) if self.enters(&equilibrium, &between) => {
                    let (cause, residual) = (Cause::NoDescent, f64::INFINITY);
                    return Err(SolveError::NotConverged(NonConvergence {
                        cause,
                        residual,
                        u: equilibrium.u,
                        load_share: share,
                    }));
                }
                Ok((equilibrium, made)) => {
                    corrections += made;
                    (balance, share, most) = (equilibrium, next, 2.0 * most);
                }
                Err(SolveError::NotConverged(_)) if part > SMALLEST_PART * free.min(1.0) => {
                    most = 0.5 * part
                }
                Err(SolveError::NotConverged(stall)) => {
                    return Err(SolveError::NotConverged(NonConvergence {
                        load_share: share,
                        ..stall
                    }));
                }
                Err(other) => return Err(other),
            }
        }
        self.take(place, pose, balance);
        Ok(Step { corrections, error_mm: 0.0, by_newton: true })
    }

    /// Whether the body has got in between the nodes of the surface.
    fn enters(&self, balance: &Balance, pose: &Pose) -> bool {
        self.wall.buried(&balance.u, (Target::at(pose), BURIED_MM)).is_some()
    }

    /// The equilibrium from `balance` with the body at `target`, to a relative residual, and the
    /// corrections it took.
    fn minimise<const N: usize, const Q: usize>(
        &mut self,
        site: &ContactSite<N, Q>,
        mut balance: Balance,
        target: Target<'_>,
        (goal, progress): (f64, Progress<'_>),
    ) -> Result<(Balance, usize), SolveError> {
        self.rest();
        let stall = |cause, residual, u| {
            Err(SolveError::NotConverged(NonConvergence { cause, residual, u, load_share: 0.0 }))
        };
        let Some(mut seen) = self.seen(site, &balance, target) else {
            return stall(Cause::Start, f64::INFINITY, balance.u);
        };
        let (mut before, mut penalty, mut uses) = (0.0, 0.0f64, 0);
        let (first, mut share) = (seen.residual.max(goal), 0f64);
        for iteration in 0..ITERATIONS {
            if seen.residual <= goal
                && self.wall.fits(&balance.u, &balance.presses, (target, GAP_MM))
            {
                self.rest();
                return Ok((balance, iteration));
            }
            let gone = (first / seen.residual).ln() / (first / goal).ln();
            share = if gone.is_finite() { share.max(gone.min(1.0)) } else { share };
            progress.at(share)?;
            let reach = 0.5 * self.wall.margin_mm;
            let near = (target, 0.5 * reach);
            let misses = self.wall.misses(&self.compliance.nodes, &balance.u, near);
            // Where the stiffness had to be shifted a new factor is no better than what steps
            // teach.
            let old = self.compliance.age_mm(&balance.u) > OLD * site.size_mm || uses >= USES;
            let slow = misses || old && seen.residual > SLOW * before;
            uses = if slow { 0 } else { uses + 1 };
            if slow && !self.renew(site, &balance, (target, reach))? {
                return stall(Cause::Singular, seen.residual, balance.u);
            }
            before = seen.residual;
            let Some(correction) = self.correct(site, &balance, &seen.forces, target) else {
                return stall(Cause::Singular, seen.residual, balance.u);
            };
            let largest = correction.presses.iter().map(|press| press.force).fold(0.0, f64::max);
            penalty = penalty.max(PENALTY * largest);
            match self.search(site, (&balance, &seen), &correction, (target, penalty)) {
                Some((next, found, share)) => {
                    let both = next.u.iter().zip(&balance.u);
                    let step: Vec<Vector> = both.map(|(new, old)| new - old).collect();
                    self.made(share, site.pattern.gather(&step));
                    (balance, seen) = (next, found);
                }
                None => {
                    self.rest();
                    return stall(Cause::NoDescent, seen.residual, balance.u);
                }
            }
        }
        self.rest();
        stall(Cause::Iterations, seen.residual, balance.u)
    }

    /// The first place along a correction, from the whole of it down, that has less energy and less
    /// tissue in the body.
    fn search<const N: usize, const Q: usize>(
        &self,
        site: &ContactSite<N, Q>,
        (from, seen): (&Balance, &Assessment),
        correction: &Correction,
        (target, penalty): (Target<'_>, f64),
    ) -> Option<(Balance, Assessment, f64)> {
        let work: f64 = {
            let step = site.pattern.scatter(&correction.step);
            seen.forces.iter().zip(&step).map(|(f, s)| f.dot(s)).sum()
        };
        let slope = work - penalty * seen.violation;
        let rounding = ENERGY_ROUNDING * (seen.potential.abs() + seen.work.abs());
        let at = |share: f64| {
            let mut next = self.gone(site, from, correction, share);
            if share > 1.0 {
                // On the straight way a node leaves a body that it slides on.
                self.wall.put_on(&mut next.u, &correction.presses, target);
            }
            self.wall.keep_out(&mut next.u, (&from.u, (1.0 - share).max(0.0)), target);
            let assessment = self.seen(site, &next, target)?;
            let rise = assessment.potential - seen.potential
                + penalty * (assessment.violation - seen.violation);
            Some((next, assessment, rise))
        };
        let mut share = 1.0;
        for _ in 0..SHORTENINGS {
            if let Some((mut next, mut assessment, mut rise)) = at(share) {
                let rounded = rise.abs() < rounding && assessment.residual < seen.residual;
                if (slope < 0.0 && rise <= ARMIJO * share * slope) || rounded {
                    // A stiffness that had to be shifted is stiffer than the tissue, and its steps
                    // fall short.
                    while (1.0..LONGEST).contains(&share)
                        && assessment.residual > SHORT * seen.residual
                        && let Some((farther, there, rises)) = at(2.0 * share)
                        && rises < rise - rounding
                    {
                        (next, assessment, rise, share) = (farther, there, rises, 2.0 * share);
                    }
                    return Some((next, assessment, share));
                }
            }
            share *= 0.5;
        }
        None
    }

    /// A balance looked at; `None` when an element of it is turned inside out.
    fn seen<const N: usize, const Q: usize>(
        &self,
        site: &ContactSite<N, Q>,
        balance: &Balance,
        target: Target<'_>,
    ) -> Option<Assessment> {
        let (energy, mut forces) = site.model.evaluate(&balance.u)?;
        let work: f64 = site.load.iter().zip(&balance.u).map(|(f, u)| f.dot(u)).sum();
        let mut reactions = 0.0;
        for ((force, load), held) in forces.iter_mut().zip(&site.load).zip(&site.held) {
            if *held {
                reactions += force.norm_squared();
                *force = Vector::zeros();
            } else {
                *force -= load;
            }
        }
        let mut net = forces.clone();
        for press in &balance.presses {
            let place = self.wall.place(press.node, &balance.u);
            let normal =
                self.wall.gap(press.part, &place, target).map_or(press.normal, |g| g.normal);
            net[press.node as usize] -= normal * press.force;
            reactions += press.force * press.force;
        }
        let scale = norm(&site.load).max(reactions.sqrt()).max(SMALL_LOAD * site.weight);
        let violation = self.wall.violation(&balance.u, target);
        let (potential, residual) = (energy - work, norm(&net) / scale);
        Some(Assessment { potential, work, forces, residual, violation })
    }
}

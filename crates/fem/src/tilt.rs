//! The operating table: gravity that turns, and tissue that follows it.

use crate::background::Background;
use crate::curved::Straightening;
use crate::discretisation::Discretisation;
use crate::either::{Either, either};
use crate::model::Model;
use crate::newton::{KnownEquilibrium, Newton};
use crate::outcome::Step;
use crate::pattern::Pattern;
use crate::quasi_newton::{ERROR_MM, Memory, error_mm, largest};
use crate::rest::LoadedBody;
use crate::tangent::Tangent;
use crate::warm_start::WarmStart;
use crate::{Body, Error, Info, Job, Load, Params, checked, deformed, from_ct};
use std::sync::Arc;
use supine_mesh::{Deformation, Edges, Order, TetMesh};
use supine_space::{Progress, Vector};

/// Corrections of a turn at most, and how fast their sizes are to fall, from that of the linear
/// response; beyond, Newton's method takes over, which costs as much as some sixty.
const CORRECTIONS: usize = 20;
const SHRINK: f64 = 0.75;
/// The share of the error that a correction is taken to leave, at least and at most: the larger of
/// the last two that were seen, the most as long as none was. Chosen so that the error stayed below
/// 0.006 mm in thousands of turns of all sizes at every kind of cut, with moduli from 0.6 kPa and
/// Poisson's ratios to 0.49.
const LEFT: [f64; 2] = [0.65, 0.9];
/// Corrections of a turn that a new factor would hardly save, and how many beyond these since the
/// last renewal make it worth a new one, which costs as much as some twenty.
const FEW: usize = 2;
const DEBT: usize = 12;

/// A meshed body under a gravity that turns, as on an operating table that is tilted.
///
/// The stress-free shape is found once. A turn makes quasi-Newton steps with a kept factor of the
/// stiffness, from where the tissue is; the first of them is its linear response to the change of
/// gravity. What the last steps told of the stiffness (L-BFGS, see `quasi_newton`) is kept from
/// turn to turn: so the response is that of the place, not of the factor. Where the steps do not
/// converge, as after a long way of soft tissue, Newton's method takes over; it begins where the
/// tissue is and, should that lead nowhere, as [`crate::solve`] does.
///
/// So a turn ends where [`crate::solve`] does, to within about [`Step::error_mm`], whatever came
/// before, as long as the tissue has one equilibrium. Errors do not add up. Same calls in the same
/// order, same bytes, unless [`Tilt::renew_beside`] is used.
pub struct Tilt {
    mesh: Arc<TetMesh>,
    edges: Edges,
    tissue: Either<TiltedTissue<4, 1>, TiltedTissue<10, 4>>,
    beside: Background<Tangent>,
}

impl Tilt {
    /// Solves as [`crate::solve`] does, and begins under the target's gravity.
    ///
    /// # Errors
    /// As [`crate::solve`]; [`Error::Singular`] when the stiffness there has no factor.
    pub fn new(
        body: &Body,
        load: &Load,
        params: &Params,
        progress: Progress<'_>,
    ) -> Result<(Self, Info), Error> {
        let edges = checked(body, load, params)?;
        let job = Job::new(body, &edges, load, params);
        let (tissue, mut info) = match params.order {
            Order::Linear => {
                let (hung, info) = job.hang::<4, 1>(progress)?;
                (Either::Linear(hung), info)
            }
            Order::Quadratic => {
                let (hung, info) = job.hang::<10, 4>(progress)?;
                (Either::Quadratic(hung), info)
            }
        };
        let (mesh, beside) = (body.mesh.clone(), Background::idle());
        let tilt = Self { mesh, edges, tissue, beside };
        info.solve.max_displacement_mm = tilt.deformation()?.displacement().max_norm();
        Ok((tilt, info))
    }

    /// The present gravity: a unit vector, LPS.
    pub fn gravity(&self) -> Vector {
        either!(&self.tissue, t => t.gravity)
    }

    /// Turns gravity to `gravity` (a unit vector, LPS); the tissue follows to within about
    /// [`Step::error_mm`].
    ///
    /// When turns have become slow, the next one first renews the factor, unless
    /// [`Tilt::renew_beside`] did or does.
    ///
    /// # Errors
    /// [`Error::Direction`] when `gravity` is not a unit vector, [`Error::NonConvergence`] when no
    /// equilibrium is found under it, or [`Error::Memory`]: gravity and tissue then stay as they
    /// were.
    pub fn turn(&mut self, gravity: &Vector) -> Result<Step, Error> {
        let ct = either!(&self.tissue, t => t.system.ct);
        Load { ct, target: *gravity }.check()?;
        self.take_renewal();
        let waits = self.beside.is_busy();
        either!(&mut self.tissue, t => {
            if t.debt >= DEBT && !waits {
                t.renew()?;
            }
            t.turn(gravity)
        })
    }

    /// Renews the factor under the present gravity.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn renew(&mut self) -> Result<(), Error> {
        either!(&mut self.tissue, t => t.renew())
    }

    /// Begins to renew the factor under the present gravity in another thread, unless that is under
    /// way; a later turn takes it when it is there.
    pub fn renew_beside(&mut self) {
        self.take_renewal();
        if self.beside.is_busy() {
            return;
        }
        either!(&mut self.tissue, t => {
            t.debt = 0;
            let (system, u, spare) = (t.system.clone(), t.u.clone(), t.spare.take());
            // Without memory the old factor serves on.
            self.beside.begin(move || system.factor(&u, spare).ok().flatten());
        });
    }

    /// Takes what another thread renewed, if it is there.
    fn take_renewal(&mut self) {
        if let Some(tangent) = self.beside.take() {
            either!(&mut self.tissue, t => t.adopt(tangent));
        }
    }

    /// The mesh displaced from the CT shape as it is under the present gravity, mm; its order is
    /// that of the parameters.
    ///
    /// # Errors
    /// None is known: it holds a finite vector for every node.
    pub fn deformation(&self) -> Result<Deformation, Error> {
        let values =
            either!(&self.tissue, t => t.system.straight.of(&from_ct(&t.u, &t.system.to_ct)));
        deformed(&self.mesh, &self.edges, values)
    }
}

impl std::fmt::Debug for Tilt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tilt").field("gravity", &self.gravity()).finish_non_exhaustive()
    }
}

/// What does not change while gravity turns.
struct System<const N: usize, const Q: usize> {
    model: Model<N, Q>,
    held: Vec<bool>,
    pattern: Arc<Pattern>,
    /// To the nodes of the mesh of straight elements.
    straight: Straightening<N>,
    /// Displacement from the stress-free shape to the CT shape, mm.
    to_ct: Vec<Vector>,
    /// The gravity of the CT, and that under which the stress-free shape stays as it is.
    ct: Vector,
    borne: Vector,
    /// Weight of the tissue per volume, kPa/mm.
    weight: f64,
    /// Norm of the nodal forces of full gravity, mN.
    norm: f64,
    tolerance: f64,
    max_iterations: usize,
}

impl<const N: usize, const Q: usize> System<N, Q> {
    /// Nodal forces under a gravity, mN.
    fn load(&self, gravity: &Vector) -> Vec<Vector> {
        self.model.elements.load(self.held.len(), (gravity - self.borne) * self.weight)
    }

    /// The factor at displacement `u` (mm); `None` when there is none.
    fn factor(&self, u: &[Vector], spare: Option<Tangent>) -> Result<Option<Tangent>, Error> {
        let memory = |_| Error::Memory { unknowns: self.pattern.unknowns() };
        let mut tangent = match spare {
            Some(tangent) => tangent,
            None => Tangent::new(&self.pattern).map_err(memory)?,
        };
        Ok(tangent.renew(&self.model, u).map_err(memory)?.then_some(tangent))
    }
}

/// Tissue in equilibrium.
struct TiltedTissue<const N: usize, const Q: usize> {
    system: Arc<System<N, Q>>,
    gravity: Vector,
    /// Displacement from the stress-free shape, mm.
    u: Vec<Vector>,
    tangent: Tangent,
    /// Room of the factor before the last one.
    spare: Option<Tangent>,
    /// What was learnt since the factor was made.
    memory: Memory,
    /// Corrections beyond [`FEW`] in the turns since a renewal began.
    debt: usize,
}

impl<const N: usize, const Q: usize> TiltedTissue<N, Q> {
    fn renew(&mut self) -> Result<(), Error> {
        self.debt = 0;
        if let Some(tangent) = self.system.factor(&self.u, self.spare.take())? {
            self.adopt(tangent);
        }
        Ok(())
    }

    fn adopt(&mut self, tangent: Tangent) {
        self.spare = Some(std::mem::replace(&mut self.tangent, tangent));
        // Pairs of the stiffness on the way here tell less than the factor.
        self.memory = Memory::default();
    }

    fn turn(&mut self, gravity: &Vector) -> Result<Step, Error> {
        let load = self.system.load(gravity);
        let made = match self.corrected(&load) {
            Some((u, made)) => {
                self.u = u;
                made
            }
            None => {
                self.memory = Memory::default();
                self.by_newton(&load)?
            }
        };
        self.gravity = *gravity;
        self.debt += if made.by_newton { DEBT } else { made.corrections.saturating_sub(FEW) };
        Ok(made)
    }

    /// The displacement under `load` by the linear response and corrections; `None` when they do
    /// not reach it.
    fn corrected(&mut self, load: &[Vector]) -> Option<(Vec<Vector>, Step)> {
        let system = &self.system;
        let mut u = self.u.clone();
        self.memory.rest();
        let mut next = |u: &mut Vec<Vector>| {
            let (_, mut forces) = system.model.evaluate(u)?;
            forces.iter_mut().zip(load).for_each(|(force, load)| *force -= load);
            let residual = system.pattern.gather(&forces);
            let step = self.memory.step(residual, |x| self.tangent.apply_factor(x))?;
            system.pattern.add_to(u, &step);
            Some(largest(&step))
        };
        let [least, greatest] = LEFT;
        let (mut last, mut before) = (next(&mut u)?, 0.0f64);
        let mut most = last;
        for corrections in 1..=CORRECTIONS {
            let size = next(&mut u)?;
            if size.is_nan() || size > most.max(ERROR_MM) {
                return None;
            }
            // The first one mends the curvature of the response, which tells nothing of the next
            // ones.
            let share = size / last;
            let left =
                if corrections > 1 { share.max(before).clamp(least, greatest) } else { greatest };
            let error_mm = error_mm(size, left);
            if error_mm <= ERROR_MM {
                return Some((u, Step { corrections, error_mm, by_newton: false }));
            }
            (last, before) = (size, share);
            most *= SHRINK;
        }
        None
    }

    /// Goes to the equilibrium under `load` by Newton's method.
    fn by_newton(&mut self, load: &[Vector]) -> Result<Step, Error> {
        let system = &self.system;
        let tangent = Tangent::new(&system.pattern)
            .map_err(|_| Error::Memory { unknowns: system.pattern.unknowns() })?;
        let at_ct = system.load(&system.ct);
        let mut newton =
            Newton::new(&system.model, tangent, &system.held, system.norm, system.max_iterations);
        let known = KnownEquilibrium { u: &system.to_ct, load: &at_ct };
        let equilibrium = newton
            .resumed(load, Some(self.u.clone()), known, system.tolerance, Progress::none())
            .map_err(|halt| newton.failed(halt, system.tolerance))?;
        let corrections = newton.effort.iterations;
        self.u = equilibrium.u;
        Ok(Step { corrections, error_mm: 0.0, by_newton: true })
    }
}

impl Job<'_> {
    /// The body under the target's gravity, with a factor there.
    fn hang<const N: usize, const Q: usize>(
        &self,
        progress: Progress<'_>,
    ) -> Result<(TiltedTissue<N, Q>, Info), Error> {
        let discretisation = Discretisation::new(self)?;
        let settled = self.settle(&discretisation, &mut WarmStart::nothing(), progress)?;
        let LoadedBody { model, to_ct, u, mut info, .. } = settled;
        self.warn::<N>(&discretisation.positions, &from_ct(&u, &to_ct), &mut info);
        let system = System {
            norm: self.gravity_norm(&model, u.len()),
            model,
            held: discretisation.held,
            pattern: discretisation.lower,
            straight: discretisation.straight,
            to_ct,
            ct: self.load.ct,
            borne: self.borne(),
            weight: self.body.tissue.weight(),
            tolerance: self.params.tolerance,
            max_iterations: self.params.max_iterations,
        };
        let tangent = system.factor(&u, None)?.ok_or(Error::Singular)?;
        let hung = TiltedTissue {
            system: Arc::new(system),
            gravity: self.load.target,
            u,
            tangent,
            spare: None,
            memory: Memory::default(),
            debt: 0,
        };
        Ok((hung, info))
    }
}

#[cfg(test)]
#[path = "tilt_tests.rs"]
mod tests;

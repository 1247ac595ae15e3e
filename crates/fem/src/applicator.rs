//! An applicator in the tissue: a rigid body that tissue follows while it moves.

use crate::background::Background;
use crate::coupling::{Coupling, Renewed};
use crate::discretisation::Discretisation;
use crate::either::{Either, either};
use crate::outcome::SolveError;
use crate::outcome::Step;
use crate::quasi_newton::Budget;
use crate::rest::LoadedBody;
use crate::rigid::RigidBody;
use crate::site::{ContactSite, Tissue, Touch, elements_of};
use crate::sliding::{Slider, Sliding};
use crate::smoothed_distance::SmoothedDistance;
use crate::warm_start::WarmStart;
use crate::{Body, Contact, Error, Info, Insertion, Job, Load, Params, checked, deformed, from_ct};
use std::sync::Arc;
use supine_mesh::{Deformation, Edges, Order, TetMesh};
use supine_space::{Point, Pose, Progress, Vector};

/// Nodes this close to the surface, as a share of the applicator's size, lie on it.
const ON_SURFACE: f64 = 1e-4;

/// What the tissue does to the applicator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaction {
    /// Force, N, LPS.
    pub force_n: Vector,
    /// Moment about the centre of the applicator as it lies, N mm, LPS.
    pub moment_n_mm: Vector,
}

/// A meshed body with an applicator in it.
///
/// Nodes that lie inside the applicator when it is attached follow its pose, or slide on it: see
/// [`Contact`]. Gravity goes on acting on the others. A step predicts the displacement by a kept
/// linear response to the six motions of a rigid body, and corrects it by quasi-Newton steps with a
/// kept factor of the stiffness. Both are renewed by [`Applicator::renew`], or beside the steps by
/// [`Applicator::renew_beside`]; steps stay right with old ones, and become slower.
pub struct Applicator {
    mesh: Arc<TetMesh>,
    edges: Edges,
    coupling: Either<Coupling<4, 1>, Coupling<10, 4>>,
    beside: Background<Renewed>,
}

impl Applicator {
    /// Puts an applicator (placed in the frame of the CT, where the target's gravity has the
    /// tissue) into `body`: solves as [`crate::solve`] does, and couples the nodes that then lie
    /// within `rigid`. Where they slide, the tissue settles again without its cavity.
    ///
    /// # Errors
    /// As [`crate::solve`]; [`Error::ApplicatorOutside`] when no free node lies within the
    /// applicator. Where nodes slide, [`Error::ApplicatorMiddle`] when the applicator has no normal
    /// at one of them, and [`Error::ApplicatorStuck`] when the tissue finds no equilibrium around
    /// the cavity.
    pub fn attach(
        body: &Body,
        load: &Load,
        params: &Params,
        insertion: &Insertion<'_>,
        progress: Progress<'_>,
    ) -> Result<(Self, Info), Error> {
        let edges = checked(body, load, params)?;
        let job = Job::new(body, &edges, load, params);
        let (coupling, info) = match params.order {
            Order::Linear => {
                let (coupling, info) = job.couple::<4, 1>(insertion, progress)?;
                (Either::Linear(coupling), info)
            }
            Order::Quadratic => {
                let (coupling, info) = job.couple::<10, 4>(insertion, progress)?;
                (Either::Quadratic(coupling), info)
            }
        };
        Ok((Self { mesh: body.mesh.clone(), edges, coupling, beside: Background::idle() }, info))
    }

    /// Number of nodes on which the applicator acts: those that follow it and those that slide on
    /// it.
    pub fn coupled_nodes(&self) -> usize {
        either!(&self.coupling, c => c.touched())
    }

    /// The present pose.
    pub fn pose(&self) -> &Pose {
        either!(&self.coupling, c => &c.place.pose)
    }

    /// Moves the applicator to `pose`; the tissue follows to within [`Step::error_mm`].
    ///
    /// # Errors
    /// [`Error::ApplicatorPose`] when `pose` is not finite; [`Error::ApplicatorStuck`] when no
    /// equilibrium is found there: the applicator then stays where the last equilibrium was.
    pub fn step(&mut self, pose: &Pose) -> Result<Step, Error> {
        check(pose)?;
        self.take_renewal();
        let made = either!(&mut self.coupling, c => c.step(pose));
        self.told(made)
    }

    /// Moves the applicator to `pose` as [`Applicator::step`] does, but only in time: by
    /// corrections with the factor at hand, as many as the budget has. None, and all as it was,
    /// when these do not suffice: the motion is long, or the factor old. What [`Budget::partly`]
    /// leaves undone, the next step to the same pose goes on with.
    ///
    /// # Errors
    /// [`Error::ApplicatorPose`] when `pose` is not finite.
    pub fn step_quickly(&mut self, pose: &Pose, budget: Budget) -> Result<Option<Step>, Error> {
        check(pose)?;
        self.take_renewal();
        Ok(either!(&mut self.coupling, c => c.step_quickly(pose, budget)))
    }

    /// The share of the way to `pose` that one [`Applicator::step_quickly`] can go: less than all
    /// where an applicator near to tissue that it presses would jump over it.
    ///
    /// # Errors
    /// [`Error::ApplicatorPose`] when `pose` is not finite.
    pub fn share_of_way(&self, pose: &Pose) -> Result<f64, Error> {
        check(pose)?;
        Ok(either!(&self.coupling, c => c.share_of_way(pose)))
    }

    /// Moves the applicator to `pose` as [`Applicator::step`] does, to a tolerance and in its own
    /// time: by Newton's method until the relative residual is at most `tolerance`.
    ///
    /// # Errors
    /// As [`Applicator::step`], and when the user stops.
    pub fn settle(
        &mut self,
        pose: &Pose,
        tolerance: f64,
        progress: Progress<'_>,
    ) -> Result<Step, Error> {
        check(pose)?;
        let made = either!(&mut self.coupling, c => c.settle(pose, tolerance, progress));
        self.told(made)
    }

    /// Renews the factor and the linear responses at the present pose.
    ///
    /// # Errors
    /// [`Error::Memory`].
    pub fn renew(&mut self) -> Result<(), Error> {
        either!(&mut self.coupling, c => {
            let unknowns = c.site.pattern.unknowns();
            let renewed = c.renewal()().map_err(|_| Error::Memory { unknowns })?;
            if let Some(renewed) = renewed {
                c.adopt(renewed);
            }
        });
        Ok(())
    }

    /// Begins to renew the factor and the linear responses at the present pose in another thread,
    /// unless that is under way; a later step takes them when they are there.
    pub fn renew_beside(&mut self) {
        self.take_renewal();
        if self.beside.is_busy() {
            return;
        }
        either!(&mut self.coupling, c => {
            let renewal = c.renewal();
            // Without memory the old ones serve on.
            self.beside.begin(move || renewal().ok().flatten());
        });
    }

    /// Takes what another thread renewed, if it is there.
    fn take_renewal(&mut self) {
        if let Some(renewed) = self.beside.take() {
            either!(&mut self.coupling, c => c.adopt(renewed));
        }
    }

    /// The mesh displaced from the CT shape as it is at the present pose, mm. Where the tissue
    /// slides it means nothing within the cavity: nodes that follow the pose and nodes that slide
    /// may pass each other there.
    ///
    /// # Errors
    /// None is known: it holds a finite vector for every node.
    pub fn deformation(&self) -> Result<Deformation, Error> {
        let values = either!(&self.coupling, c => {
            c.site.straight.of(&from_ct(&c.place.u, &c.site.to_ct))
        });
        deformed(&self.mesh, &self.edges, values)
    }

    /// Force and moment of the tissue on the applicator at the present pose.
    pub fn reaction(&self) -> Reaction {
        either!(&self.coupling, c => reaction(c))
    }

    /// The force of the applicator on each node of the tissue that it touches at the present pose,
    /// mN: numbers as those of points, then for quadratic elements of edges. Where tissue lifts off
    /// these are λ n, the normals n outward from the applicator and λ ≥ 0. Their sum is what
    /// [`Applicator::reaction`] has against it.
    pub fn contact_forces(&self) -> Vec<(u32, Vector)> {
        either!(&self.coupling, c => c.forces())
    }

    /// The nodes that may touch an applicator from which tissue lifts off: those of the free
    /// surface of what bears. Empty for other contacts.
    pub fn contact_candidates(&self) -> &[u32] {
        either!(&self.coupling, c => c.pressing().map_or(&[], |pressing| &pressing.wall.nodes))
    }

    /// Whether each tetrahedron bears: is not of a cavity.
    pub fn bearing(&self) -> &[bool] {
        either!(&self.coupling, c => &c.site.bears)
    }

    /// Whether tissue that may be touched has come near of which the responses know nothing: to
    /// renew them now ([`Applicator::renew_beside`]) spares a later step that. Only where tissue
    /// lifts off.
    pub fn wants_renewal(&self) -> bool {
        either!(&self.coupling, c => c.pressing().is_some_and(|p| p.is_stale(&c.place)))
    }

    fn told(&self, made: Result<Step, SolveError>) -> Result<Step, Error> {
        let unknowns = either!(&self.coupling, c => c.site.pattern.unknowns());
        made.map_err(|halt| stuck(halt, unknowns))
    }
}

impl std::fmt::Debug for Applicator {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let nodes = self.coupled_nodes();
        f.debug_struct("Applicator").field("pose", self.pose()).field("coupled", &nodes).finish()
    }
}

pub(crate) fn stuck(halt: SolveError, unknowns: usize) -> Error {
    match halt {
        SolveError::Stopped(stopped) => stopped.into(),
        SolveError::Memory => Error::Memory { unknowns },
        SolveError::NotConverged(stall) => Error::ApplicatorStuck { residual: stall.residual },
    }
}

fn reaction<const N: usize, const Q: usize>(coupling: &Coupling<N, Q>) -> Reaction {
    let mut sum = Reaction { force_n: Vector::zeros(), moment_n_mm: Vector::zeros() };
    let Coupling { site, place, .. } = coupling;
    let centre = place.pose.transform_point(&site.centre.into()).coords;
    for (node, given) in coupling.forces() {
        let n = node as usize;
        // What is out of balance there is what the applicator gives; in mN.
        let force = -given * 1e-3;
        sum.force_n += force;
        sum.moment_n_mm += (site.rest[n] + place.u[n] - centre).cross(&force);
    }
    sum
}

fn check(pose: &Pose) -> Result<(), Error> {
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    let finite = numbers.into_iter().all(|v| v.is_finite());
    let turned = (pose.rotation.norm() - 1.0).abs() < 1e-6;
    if finite && turned { Ok(()) } else { Err(Error::ApplicatorPose) }
}

/// Which nodes follow a rigid body, and those that slide on it.
type Touched = (Vec<bool>, Option<Sliding>);

impl Job<'_> {
    fn couple<const N: usize, const Q: usize>(
        &self,
        insertion: &Insertion<'_>,
        progress: Progress<'_>,
    ) -> Result<(Coupling<N, Q>, Info), Error> {
        let Insertion { rigid, contact, cavity } = *insertion;
        if cavity.is_some() && contact != Contact::Unilateral {
            return Err(Error::CavityContact);
        }
        let discretisation = Discretisation::new(self)?;
        let settled =
            self.settle(&discretisation, &mut WarmStart::nothing(), progress.part(0.0, 0.6))?;
        let LoadedBody { model, load, to_ct, u, mut info, .. } = settled;
        let (positions, held) = (&discretisation.positions, &discretisation.held);
        let rest: Vec<Vector> = positions.iter().zip(&to_ct).map(|(x, d)| x - d).collect();
        let weight = self.gravity_norm(&model, held.len());
        let bears = vec![true; model.elements.nodes.len()];
        let straight = discretisation.straight.clone();
        let tissue = Tissue { model, load, to_ct, straight, rest, weight, bears };
        let after = progress.part(0.6, 1.0);
        let coupling = if contact == Contact::Unilateral {
            self.press(&discretisation, (tissue, u), insertion, after)?
        } else {
            self.hold((tissue, u), &discretisation.held, (rigid, contact), after)?
        };
        let Coupling { site, place, .. } = &coupling;
        let from_ct = from_ct(&place.u, &site.to_ct);
        if let Ok(ratio) = site.model.volume_ratio(&place.u) {
            (info.solve.min_det_f, info.solve.max_det_f) = (ratio.min, ratio.max);
            info.solve.min_det_f_mm = self.middle(&site.model.elements.nodes[ratio.worst]).into();
        }
        self.warn::<N>(positions, &from_ct, &mut info);
        info.solve.max_displacement_mm = from_ct.iter().map(Vector::norm).fold(0.0, f64::max);
        Ok((coupling, info))
    }

    /// Couples the nodes within a rigid body to it.
    fn hold<const N: usize, const Q: usize>(
        &self,
        (mut tissue, u): (Tissue<N, Q>, Vec<Vector>),
        held: &[bool],
        (rigid, contact): (&dyn RigidBody, Contact),
        progress: Progress<'_>,
    ) -> Result<Coupling<N, Q>, Error> {
        let inside = inside(rigid, held, &tissue.rest, &u)?;
        let (follow, sliding) = if contact == Contact::Frictionless {
            self.slide(&mut tissue, &u, rigid, &inside, progress.part(0.0, 0.5))?
        } else {
            (inside, None)
        };
        let (unknowns, slides) =
            (3 * held.iter().filter(|held| !**held).count(), sliding.is_some());
        let touch = Touch {
            held,
            follow: &follow,
            sliding,
            centre: rigid.centre().coords,
            size_mm: rigid.size_mm(),
        };
        let site = ContactSite::new(tissue, &u, touch);
        let mut coupling = Coupling::new(site, u)
            .map_err(|_| Error::Memory { unknowns })?
            .ok_or(Error::Singular)?;
        if slides {
            coupling
                .begin(self.params.tolerance, progress.part(0.5, 1.0))
                .map_err(|halt| stuck(halt, unknowns))?;
        }
        Ok(coupling)
    }

    /// Takes the cavity of a rigid body out of the tissue.
    fn slide<const N: usize, const Q: usize>(
        &self,
        tissue: &mut Tissue<N, Q>,
        u: &[Vector],
        rigid: &dyn RigidBody,
        inside: &[bool],
        progress: Progress<'_>,
    ) -> Result<Touched, Error> {
        let elements = &tissue.model.elements.nodes;
        let keep: Vec<bool> =
            elements.iter().map(|e| !e.iter().all(|&n| inside[n as usize])).collect();
        tissue.model = tissue.model.only(&keep);
        tissue.bears = keep;
        tissue.load = tissue.model.elements.load(u.len(), self.force());
        let elements = &tissue.model.elements.nodes;
        let mut slides = vec![false; u.len()];
        elements.iter().flatten().for_each(|&n| slides[n as usize] = inside[n as usize]);
        let follow =
            inside.iter().zip(&slides).map(|(inside, slides)| *inside && !slides).collect();
        let nodes = || (0..u.len()).filter(|&n| slides[n]);
        let at = |n: usize| tissue.rest[n] + u[n];
        let centre = rigid.centre().coords;
        let reach = nodes().map(|n| (at(n) - centre).norm()).fold(0.0, f64::max);
        let distance = SmoothedDistance::new(rigid, reach, progress)?;
        let slider = |n: usize| {
            let level =
                distance.at(&at(n)).ok_or(Error::ApplicatorMiddle { place: at(n).into() })?;
            let (rest, load) = (tissue.rest[n], tissue.load[n]);
            Ok(Slider { node: n as u32, level: level.value, rest, load })
        };
        let nodes = nodes().map(slider).collect::<Result<_, Error>>()?;
        let around = elements_of(elements, &slides);
        Ok((follow, Some(Sliding { distance, nodes, around })))
    }
}

/// The free nodes that lie in a rigid body or on it.
fn inside(
    rigid: &dyn RigidBody,
    held: &[bool],
    rest: &[Vector],
    u: &[Vector],
) -> Result<Vec<bool>, Error> {
    let close = ON_SURFACE * rigid.size_mm();
    let at = |n: usize| Point::from(rest[n] + u[n]);
    let inside: Vec<bool> =
        (0..held.len()).map(|n| !held[n] && rigid.distance(&at(n)) <= close).collect();
    if !inside.contains(&true) {
        return Err(Error::ApplicatorOutside { centre: rigid.centre().coords.into() });
    }
    if held.iter().zip(&inside).all(|(held, inside)| *held || *inside) {
        return Err(Error::NothingFree);
    }
    Ok(inside)
}

#[cfg(test)]
#[path = "penalty_tests.rs"]
mod penalty_tests;
#[cfg(test)]
#[path = "sliding_tests.rs"]
mod sliding_tests;
#[cfg(test)]
#[path = "applicator_tests.rs"]
mod tests;
#[cfg(test)]
#[path = "unilateral_tests.rs"]
mod unilateral_tests;

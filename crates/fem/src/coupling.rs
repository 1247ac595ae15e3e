//! The tissue around a rigid body that moves.

use crate::analysis::OutOfMemory;
use crate::bilateral::BilateralContact;
use crate::compliance::Compliance;
use crate::outcome::{SolveError, Step};
use crate::quasi_newton::Budget;
use crate::site::{ContactSite, Responses, TissueState};
use crate::unilateral::UnilateralContact;
use std::sync::Arc;
use supine_space::{Pose, Progress, Vector};

/// How the rigid body holds tissue, with what is kept for it.
enum Hold {
    /// By nodes that stay on it.
    Bilateral(BilateralContact),
    /// By pressure alone.
    Unilateral(UnilateralContact),
}

/// What was renewed.
pub(crate) enum Renewed {
    Bilateral(Responses),
    Unilateral(Compliance),
}

/// The tissue around a rigid body that moves.
pub(crate) struct Coupling<const N: usize, const Q: usize> {
    pub(crate) site: Arc<ContactSite<N, Q>>,
    pub(crate) place: TissueState,
    hold: Hold,
}

impl<const N: usize, const Q: usize> Coupling<N, Q> {
    /// Tissue that follows or slides, at displacement `u` (mm) with the body at its first pose;
    /// `None` when the stiffness there has no factor.
    ///
    /// # Errors
    /// When there is not enough memory.
    pub(crate) fn new(
        site: ContactSite<N, Q>,
        u: Vec<Vector>,
    ) -> Result<Option<Self>, OutOfMemory> {
        let (site, place) = (Arc::new(site), TissueState { pose: Pose::identity(), u });
        let Some(responses) = site.responses(&place, None)? else { return Ok(None) };
        let hold = Hold::Bilateral(BilateralContact::new(responses));
        Ok(Some(Self { site, place, hold }))
    }

    /// Tissue that is pressed, in equilibrium at `place`.
    pub(crate) fn pressed(
        site: ContactSite<N, Q>,
        place: TissueState,
        pressing: UnilateralContact,
    ) -> Self {
        Self { site: Arc::new(site), place, hold: Hold::Unilateral(pressing) }
    }

    /// Settles the tissue at the first pose, if it follows or slides; one that is pressed has
    /// settled.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn begin(&mut self, goal: f64, progress: Progress<'_>) -> Result<(), SolveError> {
        match &mut self.hold {
            Hold::Bilateral(following) => {
                following.begin(&self.site, &mut self.place, goal, progress)
            }
            Hold::Unilateral(_) => Ok(()),
        }
    }

    /// Takes what was renewed at another place of the same site.
    pub(crate) fn adopt(&mut self, renewed: Renewed) {
        match (&mut self.hold, renewed) {
            (Hold::Bilateral(following), Renewed::Bilateral(new)) => following.adopt(new),
            (Hold::Unilateral(pressing), Renewed::Unilateral(new)) => pressing.adopt(new),
            // Work for the other kind was never begun.
            _ => {}
        }
    }

    /// The work of renewing at the present place: for another thread, or this one.
    pub(crate) fn renewal(
        &mut self,
    ) -> impl FnOnce() -> Result<Option<Renewed>, OutOfMemory> + use<N, Q> {
        let (site, place) = (self.site.clone(), self.place.clone());
        let (spare, pressed) = match &mut self.hold {
            Hold::Bilateral(following) => (following.take_spare(), None),
            Hold::Unilateral(pressing) => {
                let reach = pressing.reach(&place);
                (pressing.spare.take(), Some(reach))
            }
        };
        move || match pressed {
            None => Ok(site.responses(&place, spare)?.map(Renewed::Bilateral)),
            Some(nodes) => {
                let made = Compliance::new(&site, &place.u, nodes, spare)?;
                Ok(made.map(Renewed::Unilateral))
            }
        }
    }

    /// Moves the rigid body to `pose` and lets the tissue follow.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn step(&mut self, pose: &Pose) -> Result<Step, SolveError> {
        match &mut self.hold {
            Hold::Bilateral(following) => following.step(&self.site, &mut self.place, pose),
            Hold::Unilateral(pressing) => pressing.step(&self.site, &mut self.place, pose),
        }
    }

    /// The same with the factor at hand alone; `None`, and all as it was, when that does not
    /// suffice.
    pub(crate) fn step_quickly(&mut self, pose: &Pose, budget: Budget) -> Option<Step> {
        match &mut self.hold {
            Hold::Bilateral(following) => {
                following.step_quickly(&self.site, &mut self.place, pose, budget)
            }
            Hold::Unilateral(pressing) => {
                pressing.step_quickly(&self.site, &mut self.place, pose, budget)
            }
        }
    }

    /// The share of the way to `pose` that a step without parts can go.
    pub(crate) fn share_of_way(&self, pose: &Pose) -> f64 {
        match &self.hold {
            Hold::Bilateral(_) => 1.0,
            Hold::Unilateral(pressing) => {
                match pressing.parts(&self.site, &self.place, pose) {
                    1 => 1.0,
                    // Rounding must not make one part more of it.
                    parts => 0.999 / parts as f64,
                }
            }
        }
    }

    /// Moves the rigid body to `pose` by Newton's method to a relative residual of `goal`.
    ///
    /// # Errors
    /// When no equilibrium is found, stopped or out of memory.
    pub(crate) fn settle(
        &mut self,
        pose: &Pose,
        goal: f64,
        progress: Progress<'_>,
    ) -> Result<Step, SolveError> {
        match &mut self.hold {
            Hold::Bilateral(following) => {
                following.settle((&self.site, &mut self.place), pose, goal, progress)
            }
            Hold::Unilateral(pressing) => {
                pressing.settle((&self.site, &mut self.place), pose, goal, progress)
            }
        }
    }

    /// The forces of the body on the nodes of the tissue at the present pose, mN, one for each node
    /// that it touches, in rising order where it presses.
    pub(crate) fn forces(&self) -> Vec<(u32, Vector)> {
        match &self.hold {
            Hold::Bilateral(_) => {
                // A place is an equilibrium: no element of it is turned inside out.
                self.site.forces_on_touched(&self.place.u).unwrap_or_default()
            }
            Hold::Unilateral(pressing) => pressing.on_nodes(),
        }
    }

    /// Number of nodes on which the body acts.
    pub(crate) fn touched(&self) -> usize {
        match &self.hold {
            Hold::Bilateral(_) => self.site.touched().count(),
            Hold::Unilateral(pressing) => pressing.on_nodes().len(),
        }
    }

    /// What is kept of tissue that is pressed.
    pub(crate) fn pressing(&self) -> Option<&UnilateralContact> {
        match &self.hold {
            Hold::Bilateral(_) => None,
            Hold::Unilateral(pressing) => Some(pressing),
        }
    }

    /// The displacement that a step to `pose` begins with; `None` when a node cannot be brought to
    /// where it slides.
    #[cfg(test)]
    pub(crate) fn predicted(
        &self,
        pose: &Pose,
        motion: &[f64; crate::site::MOTIONS],
    ) -> Option<(Vec<Vector>, Vec<f64>)> {
        match &self.hold {
            Hold::Bilateral(following) => {
                following.predicted((&self.site, &self.place), pose, motion)
            }
            Hold::Unilateral(_) => None,
        }
    }
}

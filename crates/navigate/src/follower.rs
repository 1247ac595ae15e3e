//! The tissue that follows the applicator, one pose after the other.

use crate::Error;
use crate::answer::Followed;
use crate::departure::boundary;
use crate::region::LiveRegion;
use crate::tool::Tool;
use std::sync::Arc;
use supine_fem::{
    Applicator, Body, Budget, Contact, Insertion, Load, Params, RigidBody, SphereOnShaft,
    snapped_to_cavity,
};
use supine_mesh::{BoundaryTag, Deformation, Edges, Located, Locator, TetMesh};
use supine_space::{Point, Pose, Progress, Vector};
use supine_volume::Ct;

/// Corrections of a step that a fresh factor needs.
const FEW: usize = 2;
/// Tissue and applicator are in balance when the error that is left is estimated below this, mm.
const ERROR_MM: f64 = 0.01;
/// Corrections for one pose: with more, 5,000 tetrahedra would pass over poses. What they leave is
/// told, and made good when there is time.
const BUDGET: Budget = Budget { error_mm: ERROR_MM, corrections: 3, partly: true };
/// The same where what touches is found on the way, too: half found, it means nothing.
const PRESSED: Budget = Budget { error_mm: ERROR_MM, corrections: 12, partly: false };
/// The solver's estimate of its error rests on what the last corrections show: of twenty answers
/// against settled solutions eleven were farther off, by up to a quarter. So many times the
/// estimate is told.
const SAFE: f64 = 3.0;
/// Tissue that is tied to the applicator is taken along from where the applicator comes this near
/// to its planned place, mm,
const TAKEN_MM: f64 = 2.0;
/// until it is this far from it.
const LEFT_MM: f64 = 25.0;
/// Parts of a way that are tried for one pose: as much of it as can be, then half of that.
const TRIES: usize = 2;
/// After a way that was made pressed tissue goes so much farther at once, after one that was not so
/// much less far; never less than this share of what it can: where that fails, it fails for another
/// reason.
const FASTER: f64 = 2.0;
const SLOWER: f64 = 0.25;
const SLOWEST: f64 = 1.0 / 16.0;
/// The part of the way that is made in its own time when nothing else helps.
const PART: f64 = 0.25;
/// Tissue that is pressed waits for an applicator that is so far outside of its planned place, mm.
const OUTSIDE_MM: f64 = 150.0;
/// The wall of the bed lies within so many radii of the cavity.
const BED: f64 = 1.25;

/// When the factor of the stiffness is renewed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Renewal {
    /// In another thread, beside the steps: quick, but what a step rests on depends on the
    /// machine's haste.
    #[default]
    Beside,
    /// Between two steps: the same poses give the same bits.
    Between,
}

/// What is put in, and where.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    /// The applicator.
    pub tool: Tool,
    /// Its planned pose on the table, from its own frame to the patient's, LPS, mm.
    pub placed: Pose,
    /// How tissue is held to it.
    pub contact: Contact,
    /// What was cut out before, in the CT shape, LPS, mm: a sphere, and the way in as its shaft.
    /// For [`Contact::Unilateral`] alone.
    pub cavity: Option<SphereOnShaft>,
    /// When the factor is renewed.
    pub renewal: Renewal,
}

/// The tissue on the table with an applicator.
#[derive(Debug)]
pub struct Follower {
    applicator: Applicator,
    edges: Edges,
    plan: Plan,
    /// Where it was put in.
    put_in: Pose,
    target: Target,
    /// Whether tied tissue has been taken along.
    holds: bool,
    /// Whether the factor has become old.
    renews: bool,
    /// How often in a row nothing moved although it should.
    stalled: usize,
    /// Of the way that pressed tissue can go at once, the share that is tried first.
    pace: f64,
}

/// How a way was gone.
#[derive(Clone, Copy, Debug, Default)]
struct Gone {
    corrections: usize,
    error_mm: f64,
}

/// What is followed.
#[derive(Clone, Debug)]
enum Site {
    /// A place of the tissue, in the CT shape, LPS, mm.
    Tissue { located: Located, in_ct: Point },
    /// The wall of the cavity that the tumour left: points of the mesh, whose middle counts.
    Bed(Vec<u32>),
}

#[derive(Clone, Debug)]
struct Target {
    site: Site,
    /// On the table without applicator, LPS, mm.
    on_table: Point,
}

impl Follower {
    /// Puts an applicator at its planned place into `body` on the table; `target` is a place in the
    /// CT shape, LPS, mm.
    ///
    /// # Errors
    /// When the target lies in no tissue, or as [`Applicator::attach`].
    pub fn new(
        body: &Body,
        load: &Load,
        params: &Params,
        plan: Plan,
        target: &Point,
        progress: Progress<'_>,
    ) -> Result<Self, Error> {
        let body = match &plan.cavity {
            Some(cavity) => {
                let mesh = snapped_to_cavity(&body.mesh, cavity)?.0;
                &Body { mesh, curved: None, ..body.clone() }
            }
            None => body,
        };
        let put_in = put_in(&plan);
        let rigid = plan.tool.at(&put_in);
        let cavity = plan.cavity.as_ref().map(|cavity| cavity as &dyn RigidBody);
        let insertion = Insertion { cavity, ..Insertion::new(&rigid, plan.contact) };
        let (applicator, _) = Applicator::attach(body, load, params, &insertion, progress)?;
        let site = match &plan.cavity {
            Some(cavity) => Site::Bed(bed(&body.mesh, applicator.bearing(), cavity)),
            None => {
                let located = Locator::new(body.mesh.clone()).locate(target);
                Site::Tissue { located: located.ok_or(Error::NoTarget)?, in_ct: *target }
            }
        };
        if matches!(&site, Site::Bed(nodes) if nodes.is_empty()) {
            return Err(Error::NoTarget);
        }
        let edges = Edges::new(&body.mesh);
        let target = Target { site, on_table: *target };
        let mut follower = Self {
            applicator,
            edges,
            plan,
            put_in,
            target,
            holds: false,
            renews: false,
            stalled: 0,
            pace: 1.0,
        };
        let deformation = follower.deformation()?;
        follower.target.on_table = follower.place(&deformation);
        Ok(follower)
    }

    /// What was planned.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The target on the table without applicator, LPS, mm.
    pub fn target_on_table(&self) -> Point {
        self.target.on_table
    }

    /// The CT around the target on the table, to be carried by this tissue.
    ///
    /// # Errors
    /// When the CT cannot be sampled.
    pub fn region(&self, ct: Arc<Ct>) -> Result<LiveRegion, Error> {
        let mesh = Arc::clone(self.deformation()?.mesh());
        LiveRegion::new(ct, mesh, self.applicator.bearing(), &self.target.on_table)
    }

    /// The surface of the tissue, triangles of points of the mesh, outwards: skin, chest wall and
    /// the wall of a cavity.
    ///
    /// # Errors
    /// As [`Applicator::deformation`].
    pub fn surface(&self) -> Result<Vec<[u32; 3]>, Error> {
        let bears = self.applicator.bearing();
        let all =
            boundary(self.deformation()?.mesh(), |t| bears.get(t).is_none_or(|bears| *bears))?;
        let seen = all.into_iter().filter(|face| face.tag != BoundaryTag::Cut);
        Ok(seen.map(|face| face.points).collect())
    }

    /// The mesh displaced from the CT shape as it is now.
    ///
    /// # Errors
    /// As [`Applicator::deformation`].
    pub fn deformation(&self) -> Result<Deformation, Error> {
        Ok(self.applicator.deformation()?)
    }

    /// Follows the applicator to a pose, from its own frame to the patient's, LPS, mm.
    ///
    /// # Errors
    /// When memory is short. A pose for which no equilibrium is found is no error: the answer says
    /// that it has not settled, and how wrong it may be.
    pub fn follow(&mut self, pose: &Pose) -> Result<(Followed, Deformation), Error> {
        let goal = self.goal(pose);
        let Gone { corrections, error_mm } = self.go(&goal)?;
        let left_mm = self.way_mm(self.applicator.pose(), &goal);
        self.renews |= corrections > FEW || left_mm > 0.0 || self.applicator.wants_renewal();
        let deformation = self.deformation()?;
        let target = self.place(&deformation);
        let settled = left_mm == 0.0 && error_mm <= SAFE * ERROR_MM;
        let followed = Followed {
            target,
            moved: target - self.target.on_table,
            touches: self.touches(),
            settled,
            error_mm: error_mm + left_mm,
            corrections,
            force_n: self.applicator.reaction().force_n,
            from_surface_mm: self.plan.tool.at(pose).distance(&target),
            from_axis_mm: Tool::from_axis_mm(pose, &target),
        };
        Ok((followed, deformation))
    }

    /// Where the target is with the applicator at a pose at which it acts, to a relative residual,
    /// in its own time; LPS, mm.
    ///
    /// # Errors
    /// As [`Applicator::settle`].
    pub fn settle(
        &mut self,
        pose: &Pose,
        tolerance: f64,
        progress: Progress<'_>,
    ) -> Result<Point, Error> {
        let goal = pose * self.put_in.inverse();
        self.applicator.settle(&goal, tolerance, progress)?;
        Ok(self.place(&self.deformation()?))
    }

    /// Goes as far towards a goal as there is time, in parts where the whole way is too long for
    /// the factor at hand.
    fn go(&mut self, goal: &Pose) -> Result<Gone, Error> {
        let budget = if self.ties() { BUDGET } else { PRESSED };
        let (mut gone, mut moves) = (Gone::default(), false);
        let mut share = self.pace * self.applicator.share_of_way(goal)?;
        for _ in 0..TRIES {
            let next = between(self.applicator.pose(), goal, share, &self.put_in);
            match self.applicator.step_quickly(&next, budget)? {
                Some(step) => {
                    moves = true;
                    gone.corrections += step.corrections;
                    gone.error_mm = SAFE * step.error_mm;
                    break;
                }
                None => share *= 0.5,
            }
        }
        if !self.ties() {
            let faster = if moves { FASTER } else { SLOWER };
            self.pace = (self.pace * faster).clamp(SLOWEST, 1.0);
        }
        self.stalled = if moves { 0 } else { self.stalled + 1 };
        if self.stalled > self.patience() {
            self.stalled = 0;
            let next = between(self.applicator.pose(), goal, PART, &self.put_in);
            match self.applicator.step(&next) {
                Ok(step) => gone.error_mm = SAFE * step.error_mm,
                // It stays where it was; the answer says how far that is from where it should be.
                Err(
                    supine_fem::Error::ApplicatorStuck { .. }
                    | supine_fem::Error::ApplicatorBuried { .. },
                ) => {}
                Err(other) => return Err(other.into()),
            }
        }
        Ok(gone)
    }

    /// So often nothing may move before a part of the way is made in its own time: a renewed factor
    /// may come first.
    fn patience(&self) -> usize {
        match self.plan.renewal {
            Renewal::Beside if self.ties() => 40,
            // The pace falls first.
            Renewal::Beside => 4,
            Renewal::Between => 1,
        }
    }

    /// Where the applicator has to go from where it was put in, so that it lies at a pose.
    fn goal(&mut self, pose: &Pose) -> Pose {
        let goal = pose * self.put_in.inverse();
        if !self.ties() {
            return goal;
        }
        let away = (pose.translation.vector - self.plan.placed.translation.vector).norm();
        self.holds = if self.holds { away <= LEFT_MM } else { away <= TAKEN_MM };
        if self.holds { goal } else { Pose::identity() }
    }

    fn ties(&self) -> bool {
        matches!(self.plan.contact, Contact::Tied | Contact::Frictionless)
    }

    fn touches(&self) -> bool {
        if self.ties() { self.holds } else { self.applicator.coupled_nodes() > 0 }
    }

    /// What is done between two answers: the factor of the stiffness is renewed when it has become
    /// old.
    ///
    /// # Errors
    /// When memory is short.
    pub fn between(&mut self) -> Result<(), Error> {
        if !std::mem::take(&mut self.renews) {
            return Ok(());
        }
        match self.plan.renewal {
            Renewal::Beside => self.applicator.renew_beside(),
            Renewal::Between => self.applicator.renew()?,
        }
        Ok(())
    }

    /// How far a part of the sphere's surface moves at most between two poses, mm.
    fn way_mm(&self, from: &Pose, to: &Pose) -> f64 {
        let centre = self.put_in.translation.vector.into();
        let shift = (to.transform_point(&centre) - from.transform_point(&centre)).norm();
        let turn = (to.rotation * from.rotation.inverse()).angle();
        if shift == 0.0 && turn < 1e-12 { 0.0 } else { shift + turn * self.plan.tool.radius_mm }
    }

    /// Where the target is under a displacement.
    fn place(&self, deformation: &Deformation) -> Point {
        let (mesh, u) = (deformation.mesh(), deformation.displacement());
        match &self.target.site {
            Site::Tissue { located: Located { tet, weights }, in_ct } => {
                in_ct + u.at(mesh, &self.edges, *tet, *weights)
            }
            Site::Bed(nodes) => {
                let at = |n: &u32| mesh.points()[*n as usize].coords + u.values()[*n as usize];
                (nodes.iter().map(at).sum::<Vector>() / nodes.len() as f64).into()
            }
        }
    }
}

/// Where the applicator is put in: tissue that is held to it takes it where it is planned, tissue
/// that is pressed meets it as it comes, unless it is to lie in a cavity.
fn put_in(plan: &Plan) -> Pose {
    let comes = plan.contact == Contact::Unilateral && plan.cavity.is_none();
    if comes { plan.placed * Pose::translation(0.0, 0.0, -OUTSIDE_MM) } else { plan.placed }
}

/// Points between what bears and what does not, round the tumour and not along the way in.
fn bed(mesh: &TetMesh, bears: &[bool], cavity: &SphereOnShaft) -> Vec<u32> {
    let mut beside = vec![[false; 2]; mesh.points().len()];
    for (tet, bears) in mesh.tets().iter().zip(bears) {
        tet.iter().for_each(|p| beside[*p as usize][usize::from(*bears)] = true);
    }
    let reach = BED * cavity.radius_mm;
    let near = |n: &u32| (mesh.points()[*n as usize] - cavity.centre).norm() <= reach;
    let all = 0..mesh.points().len() as u32;
    all.filter(|n| beside[*n as usize] == [true; 2]).filter(near).collect()
}

/// A share of the way between two poses: the centre of the sphere on a straight line, the turn
/// about one axis.
fn between(from: &Pose, to: &Pose, share: f64, put_in: &Pose) -> Pose {
    if share == 1.0 {
        return *to;
    }
    let centre: Point = put_in.translation.vector.into();
    let (start, end) = (from.transform_point(&centre), to.transform_point(&centre));
    let rotation = from.rotation.slerp(&to.rotation, share);
    let place = start + (end - start) * share;
    let shift = place - rotation.transform_point(&centre);
    Pose::from_parts(shift.into(), rotation)
}

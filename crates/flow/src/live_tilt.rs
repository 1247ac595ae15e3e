//! The breast on a table that is tilted while somebody looks on, and round an applicator: previews
//! on a coarse mesh.

use crate::live_tissue::{Found, LiveMesh, LiveTissue, fits, law};
use crate::session::{Request, Session, Watched};
use crate::spec::Spec;
use crate::{Error, NodeId};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use supine_fem::{
    Applicator, Body, Contact, Insertion, Load, Params, Reaction, RigidBody, Shaft, SphereOnShaft,
    Tilt,
};
use supine_mesh::{Deformation, Displacement, Edges, Located, Locator, Order, Split};
use supine_space::{Point, Pose, Progress, TablePose, Vector};
use supine_tetrahedralise::Refinement;
use supine_volume::Ct;
use supine_warp::{Fading, Frames, Interpolation};

/// Tetrahedra of the preview, quadratic: a turn takes a few milliseconds.
const TETRAHEDRA: usize = 1581;
/// Corrections of a turn or step that a fresh factor needs.
const FEW: usize = 2;
/// The shaft of an applicator reaches out of every breast, mm.
const SHAFT_MM: f64 = 200.0;

/// An applicator as it is put in: a sphere on a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied {
    /// Centre of the sphere where it is put in, LPS, mm, on the table.
    pub centre: Point,
    /// Direction of the shaft, from the sphere outwards; any length.
    pub axis: Vector,
    /// Radius of the sphere, mm.
    pub radius_mm: f64,
    /// Radius of the shaft, mm.
    pub shaft_mm: f64,
    /// Whether tissue slides on it; else it follows.
    pub slides: bool,
}

/// What the tissue does to an applicator, and where the tumour is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactResult {
    /// Force, N, LPS.
    pub force_n: Vector,
    /// Moment about the centre of the sphere, N mm, LPS.
    pub moment_n_mm: Vector,
    /// Distance of a place from the applicator's surface, mm, negative inside: of the tumour's
    /// centre.
    pub away_mm: Option<f64>,
}

impl Applied {
    fn body(&self) -> SphereOnShaft {
        let (direction, radius_mm) = (self.axis, self.shaft_mm);
        let shaft = Some(Shaft { direction, radius_mm, length_mm: SHAFT_MM });
        SphereOnShaft { centre: self.centre, radius_mm: self.radius_mm, shaft }
    }

    fn contact(&self) -> Contact {
        if self.slides { Contact::Frictionless } else { Contact::Tied }
    }
}

/// The CT carried by a coarse mesh under a gravity that turns.
///
/// A preview: its displacement is quadratic in the mechanics, and for the picture linear in the
/// eighths of each tetrahedron. It has the tissue of the case, with what was fitted to scans where
/// that is held.
#[derive(Debug)]
pub struct LiveTilt {
    made_of: MadeOf,
    /// What was given when that was last looked at.
    spec: Arc<Spec>,
    body: Body,
    params: Params,
    tilt: Tilt,
    /// Gravity in the CT.
    ct: Vector,
    /// An applicator, how it was put in, and on which table.
    applicator: Option<(Applicator, Applied, TablePose)>,
    carrier: Carrier,
}

/// What carries the CT by the displacements of a coarse mesh.
#[derive(Debug)]
struct Carrier {
    ct: Arc<Ct>,
    split: Split,
    fading: Fading,
    frames: Frames,
    frame: Ct,
    deformation: Deformation,
    locator: Locator,
    edges: Edges,
}

/// What a preview rests on: another table alone leaves it as it is.
#[derive(Clone, Debug, PartialEq)]
struct MadeOf {
    keys: Vec<Option<String>>,
    law: serde_json::Value,
}

impl MadeOf {
    fn now(session: &Session) -> Result<Self, Error> {
        let mut nodes = vec![NodeId::Import, NodeId::Mesh, NodeId::Moduli];
        if fits(session) {
            nodes.push(NodeId::Fit);
        }
        let keys = nodes.into_iter().map(|node| session.key(node)).collect();
        Ok(Self { keys, law: serde_json::to_value(law(&session.case()))? })
    }
}

impl LiveTilt {
    /// A preview of what is given now, on a level table. What it rests on is made in the session's
    /// lane that the request names, the preview itself in the live lane; not to be called from
    /// there.
    ///
    /// # Errors
    /// When a stage or the solver fails, or the observer ends the work.
    pub fn new(session: &Session, request: &Request<'_>) -> Result<Self, Error> {
        let inputs = Found::new(session, request)?;
        let (made_of, spec) = (MadeOf::now(session)?, session.spec());
        let (observer, failed) = (request.observer, &AtomicBool::new(false));
        let watch = Watched { node: NodeId::Solve, observer, failed };
        let progress = Progress::new(&watch);
        // What is got from the session waits for its lane, which may have one thread: it must not
        // be waited for from there.
        session.on_live(|| {
            let mesh = LiveMesh { tetrahedra: TETRAHEDRA, order: Order::Quadratic };
            let LiveTissue { ct, body, params } =
                inputs.on(mesh, &Refinement::None, progress.part(0.0, 0.3))?;
            let load = inputs.law().load();
            let (tilt, _) = Tilt::new(&body, &load, &params, progress.part(0.3, 0.9))?;
            let carrier = Carrier::new(ct, tilt.deformation()?)?;
            let (ct, applicator) = (load.ct, None);
            Ok(Self { made_of, spec, body, params, tilt, ct, applicator, carrier })
        })
    }

    /// Whether nothing else was given since this was last looked at: cheap, for each picture.
    pub fn is_still_of(&self, session: &Session) -> bool {
        Arc::ptr_eq(&self.spec, &session.spec())
    }

    /// Whether it is of what is given now, but for the table. Files are looked at.
    ///
    /// # Errors
    /// When what is given contradicts itself.
    pub fn is_of(&mut self, session: &Session) -> Result<bool, Error> {
        let (spec, now) = (session.spec(), MadeOf::now(session)?);
        let same = self.made_of == now;
        if same {
            self.spec = spec;
        }
        Ok(same)
    }

    /// Tilts the table, and carries the CT where planes of its grid are seen (axis, number):
    /// elsewhere [`Self::ct`] then holds nothing of use.
    ///
    /// # Errors
    /// When no equilibrium is found: all then stays as it was.
    pub fn turn(&mut self, pose: TablePose, seen: &[(usize, usize)]) -> Result<(), Error> {
        let step = self.tilt.turn(&pose.gravity())?;
        // The factor is getting old: another is made while the picture is.
        if step.corrections > FEW || step.by_newton {
            self.tilt.renew_beside();
        }
        self.carrier.carry(self.tilt.deformation()?, seen)
    }

    /// Moves an applicator to a pose on a table (identity: where it was put in), and carries the CT
    /// as [`Self::turn`] does. It is put in anew when it, or the table, is another than before;
    /// `tumour` is a place in the CT that is looked at.
    ///
    /// # Errors
    /// When it holds no tissue, or no equilibrium is found: it then stays where it was.
    pub fn hold(
        &mut self,
        (applied, table): (&Applied, TablePose),
        pose: &Pose,
        tumour: Option<&Point>,
        seen: &[(usize, usize)],
    ) -> Result<ContactResult, Error> {
        let there = self.applicator.take().filter(|(_, of, on)| of == applied && *on == table);
        let mut held = if let Some(there) = there {
            there
        } else {
            let load = Load { ct: self.ct, target: table.gravity() };
            let rigid = applied.body();
            let insertion = Insertion::new(&rigid, applied.contact());
            let none = Progress::none();
            let attached = Applicator::attach(&self.body, &load, &self.params, &insertion, none)?;
            (attached.0, *applied, table)
        };
        let step = held.0.step(pose);
        // One that could not go there stays where it was.
        let (applicator, ..) = self.applicator.insert(held);
        let step = step?;
        if step.corrections > FEW || step.by_newton {
            applicator.renew_beside();
        }
        let Reaction { force_n, moment_n_mm } = applicator.reaction();
        self.carrier.carry(applicator.deformation()?, seen)?;
        // The applicator's own frame is that in which it was put in.
        let there = tumour.and_then(|place| self.carried(place));
        let away = |place: Point| applied.body().distance(&pose.inverse_transform_point(&place));
        Ok(ContactResult { force_n, moment_n_mm, away_mm: there.map(away) })
    }

    /// Takes the applicator out.
    pub fn take_out(&mut self) {
        self.applicator = None;
    }

    /// The CT as it was acquired, HU.
    pub fn acquired(&self) -> &Arc<Ct> {
        &self.carrier.ct
    }

    /// The CT on the table, HU.
    pub fn ct(&self) -> &Ct {
        &self.carrier.frame
    }

    /// Tetrahedra of the coarse mesh.
    pub fn tetrahedra(&self) -> usize {
        self.carrier.deformation.mesh().tets().len()
    }

    /// Where the tissue at a place of the CT is now, LPS, mm; nothing where there is none of the
    /// mesh.
    pub fn carried(&self, place: &Point) -> Option<Point> {
        let Carrier { deformation, locator, edges, .. } = &self.carrier;
        let Located { tet, weights, .. } = locator.locate(place)?;
        Some(place + deformation.displacement().at(deformation.mesh(), edges, tet, weights))
    }
}

impl Carrier {
    fn new(ct: Arc<Ct>, deformation: Deformation) -> Result<Self, Error> {
        let mesh = Arc::clone(deformation.mesh());
        let edges = Edges::new(&mesh);
        let split = Split::new(&mesh, &edges).map_err(Error::Eighths)?;
        let eighths = Arc::new(split.mesh.clone());
        // Looked at for an instant; what is exported is interpolated as the case says.
        let interpolation = Interpolation::Linear;
        let params = supine_warp::Params { interpolation, ..supine_warp::Params::default() };
        let fading = Fading::new(Arc::clone(&mesh));
        let frames = Frames::new(Arc::clone(&ct), eighths, &params)?;
        let frame = (*ct).clone();
        let locator = Locator::new(mesh);
        Ok(Self { ct, split, fading, frames, frame, deformation, locator, edges })
    }

    fn carry(&mut self, deformation: Deformation, seen: &[(usize, usize)]) -> Result<(), Error> {
        self.deformation = deformation;
        let faded = self.fading.fade(&self.deformation, &supine_warp::Params::default())?;
        let displacement = faded.deformation.displacement();
        let values = self.split.values(displacement.order(), displacement.values());
        let eighths = self.frames.mesh();
        let displacement = Displacement::new(eighths, self.frames.edges(), values)?;
        let carried = Deformation::new(Arc::clone(eighths), displacement)?;
        Ok(self.frames.next_seen(&carried, seen, &mut self.frame)?)
    }
}

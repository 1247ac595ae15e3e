//! The breast on a table that is tilted while somebody looks on: a preview on a coarse mesh.

use crate::nodes::{Fit, Import, Law, Mesh, Meshed, Moduli, Tissues, coarser, tissue_map};
use crate::session::{Request, Session, Watched};
use crate::spec::{Case, StiffnessMap};
use crate::{Error, NodeId};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use supine_fem::{Load, Params, Tilt};
use supine_mesh::{Deformation, Displacement, Edges, Located, Locator, Order, Split};
use supine_space::{BedPose, Point, Progress, Vector, supine};
use supine_volume::Ct;
use supine_warp::{Fading, Frames, Interpolation};

/// Tetrahedra of the preview, quadratic: a turn takes a few milliseconds.
const TETRAHEDRA: usize = 1581;

/// Corrections of a turn that a fresh factor needs.
const FEW: usize = 2;

/// The CT carried by a coarse mesh under a gravity that turns.
///
/// A preview: its displacement is quadratic in the mechanics, and for the picture linear in the eighths of each tetrahedron.
/// It has the tissue of the case, with what was fitted to scans where that is held.
#[derive(Debug)]
pub struct LiveBed {
    made_of: MadeOf,
    ct: Arc<Ct>,
    tilt: Tilt,
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
        if session.is_fresh(NodeId::Fit) {
            nodes.push(NodeId::Fit);
        }
        let keys = nodes.into_iter().map(|node| session.key(node)).collect();
        Ok(Self { keys, law: serde_json::to_value(law(&session.case()))? })
    }
}

/// The tissue of a case on a level table.
fn law(case: &Case) -> Law {
    Law::under(case, Load { ct: supine(), target: supine() })
}

impl LiveBed {
    /// A preview of what is given now, on a level table. What it rests on is made in the session's lane that the request
    /// names.
    ///
    /// # Errors
    /// When a stage or the solver fails, or the observer ends the work.
    pub fn new(session: &Session, request: &Request<'_>) -> Result<Self, Error> {
        let input = session.get::<Import>(request)?;
        let meshed = session.get::<Mesh>(request)?;
        let moduli = session.get::<Moduli>(request)?;
        // A fit takes long: without one that is held, the case's own values count.
        let fit = match session.is_fresh(NodeId::Fit) {
            true => Some(session.get::<Fit>(request)?),
            false => None,
        };
        let fit = fit.as_ref().and_then(|fit| fit.tissue());
        let case = session.case();
        let law = law(&case).fitted(fit);
        let (observer, failed) = (request.observer, &AtomicBool::new(false));
        let watch = Watched { node: NodeId::Solve, observer, failed };
        let progress = Progress::new(&watch);
        let plain = supine_fem::Body::new(Arc::clone(&meshed.mesh), law.tissue());
        let mesh = coarser(&plain, TETRAHEDRA, progress.part(0.0, 0.3))?.mesh;
        let moduli = match moduli.as_ref() {
            None => None,
            Some(by) => {
                let tissues = session.get::<Tissues>(request)?;
                let by_labels = case.stiffness.is_some_and(|s| s.map == StiffnessMap::Labels);
                tissue_map(&input, &tissues, by_labels).map(|map| by.on(&mesh, &map))
            }
        };
        let coarse = Meshed { mesh, curved: None, facts: meshed.facts.clone() };
        let body = law.body(&coarse, moduli.as_ref(), fit);
        let params = Params { order: Order::Quadratic, ..law.solver() };
        let (tilt, _) = Tilt::new(&body, &law.load(), &params, progress.part(0.3, 0.9))?;
        Self::of(MadeOf::now(session)?, Arc::clone(&input.ct), tilt)
    }

    fn of(made_of: MadeOf, ct: Arc<Ct>, tilt: Tilt) -> Result<Self, Error> {
        let deformation = tilt.deformation()?;
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
        Ok(Self { made_of, ct, tilt, split, fading, frames, frame, deformation, locator, edges })
    }

    /// Whether it is of what is given now, but for the table.
    ///
    /// # Errors
    /// When what is given contradicts itself.
    pub fn is_of(&self, session: &Session) -> Result<bool, Error> {
        Ok(self.made_of == MadeOf::now(session)?)
    }

    /// Tilts the table, and carries the CT where planes of its grid are seen (axis, number): elsewhere [`Self::ct`] then holds
    /// nothing of use.
    ///
    /// # Errors
    /// When no equilibrium is found: all then stays as it was.
    pub fn turn(&mut self, bed: BedPose, seen: &[(usize, usize)]) -> Result<(), Error> {
        let step = self.tilt.turn(&bed.gravity())?;
        // The factor is getting old: another is made while the picture is.
        if step.corrections > FEW || step.by_newton {
            self.tilt.renew_beside();
        }
        self.deformation = self.tilt.deformation()?;
        let faded = self.fading.fade(&self.deformation, &supine_warp::Params::default())?;
        let displacement = faded.deformation.displacement();
        let values = self.split.values(displacement.order(), displacement.values());
        let eighths = self.frames.mesh();
        let displacement = Displacement::new(eighths, self.frames.edges(), values)?;
        let carried = Deformation::new(Arc::clone(eighths), displacement)?;
        Ok(self.frames.next_seen(&carried, seen, &mut self.frame)?)
    }

    /// The CT as it was acquired, HU.
    pub fn acquired(&self) -> &Arc<Ct> {
        &self.ct
    }

    /// The CT on the table, HU.
    pub fn ct(&self) -> &Ct {
        &self.frame
    }

    /// Tetrahedra of the coarse mesh.
    pub fn tetrahedra(&self) -> usize {
        self.deformation.mesh().tets().len()
    }

    /// Where the tissue at a place of the CT is on the table, LPS, mm; nothing where there is none of the mesh.
    pub fn carried(&self, place: &Point) -> Option<Point> {
        let Located { tet, weights, .. } = self.locator.locate(place)?;
        let mesh = self.deformation.mesh();
        let u: Vector = self.deformation.displacement().at(mesh, &self.edges, tet, weights);
        Some(place + u)
    }

    /// The mesh as it lies on the table.
    pub fn deformation(&self) -> &Deformation {
        &self.deformation
    }
}

//! The patient's tissue on a mesh that is fast enough for live work.

use crate::nodes::{
    ByTissue, Fit, Fitted, Import, Imported, Labelled, Law, Mesh, Meshed, Moduli, Tissues, coarser,
    tissue_map,
};
use crate::session::{Request, Session, Watched};
use crate::spec::{Case, StiffnessMap};
use crate::{Error, NodeId};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use supine_fem::{Body, Load, Params};
use supine_mesh::{Order, TetMesh};
use supine_report::TissueFit;
use supine_space::{Progress, supine};
use supine_tetrahedralise::Refinement;
use supine_volume::{Ct, Volume};

/// The patient's tissue on a mesh of its own, with the case's tissue, and with what was fitted to
/// scans where that is held.
#[derive(Clone, Debug)]
pub struct LiveTissue {
    /// The CT, HU.
    pub ct: Arc<Ct>,
    /// The tissue in the CT shape.
    pub body: Body,
    /// How it is solved.
    pub params: Params,
}

/// How fine the mesh for live work is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LiveMesh {
    /// Tetrahedra that are asked for; where the planning mesh has less than twice as many it is
    /// taken itself.
    pub tetrahedra: usize,
    /// Order of the elements.
    pub order: Order,
}

impl LiveTissue {
    /// The tissue of what is given now. What it rests on is got from the session.
    ///
    /// # Errors
    /// When a stage or the mesher fails, or the observer ends the work.
    pub fn new(session: &Session, request: &Request<'_>, mesh: LiveMesh) -> Result<Self, Error> {
        Self::finer(session, request, mesh, |_| None)
    }

    /// The same, finer in some places of the planning mesh: the longest edges wanted there, mm, on
    /// a grid (LPS). The number of tetrahedra stays. A planning mesh that is taken itself is left
    /// as it is.
    ///
    /// # Errors
    /// As [`LiveTissue::new`].
    pub fn finer(
        session: &Session,
        request: &Request<'_>,
        mesh: LiveMesh,
        longest_mm: impl FnOnce(&TetMesh) -> Option<Volume<f32>> + Send,
    ) -> Result<Self, Error> {
        let inputs = Found::new(session, request)?;
        let (observer, failed) = (request.observer, &AtomicBool::new(false));
        let watch = Watched { node: NodeId::Mesh, observer, failed };
        session.on_live(|| {
            let longest = longest_mm(&inputs.meshed.mesh);
            let refinement = longest.map_or(Refinement::None, Refinement::Longest);
            inputs.on(mesh, &refinement, Progress::new(&watch))
        })
    }

    /// Gravity in the CT and on the table of the case.
    ///
    /// # Errors
    /// When the case says nothing of the table.
    pub fn load(session: &Session) -> Result<Load, Error> {
        Ok(session.case().load()?)
    }
}

/// Whether the case asks for a fit to scans, and one is held.
pub(crate) fn fits(session: &Session) -> bool {
    session.case().fit_scans().is_some() && session.is_fresh(NodeId::Fit)
}

/// The tissue of a case on a level table.
pub(crate) fn law(case: &Case) -> Law {
    Law::under(case, case.load_to(supine()))
}

/// What live tissue is made of.
pub(crate) struct Found {
    case: Arc<Case>,
    input: Arc<Imported>,
    meshed: Arc<Meshed>,
    moduli: Arc<Option<ByTissue>>,
    fit: Option<Arc<Fitted>>,
    tissues: Option<Arc<Labelled>>,
}

impl Found {
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub(crate) fn new(session: &Session, request: &Request<'_>) -> Result<Self, Error> {
        let input = session.get::<Import>(request)?;
        let meshed = session.get::<Mesh>(request)?;
        let moduli = session.get::<Moduli>(request)?;
        // A fit takes long: without one that is held, the case's own values count.
        let fit = match fits(session) {
            true => Some(session.get::<Fit>(request)?),
            false => None,
        };
        let tissues = match moduli.as_ref() {
            Some(_) => Some(session.get::<Tissues>(request)?),
            None => None,
        };
        Ok(Self { case: session.case(), input, meshed, moduli, fit, tissues })
    }

    /// What was fitted.
    fn tissue(&self) -> Option<&TissueFit> {
        self.fit.as_ref().and_then(|fit| fit.tissue())
    }

    /// The law of the tissue on a level table.
    pub(crate) fn law(&self) -> Law {
        law(&self.case).fitted(self.tissue())
    }

    /// # Errors
    /// When the user stops.
    pub(crate) fn on(
        &self,
        mesh: LiveMesh,
        refinement: &Refinement,
        progress: Progress<'_>,
    ) -> Result<LiveTissue, Error> {
        let (law, fit) = (self.law(), self.tissue());
        let plain = Body::new(Arc::clone(&self.meshed.mesh), law.tissue());
        let on = coarser(&plain, mesh.tetrahedra, refinement, progress)?.mesh;
        let by_labels = self.case.stiffness.is_some_and(|s| s.map == StiffnessMap::Labels);
        let moduli = self.moduli.as_ref().as_ref().zip(self.tissues.as_ref());
        let moduli = moduli.and_then(|(by, tissues)| {
            tissue_map(&self.input, tissues, by_labels).map(|map| by.on(&on, &map))
        });
        let by_scan = self.fit.as_ref().and_then(|fit| fit.by_tissue());
        let moduli = by_scan.map(|by| by.carried(&self.meshed.mesh, &on)).or(moduli);
        // Curved edges belong to the mesh that they were found for.
        let same = Arc::ptr_eq(&on, &self.meshed.mesh);
        let curved = self.meshed.curved.clone().filter(|_| same);
        let meshed = Meshed { mesh: on, curved, facts: self.meshed.facts.clone() };
        let body = law.body(&meshed, moduli.as_ref(), fit);
        let params = Params { order: mesh.order, ..law.solver() };
        Ok(LiveTissue { ct: Arc::clone(&self.input.ct), body, params })
    }
}

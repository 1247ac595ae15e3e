//! Results as values, computed when they are asked for.

use super::observer::Watched;
use super::{Freshness, Request, Session};
use crate::nodes::{
    Evaluation, Fields, Fit, Import, Interval, Mesh, Points, Region, Segment, Solve, Tissues, Warp,
};
use crate::{Error, NodeId};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use supine_mesh::{Deformation, TetMesh};
use supine_report::{
    CarriedPoint, Evaluation as Evaluated, Movement, PatientIdentity, TissueFit, TumourInterval,
    UncertainPatch,
};
use supine_segment::tumour_place;
use supine_space::{Progress, Side, Sphere};
use supine_volume::{Ct, LabelMap, Surfaces, Volume};
use supine_warp::MovingPart;

impl Session {
    /// The CT as it was read, HU.
    ///
    /// # Errors
    /// When it cannot be read, or the observer ends the work.
    pub fn ct(&self, request: &Request<'_>) -> Result<Arc<Ct>, Error> {
        Ok(Arc::clone(&self.get::<Import>(request)?.ct))
    }

    /// Labels of chest wall and soft tissue.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn labels(&self, request: &Request<'_>) -> Result<Arc<LabelMap>, Error> {
        Ok(Arc::clone(&self.get::<Segment>(request)?.labels))
    }

    /// Whose CT is held; none when it is none of DICOM, or is not read.
    pub fn peek_whose(&self) -> Option<PatientIdentity> {
        let (imported, _) = self.peek::<Import>()?;
        imported.source.as_ref().map(|source| source.whose())
    }

    /// Labels that are held, of what is given now or of what was given before; nothing is made.
    pub fn peek_labels(&self) -> Option<(Arc<LabelMap>, Freshness)> {
        let (segmented, freshness) = self.peek::<Segment>()?;
        Some((Arc::clone(&segmented.labels), freshness))
    }

    /// The deformed CT that is held, of what is given now or of what was given before; nothing is
    /// made.
    pub fn peek_deformed_ct(&self) -> Option<(Arc<Ct>, Freshness)> {
        let (warped, freshness) = self.peek::<Warp>()?;
        Some((Arc::clone(&warped.ct), freshness))
    }

    /// The displacement that carried the deformed CT that is held (that of the tissue, faded
    /// towards the cut), of what is given now or of what was given before; nothing is made.
    pub fn peek_carried(&self) -> Option<(Arc<Deformation>, Freshness)> {
        let (warped, freshness) = self.peek::<Warp>()?;
        Some((Arc::clone(&warped.carried), freshness))
    }

    /// Skin and chest wall as they are drawn, made if they are not held: between the voxels, of
    /// supplied labels half way between these.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn surfaces(&self, request: &Request<'_>) -> Result<Arc<Surfaces>, Error> {
        let segmented = self.get::<Segment>(request)?;
        let (node, observer, failed) = (NodeId::Segment, request.observer, &AtomicBool::new(false));
        let watch = Watched { node, observer, failed };
        self.pool_of(request.lane).install(|| segmented.drawn(Progress::new(&watch)))
    }

    /// Skin and chest wall as they are drawn, if they are held, of the labels that are held;
    /// nothing is made.
    pub fn peek_surfaces(&self) -> Option<Arc<Surfaces>> {
        self.peek::<Segment>()?.0.peek_drawn()
    }

    /// The map of the uncertainty of the chest wall that is held, tenths of mm, of the labels that
    /// are held; nothing is made.
    pub fn peek_uncertainty(&self) -> Option<Arc<Volume<u8>>> {
        self.peek::<Segment>()?.0.peek_uncertainty()
    }

    /// Whether a result is held that is of what is given now.
    pub fn is_fresh(&self, node: NodeId) -> bool {
        self.is_held(node) && !self.is_stale(node)
    }

    /// The mesh that is held, in the CT shape, of what is given now or of what was given before;
    /// nothing is made.
    pub fn peek_mesh(&self) -> Option<(Arc<TetMesh>, Freshness)> {
        let (meshed, freshness) = self.peek::<Mesh>()?;
        Some((Arc::clone(&meshed.mesh), freshness))
    }

    /// The tumour before and after that is held, LPS, mm, with the interval of its displacement
    /// where that could be found; nothing is made. Nothing either while one of the two is of what
    /// was given before.
    pub fn peek_tumour(&self) -> Option<(Movement, Option<TumourInterval>)> {
        let (points, of_points) = self.peek::<Points>()?;
        let (known, of_interval) = self.peek::<Interval>()?;
        let fresh = of_points == Freshness::Fresh && of_interval == Freshness::Fresh;
        fresh.then(|| (points.tumour.clone(), known.interval.clone()))
    }

    /// The region that is held, LPS, mm, and the uncertain places of the chest wall in it, the
    /// largest first; nothing is made.
    pub fn peek_region(&self) -> Option<(Sphere, Vec<UncertainPatch>)> {
        let (chosen, _) = self.peek::<Region>()?;
        Some((chosen.sphere().ok()?, chosen.patches().to_vec()))
    }

    /// The tumour as the case gives it, LPS, mm; of one named by a structure, once its file was
    /// read.
    pub fn tumour_sphere(&self) -> Option<Sphere> {
        self.case_state().tumour().ok().map(|placed| placed.sphere)
    }

    /// The side of the body on which a place of the CT that is held lies (LPS, mm), where it lies
    /// in tissue and clearly on one; nothing is read.
    pub fn propose_side(&self, centre_mm: [f64; 3]) -> Option<Side> {
        let (input, _) = self.peek::<Import>()?;
        let sphere = Sphere::new(centre_mm.into(), 1.0).ok()?;
        tumour_place(&input.ct, sphere, None).ok()?.side
    }

    /// The mesh in the CT shape; points LPS, mm.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn mesh(&self, request: &Request<'_>) -> Result<Arc<TetMesh>, Error> {
        Ok(Arc::clone(&self.get::<Mesh>(request)?.mesh))
    }

    /// The mesh with the displacement of its nodes, mm, LPS, from the CT shape.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn deformation(&self, request: &Request<'_>) -> Result<Deformation, Error> {
        Ok(self.get::<Solve>(request)?.deformation.clone())
    }

    /// The CT on the table, HU.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn deformed_ct(&self, request: &Request<'_>) -> Result<Arc<Ct>, Error> {
        Ok(Arc::clone(&self.get::<Warp>(request)?.ct))
    }

    /// The displacement as fields on the part of the CT's voxels that moves, both ways (LPS, mm),
    /// and its Jacobian.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn fields(&self, request: &Request<'_>) -> Result<Arc<MovingPart>, Error> {
        if let Some(held) = self.get::<Fields>(request)?.held() {
            return Ok(held);
        }
        // Of those that a folder keeps only the facts are read back.
        let (input, solved) = (self.get::<Import>(request)?, self.get::<Solve>(request)?);
        let (node, observer, failed) = (NodeId::Fields, request.observer, &AtomicBool::new(false));
        let watch = Watched { node, observer, failed };
        let made = || Fields::map(&input, &solved, Progress::new(&watch));
        self.pool_of(request.lane).install(made).map(Arc::new)
    }

    /// Labels of the finer tissues; none when the case does not ask for them.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn tissues(&self, request: &Request<'_>) -> Result<Option<Arc<LabelMap>>, Error> {
        Ok(self.get::<Tissues>(request)?.labels.clone())
    }

    /// The points of the case before and after, LPS, mm.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn points(&self, request: &Request<'_>) -> Result<Vec<CarriedPoint>, Error> {
        Ok(self.get::<Points>(request)?.points.clone())
    }

    /// The nipple before and after, LPS, mm; nothing where none was found in the tissue that is
    /// modelled.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn nipple(&self, request: &Request<'_>) -> Result<Option<Movement>, Error> {
        Ok(self.get::<Points>(request)?.nipple.clone())
    }

    /// The modulus that fits the scans; none when the case names none.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn fit(&self, request: &Request<'_>) -> Result<Option<TissueFit>, Error> {
        Ok(self.get::<Fit>(request)?.tissue().cloned())
    }

    /// How far a scan on the operating table lies off the result; nothing when the case names none.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn evaluation(&self, request: &Request<'_>) -> Result<Option<Evaluated>, Error> {
        Ok(self.get::<Evaluation>(request)?.facts.clone())
    }

    /// The tumour before and after, LPS, mm.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn tumour(&self, request: &Request<'_>) -> Result<Movement, Error> {
        Ok(self.get::<Points>(request)?.tumour.clone())
    }

    /// The sphere that is modelled, LPS, mm.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn region(&self, request: &Request<'_>) -> Result<Sphere, Error> {
        self.get::<Region>(request)?.sphere()
    }

    /// How sure the tumour's displacement is; nothing where that could not be found.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn tumour_interval(&self, request: &Request<'_>) -> Result<Option<TumourInterval>, Error> {
        Ok(self.get::<Interval>(request)?.interval.clone())
    }

    /// Brings nodes up to date, in memory and in the folder if there is one.
    ///
    /// # Errors
    /// When a stage fails, or the observer ends the work.
    pub fn update(&self, nodes: &[NodeId], request: &Request<'_>) -> Result<(), Error> {
        self.bring(nodes, &[], request).map(drop)
    }
}

//! The patient of a finished run, on the operating table.

use crate::Error;
use crate::answer::Certainty;
use crate::follower::{Follower, Plan};
use crate::settings::Settings;
use crate::tool::facing;
use std::path::Path;
use std::sync::Arc;
use supine_fem::{Load, RigidBody, Shaft, SphereOnShaft};
use supine_flow::{FinishedRun, LiveTissue, Observer, Request, RunFolder, Session, Spec};
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Grid, Matrix, Point, Pose, Progress, Sphere, Vector};
use supine_volume::{Ct, Volume};

/// The way in is wider than the shaft by this, mm: an incision is held open.
const WAY_IN_MM: f64 = 6.0;
/// Edges along the wall of a cavity are no longer, mm, and grow so much with the distance from it,
/// mm per mm,
const EDGE_MM: f64 = 7.0;
const GROWTH: f64 = 0.5;
/// as is told on a grid of this spacing to so far from its sphere, mm.
const EDGES_MM: f64 = 3.0;
const AROUND_MM: f64 = 40.0;

/// What a run knows of the patient, and the tissue for live work.
#[derive(Debug)]
pub struct Patient {
    tissue: LiveTissue,
    load: Load,
    /// In the CT, LPS, mm.
    tumour: Sphere,
    /// Its centre on the table, LPS, mm.
    on_table: Point,
    within_mm: Option<f64>,
    /// From the tumour to the nearest skin, in the CT.
    outwards: Vector,
}

impl Patient {
    /// Opens a finished run; nothing of it is changed.
    ///
    /// # Errors
    /// When there is none, when its inputs or the methods are others than then, or the observer
    /// ends the work.
    pub fn open(
        run: &Path,
        settings: &Settings,
        threads: usize,
        observer: &dyn Observer,
    ) -> Result<Self, Error> {
        let finished = FinishedRun::open(run)?;
        let spec = Spec::read(&run.join("summary.json")).map_err(supine_flow::Error::from)?;
        let session = Session::new(spec, threads)?;
        if !finished.is_of(&session)? {
            return Err(Error::OtherRun { path: run.into() });
        }
        session.keep_in(Some(RunFolder::open(run)?))?;
        let request = Request { observer, ..Request::default() };
        let tumour = session.tumour_sphere().ok_or(Error::NoTarget)?;
        // By the planning mesh: the plan is the same on all meshes.
        let mut skin = None;
        let longest = |planning: &TetMesh| {
            skin = outwards(planning, &tumour.centre());
            edges_round(&cavity(&tumour, skin?, settings)?)
        };
        let tissue = LiveTissue::finer(&session, &request, settings.mesh(), longest)?;
        let moved = session.tumour(&request)?;
        let interval = session.tumour_interval(&request)?;
        // All is read: others may open the run.
        session.keep_in(None)?;
        let outwards = skin.ok_or(Error::NoDirection)?;
        Ok(Self {
            tissue,
            load: LiveTissue::load(&session)?,
            tumour,
            on_table: moved.after_mm.into(),
            within_mm: interval.map(|interval| interval.within_mm),
            outwards,
        })
    }

    /// Tetrahedra of the mesh.
    pub fn tetrahedra(&self) -> usize {
        self.tissue.body.mesh.tets().len()
    }

    /// Radius of the tumour, mm.
    pub fn tumour_radius_mm(&self) -> f64 {
        self.tumour.radius()
    }

    /// The tumour's centre on the table, LPS, mm.
    pub fn tumour_on_table(&self) -> Point {
        self.on_table
    }

    /// How sure that is; `registration_mm`: expected target registration error.
    pub fn certainty(&self, registration_mm: f64) -> Certainty {
        Certainty { tissue_mm: self.within_mm, registration_mm }
    }

    /// Where the applicator is planned.
    ///
    /// # Errors
    /// When the direction of the shaft has no length.
    pub fn placed(&self, settings: &Settings) -> Result<Pose, Error> {
        let from = settings.from.map_or(self.outwards, Vector::from);
        let rotation = facing(&from).ok_or(Error::NoDirection)?;
        let beside = match settings.cavity_mm {
            Some(_) => 0.0,
            None => self.tumour.radius() + settings.radius_mm,
        };
        let own = self.on_table + from.normalize() * beside;
        let centre = settings.at_mm.map_or(own, Point::from);
        Ok(Pose::from_parts(centre.into(), rotation))
    }

    /// The tissue with the applicator at its planned place.
    ///
    /// # Errors
    /// As [`Follower::new`].
    pub fn follower(&self, settings: &Settings, progress: Progress<'_>) -> Result<Follower, Error> {
        let plan = Plan {
            tool: settings.tool(),
            placed: self.placed(settings)?,
            contact: settings.contact(),
            cavity: cavity(&self.tumour, self.outwards, settings),
            renewal: settings.renewal(),
        };
        let LiveTissue { body, params, .. } = &self.tissue;
        Follower::new(body, &self.load, params, plan, &self.tumour.centre(), progress)
    }

    /// The CT.
    pub fn ct(&self) -> Arc<Ct> {
        Arc::clone(&self.tissue.ct)
    }
}

/// What was cut out, in the CT: the tumour with so much around it, and a way in from the skin.
fn cavity(tumour: &Sphere, outwards: Vector, settings: &Settings) -> Option<SphereOnShaft> {
    let radius_mm = tumour.radius() + settings.cavity_mm?;
    let wide = (settings.shaft_radius_mm + WAY_IN_MM).min(radius_mm);
    let way = Shaft { direction: outwards, radius_mm: wide, length_mm: settings.shaft_mm };
    Some(SphereOnShaft { centre: tumour.centre(), radius_mm, shaft: Some(way) })
}

/// The longest edges with which the wall of a cavity is one, mm.
fn edges_round(cavity: &SphereOnShaft) -> Option<Volume<f32>> {
    let reach = cavity.radius_mm + AROUND_MM;
    let size = (2.0 * reach / EDGES_MM).ceil();
    let start = cavity.centre - Vector::repeat(0.5 * size * EDGES_MM);
    let grid =
        Grid::new([size as usize + 1; 3], Vector::repeat(EDGES_MM), start, Matrix::identity());
    let grid = grid.ok()?;
    let longest = |place: &Point| EDGE_MM + GROWTH * cavity.distance(place).abs();
    Some(Volume::from_fn(grid.clone(), |voxel| longest(&grid.centre(voxel)) as f32))
}

/// From a place in the tissue to the nearest point of the skin.
fn outwards(mesh: &TetMesh, place: &Point) -> Option<Vector> {
    let skin = mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::Skin);
    let points = skin.flat_map(|face| face.points).map(|p| mesh.points()[p as usize] - place);
    points.min_by(|a, b| a.norm().total_cmp(&b.norm()))?.try_normalize(1e-6)
}

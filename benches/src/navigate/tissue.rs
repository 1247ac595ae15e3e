//! The tissue of a run, as a session has it.

use anyhow::{Context, Result, bail, ensure};
use std::path::Path;
use supine_fem::{Applicator, Contact, Error, Insertion};
use supine_flow::{LiveTissue, Request, RunFolder, Session, Spec};
use supine_mesh::{Edges, Located, Locator};
use supine_navigate::{Follower, Patient, Settings};
use supine_space::{Point, Pose, Progress, Vector};

/// Relative residual of what knows nothing of the way.
const SETTLED: f64 = 1e-10;
/// Parts of the way there, if it cannot be gone at once.
const PARTS: [u32; 4] = [1, 4, 16, 64];
/// So far outside of its planned place an applicator touches nothing, mm.
const AWAY_MM: f64 = 150.0;

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn patient(run: &Path, settings: &Settings) -> Result<Patient> {
    let request = Request::default();
    Ok(Patient::open(run, settings, threads(), request.observer)?)
}

/// Where the applicator is planned, and the number of tetrahedra.
pub(crate) fn planned(run: &Path, settings: &Settings) -> Result<(Pose, usize)> {
    let patient = patient(run, settings)?;
    Ok((patient.placed(settings)?, patient.tetrahedra()))
}

/// What a session solves with.
pub(crate) fn follower(run: &Path, settings: &Settings) -> Result<Follower> {
    Ok(patient(run, settings)?.follower(settings, Progress::none())?)
}

/// Solves each pose as if there had been none before.
pub(crate) struct Cold {
    tissue: LiveTissue,
    session: Session,
    placed: Pose,
    settings: Settings,
    edges: Edges,
    target: (Point, Located),
}

impl Cold {
    pub(crate) fn open(run: &Path, settings: &Settings) -> Result<Self> {
        ensure!(settings.cavity_mm.is_none(), "without a cavity alone: it changes the mesh");
        let (placed, _) = planned(run, settings)?;
        let session = Session::new(Spec::read(&run.join("summary.json"))?, threads())?;
        session.keep_in(Some(RunFolder::open(run)?))?;
        let tissue = LiveTissue::new(&session, &Request::default(), settings.mesh())?;
        let centre = session.tumour_sphere().context("the case has no tumour")?.centre();
        let mesh = &tissue.body.mesh;
        let located = Locator::new(mesh.clone()).locate(&centre);
        let target = (centre, located.context("the tumour lies in no tissue")?);
        let (settings, edges) = (settings.clone(), Edges::new(mesh));
        Ok(Self { tissue, session, placed, settings, edges, target })
    }

    /// The tumour's place with the applicator at a pose at which it acts; LPS, mm.
    pub(crate) fn place(&self, pose: &Pose) -> Result<Point> {
        let contact = self.settings.contact();
        // Tissue that is pressed meets the applicator as it comes.
        let away_mm = if contact == Contact::Unilateral { AWAY_MM } else { 0.0 };
        let put_in = self.placed * Pose::translation(0.0, 0.0, -away_mm);
        let rigid = self.settings.tool().at(&put_in);
        let LiveTissue { body, params, .. } = &self.tissue;
        let insertion = Insertion::new(&rigid, contact);
        let load = LiveTissue::load(&self.session)?;
        let (mut applicator, _) =
            Applicator::attach(body, &load, params, &insertion, Progress::none())?;
        settle(&mut applicator, &put_in, pose)?;
        let deformation = applicator.deformation()?;
        let (centre, Located { tet, weights }) = self.target;
        let u: Vector = deformation.displacement().at(&body.mesh, &self.edges, tet, weights);
        Ok(centre + u)
    }
}

/// Goes to a pose from where the applicator was put in, its centre on a straight line, in as few parts as will do.
fn settle(applicator: &mut Applicator, put_in: &Pose, goal: &Pose) -> Result<()> {
    for parts in PARTS {
        let from = applicator.pose() * put_in;
        let pose = |share: f64| match share {
            1.0 => *goal,
            share => from.lerp_slerp(goal, share),
        };
        let steps = (1..=parts).map(|n| pose(f64::from(n) / f64::from(parts)));
        let gone = steps
            .map(|pose| applicator.settle(&(pose * put_in.inverse()), SETTLED, Progress::none()));
        match gone.collect::<Result<Vec<_>, _>>() {
            Ok(_) => return Ok(()),
            Err(Error::ApplicatorStuck { .. } | Error::ApplicatorBuried { .. }) => {}
            Err(other) => return Err(other.into()),
        }
    }
    bail!("no equilibrium was found in {} parts either", PARTS[PARTS.len() - 1])
}

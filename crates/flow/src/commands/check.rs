//! `supine check`: whether a case can be run, and what a run would do.

use super::run::{Change, spec};
use super::{Gather, messages};
use crate::folder::FinishedRun;
use crate::nodes::{Import, Objects, Segment, Source, Tumour, check_seeds};
use crate::session::{Request, Session};
use crate::shared::carry::NOT_ANEW;
use crate::shared::{SeenScan, landmarks};
use crate::{Error, NodeId, Observer};
use serde::Serialize;
use std::path::PathBuf;
use supine_exchange::{is_points_name, read_points};
use supine_report::Warning;
use supine_space::Grid;
use supine_volume::RegionError;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Check {
    /// A case file, or the summary of a run.
    pub case: PathBuf,
    /// Changes of its values.
    pub changes: Vec<Change>,
    /// The folder of a run, which is only looked at.
    pub out: Option<PathBuf>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct CheckDone {
    /// The case file.
    pub case: PathBuf,
    /// The CT.
    pub ct: CheckedCt,
    /// The tumour.
    pub tumour: CheckedTumour,
    /// The breast, in a word.
    pub breast: String,
    /// Tilt of the table: AP and LAT, degrees.
    #[serde(rename = "bed_deg")]
    pub table_deg: [f64; 2],
    /// Whether the region is proposed from the breast and not given.
    pub region_proposed: bool,
    /// Number of tetrahedra that are asked for.
    pub tetrahedra: usize,
    /// The scans that the case names.
    pub scans: Vec<CheckedScan>,
    /// The stages that a run into the folder would do, in their order, where one was named: all
    /// whose key is not that of the finished run in it.
    pub redone: Option<Vec<&'static str>>,
    /// The finished result of another case in that folder, in words: a run is refused unless it may
    /// replace that.
    pub would_replace: Option<String>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// The CT as it was read.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedCt {
    /// Voxels along i, j, k.
    pub size: [usize; 3],
    /// Distance of voxel centres, mm.
    pub spacing_mm: [f64; 3],
    /// Files that were read.
    pub files: usize,
    /// Files that are no part of it.
    pub left_out: usize,
}

/// A surface scan as it was read.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedScan {
    /// Which one: `sitting`, `supine` or `intraop`.
    pub name: &'static str,
    /// Points that were taken.
    pub points: usize,
    /// The unit of its lengths.
    pub unit: &'static str,
    /// Whether that was told from its size, since nobody said it.
    pub unit_detected: bool,
    /// Diagonal of the box around its points without the outermost, mm.
    pub size_mm: f64,
}

/// The tumour in the CT.
#[derive(Clone, Debug, Serialize)]
pub struct CheckedTumour {
    /// LPS, mm.
    pub centre_mm: [f64; 3],
    /// mm.
    pub radius_mm: f64,
    /// Mean of the CT about its centre, HU.
    pub mean_hu: f64,
}

/// Checks all that is known of a case before the work is begun: its values together, that its files
/// are there, that the CT is a usable series, that the tumour lies in its tissue and on the right
/// side, that the patient's objects and labels are of this CT, and that scans can be read. A run
/// fails in the same words.
///
/// # Errors
/// Why the case cannot be run.
pub fn check(given: &Check, observer: &dyn Observer) -> Result<CheckDone, Error> {
    let spec = spec(&given.case, &given.changes)?;
    spec.note_doubts(observer);
    spec.check_complete()?;
    let session = super::session(&spec)?;
    let redone = redone(given, &session)?;
    let other = given.out.as_deref().and_then(|out| session.other_result(out));
    let would_replace = other.map(|held| held.told());
    let gather = Gather::new(observer, &[]);
    let request = Request { observer: &gather, ..Request::default() };
    let input = session.get::<Import>(&request)?;
    let placed = session.get::<Tumour>(&request)?;
    let case = session.case();
    let named = case.carried.iter().map(|file| file.path.display().to_string());
    for (object, file) in session.get::<Objects>(&request)?.iter().zip(named) {
        // That a dose is not computed anew, whoever asks for it knows.
        let told = object.warnings.iter().filter(|w| w.code() != NOT_ANEW).cloned();
        gather.warn_all(NodeId::Objects, told.map(|w| w.of(format!("{file}: "))));
    }
    session.get::<Source>(&request)?;
    if session.case().labels.is_some() {
        session.get::<Segment>(&request)?;
    }
    check_points(&session)?;
    let scans = check_scans(&session, &gather)?;
    check_seeds(&session.case_state(), input.ct.grid())?;
    check_region(&session, input.ct.grid())?;
    let (case, sphere) = (session.case(), session.case_state().tumour()?.sphere);
    let pose = case.table_pose()?;
    Ok(CheckDone {
        case: given.case.clone(),
        ct: CheckedCt {
            size: input.facts.size,
            spacing_mm: input.facts.spacing_mm,
            files: input.origin.files,
            left_out: input.facts.left_out.len(),
        },
        tumour: CheckedTumour {
            centre_mm: sphere.centre().coords.into(),
            radius_mm: sphere.radius(),
            mean_hu: placed.mean_hu,
        },
        breast: case.breast()?.to_string(),
        table_deg: [pose.ap_deg, pose.lat_deg],
        region_proposed: case.region.is_none(),
        tetrahedra: case.mesh.tetrahedra,
        scans,
        redone,
        would_replace,
        warnings: gather.warnings(),
    })
}

/// The stages that a run into the named folder would do. All files that the case names are hashed
/// for that, so that a missing one is told.
fn redone(given: &Check, session: &Session) -> Result<Option<Vec<&'static str>>, Error> {
    let run = given.out.as_deref().and_then(|out| FinishedRun::open(out).ok());
    let secret = run.as_ref().map(FinishedRun::secret).transpose()?.flatten();
    let left = run.and_then(|run| run.summary().ok()).map(|summary| summary.chain);
    let redone = session.redone(&left.unwrap_or_default(), secret)?;
    let names = redone.into_iter().map(NodeId::name).collect();
    Ok(given.out.is_some().then_some(names))
}

/// That a region that was given lies in the CT. A run tells it in the same words.
fn check_region(session: &Session, grid: &Grid) -> Result<(), Error> {
    match session.case().region {
        Some(region) if grid.around(&region).is_none() => {
            let (centre, radius) = (region.centre().coords.into(), region.radius());
            Err(RegionError::NoSoftTissue { centre, radius }.into())
        }
        _ => Ok(()),
    }
}

/// That the lists of points can be read.
fn check_points(session: &Session) -> Result<(), Error> {
    let (case, case_state) = (session.case(), session.case_state());
    let seeds = case.seeds.files.iter().filter(|path| is_points_name(path));
    let seeds = seeds.map(|path| ("seeds.file", path));
    for (key, path) in seeds.chain(case.points.iter().map(|path| ("carry.points", path))) {
        read_points(&case_state.path(path)).map_err(|e| Error::file(key, e))?;
    }
    Ok(())
}

/// That the scans can be read and agree with their landmarks, and what they are.
fn check_scans(session: &Session, gather: &Gather<'_>) -> Result<Vec<CheckedScan>, Error> {
    let (case, case_state) = (session.case(), session.case_state());
    let Some(scans) = &case.scans else { return Ok(vec![]) };
    let fit = scans.fit.as_ref();
    let named = [
        (NodeId::Fit, "scans.sitting", "sitting", fit.map(|fit| &fit.sitting)),
        (NodeId::Fit, "scans.supine", "supine", fit.and_then(|fit| fit.supine.as_ref())),
        (NodeId::Evaluation, "scans.intraop", "intraop", scans.intraop.as_ref()),
    ];
    let of = |path| case_state.file("scans.landmarks", path);
    let landmarks = landmarks(scans.landmarks.as_deref().map(of).transpose()?.as_ref())?;
    let mut checked = Vec::new();
    for (node, key, name, path) in named {
        let Some(path) = path else { continue };
        let seen = SeenScan::read(&case_state.file(key, path)?, (name, scans.unit), &landmarks)?;
        checked.push(CheckedScan {
            name,
            points: seen.posed.scan.points().len(),
            unit: seen.file.unit.name(),
            unit_detected: seen.file.detected,
            size_mm: seen.file.size_mm,
        });
        gather.warn_all(node, seen.file.info.warnings);
    }
    Ok(checked)
}

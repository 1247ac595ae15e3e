//! `supine warp`: a CT resampled through a deformed mesh.

mod grid;

pub use grid::OutputGrid;

use super::{Gather, Outputs, ends, given_deformation, messages, session, usage};
use crate::nodes::{
    Fields, Import, Imported, Segment, Segmented, Solve, Solved, Source, Warp as WarpNode,
    beyond_field,
};
use crate::session::{Request, Session, Start};
use crate::shared::{
    ExportSource, IMAGE_COMMENTS, REGISTRATIONS, RegisteredSeries, write_registration,
};
use crate::spec::{CaseError, Spec};
use crate::{Error, NodeId, Observer};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supine_dicom::{ExportParams, Policy};
use supine_exchange::{FieldKind, write_ct, write_field, write_scalar, write_transform};
use supine_mesh::Deformation;
use supine_report::{Consistency, Registration, Warning};
use supine_space::Progress;
use supine_volume::{Ct, label};
use supine_warp::{Interpolation, MovingPart, Params};

/// Keys of the table that it takes.
pub const KEYS: &[&str] = &[
    "ct",
    "series",
    "exclude",
    "assume_hu",
    "equalise_steps",
    "warp.interpolation",
    "breast",
    "export.anonymise",
];

/// What is asked.
#[derive(Clone, Debug)]
pub struct Warp {
    /// Values for [`KEYS`].
    pub spec: Spec,
    /// The deformed mesh: CT shape with point data `displacement`.
    pub mesh: PathBuf,
    /// Other voxels than those of the CT; for a file, not for a series.
    pub grid: OutputGrid,
    /// A folder for the map as fields on the voxels of the CT that it moves.
    pub fields: Option<PathBuf>,
    /// A folder for the map as registrations of the series with the CT.
    pub registration: Option<PathBuf>,
    /// A folder for a series, or a `.nrrd`, `.nii`, `.nii.gz` or `.mha` file.
    pub out: PathBuf,
    /// When it began: what a DICOM object bears; without it the time of the source series.
    pub start: Option<Start>,
    /// Whether files that are there already may be replaced.
    pub overwrite: bool,
}

/// What was made.
#[derive(Clone, Debug, Serialize)]
pub struct WarpDone {
    /// The folder or file.
    pub out: PathBuf,
    /// Voxels that now hold sampled tissue.
    pub moved_voxels: usize,
    /// Voxels that became air.
    pub vacated_voxels: usize,
    /// Voxels inside more than one deformed tetrahedron.
    pub folded_voxels: usize,
    /// Width over which the displacement fades towards the cut, mm.
    pub fade_mm: f64,
    /// Smallest det F.
    pub jacobian_min: f64,
    /// Largest det F.
    pub jacobian_max: f64,
    /// The folder of the fields.
    pub fields: Option<PathBuf>,
    /// How well the registrations tell the map.
    pub registration: Option<Registration>,
    /// How well the fields undo each other; none where nothing moves.
    pub forward_then_backward: Option<Consistency>,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// Resamples a CT through a deformed mesh.
///
/// # Errors
/// When an input cannot be used, options do not go together, or a file cannot be written.
pub fn warp(given: &Warp, observer: &dyn Observer) -> Result<WarpDone, Error> {
    let file = ends(&given.out, &[".nrrd", ".nii", ".nii.gz", ".mha"]);
    check_together(given, file)?;
    let session = session(&given.spec)?;
    let deformation = given_deformation(&given.mesh)?;
    session.give::<Solve>(Solved::given(deformation.clone()), "a file".into());
    let gather = Gather::new(observer, &[NodeId::Solve]);
    let request = Request { observer: &gather, ..Request::default() };
    let input = session.get::<Import>(&request)?;
    // Without labels nothing tells a clip from a rib: nothing is kept whole.
    let unknown = input.ct.map(|_| label::CHEST_WALL);
    session.give::<Segment>(Segmented::given(Arc::new(unknown), None), "no labels".into());
    let source = match file {
        true => None,
        false => Some(series_source(&session, &input, &request)?),
    };
    let (warped, facts) = warped(given, &session, &request, &deformation)?;
    gather.work(NodeId::Export, |progress| match &source {
        None => write_file(given, &session, &warped, progress),
        Some(named) => write_series(given, &session, &warped, named, &deformation, progress),
    })?;
    drop(warped);
    let mapped = given.fields.is_some() || given.registration.is_some();
    let map = mapped.then(|| session.get::<Fields>(&request)).transpose()?;
    let held = map.as_ref().and_then(|map| map.held());
    if let (Some(folder), Some(held)) = (&given.fields, &held) {
        gather.work(NodeId::Fields, |progress| write_fields(held, folder, progress))?;
    }
    let registration = match (&given.registration, &source, &held) {
        (Some(folder), Some(named), Some(held)) => {
            let (ct, source) = (input.ct.grid(), &named.source);
            let between = RegisteredSeries { ct, source, exported: &given.out };
            let write = |progress: Progress<'_>| {
                write_registration(&between, &deformation, &held.fields, folder, progress)
            };
            Some(gather.work(NodeId::Registration, write)?)
        }
        _ => None,
    };
    Ok(WarpDone {
        out: given.out.clone(),
        moved_voxels: facts.moved_voxels,
        vacated_voxels: facts.vacated_voxels,
        folded_voxels: facts.folded_voxels,
        fade_mm: facts.fade_mm,
        jacobian_min: facts.jacobian.min,
        jacobian_max: facts.jacobian.max,
        fields: given.fields.clone(),
        registration,
        forward_then_backward: map
            .filter(|_| given.fields.is_some())
            .and_then(|map| map.consistency),
        warnings: gather.warnings(),
    })
}

/// Whether a name ends as those of files do, and not as that of a folder with a dot in it may.
fn names_a_kind(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    (3..=4).contains(&ending.len()) && ending.bytes().all(|byte| byte.is_ascii_alphabetic())
}

/// Refuses what a series, or a file, cannot have.
fn check_together(given: &Warp, file: bool) -> Result<(), Error> {
    let out = Some(given.out.as_path());
    Outputs::beside(given.spec.files().chain([given.mesh.as_path()]))
        .file("--out", out.filter(|_| file))
        .folder("--out", out.filter(|_| !file))
        .within("--fields", given.fields.as_deref(), &FIELDS)
        .within("--registration", given.registration.as_deref(), &REGISTRATIONS)
        .check(given.overwrite)?;
    if !file && names_a_kind(&given.out) && !given.out.is_dir() {
        return Err(usage(format!(
            "--out {}: a CT is written as .nrrd, .nii, .nii.gz or .mha, or as a DICOM series into a folder, whose name has no \
             ending",
            given.out.display()
        )));
    }
    if given.grid.is_other() && !file {
        return Err(usage(
            "--spacing, --around, --axial: a DICOM series keeps the CT's grid; name a .nrrd, .nii.gz or .mha file",
        ));
    }
    if given.registration.is_some() && file {
        return Err(usage(
            "--registration: a registration is of a DICOM series; name a folder for it with --out",
        ));
    }
    Ok(())
}

/// The deformed CT, by the node where it keeps its grid.
fn warped(
    given: &Warp,
    session: &Session,
    request: &Request<'_>,
    deformation: &Deformation,
) -> Result<(Arc<Ct>, supine_report::Warp), Error> {
    if !given.grid.is_other() {
        let warped = session.get::<WarpNode>(request)?;
        return Ok((Arc::clone(&warped.ct), warped.facts.clone()));
    }
    let input = session.get::<Import>(request)?;
    let grid = given.grid.of(input.ct.grid(), deformation)?;
    let interpolation = session.case().interpolation;
    let params = Params { interpolation, ..Params::default() };
    let gather = Gather::new(request.observer, &[]);
    let ((ct, info), beyond) = gather.work(NodeId::Warp, |progress| {
        let part = progress.part(0.0, 0.9);
        let made = supine_warp::warp_onto(&grid, &input.ct, deformation, &params, part)?;
        Ok((made, beyond_field(&input, deformation, &params, progress.part(0.9, 1.0))?))
    })?;
    gather.warn_all(NodeId::Warp, info.warnings.iter().cloned().chain(beyond));
    Ok((Arc::new(ct), info.facts))
}

/// What a series of the CT may say.
fn series_source(
    session: &Session,
    input: &Imported,
    request: &Request<'_>,
) -> Result<ExportSource, Error> {
    if input.source.is_none() {
        return Err(usage(
            "--out: the CT did not come as DICOM, so no series can be written; name a .nrrd, .nii.gz or .mha file",
        ));
    }
    if let Err(CaseError::Missing { .. }) = session.case().breast() {
        return Err(usage("--breast left|right is needed for a DICOM series (its Laterality)"));
    }
    session.get::<Source>(request)?.as_ref().clone().ok_or(Error::NoSeries)
}

/// How the volume was made.
fn note(interpolation: Interpolation) -> String {
    format!(
        "DERIVED: resampled ({}) by supine {} through a deformed mesh; not acquired anatomy. HU carried unchanged.",
        interpolation.name(),
        env!("CARGO_PKG_VERSION"),
    )
}

fn write_file(
    given: &Warp,
    session: &Session,
    warped: &Ct,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let note = note(session.case().interpolation);
    write_ct(warped, &given.out, &note, progress).map_err(Error::product)
}

fn write_series(
    given: &Warp,
    session: &Session,
    warped: &Ct,
    named: &ExportSource,
    deformation: &Deformation,
    progress: Progress<'_>,
) -> Result<(), Error> {
    let (case, source) = (session.case(), &named.source);
    let derivation = note(case.interpolation);
    let params = ExportParams {
        series_description: "DEFORMED by a given mesh".into(),
        image_comments: IMAGE_COMMENTS.into(),
        laterality: case.breast()?,
        clock: given.start.as_ref().map_or_else(|| source.clock(), |start| start.clock.clone()),
        software_version: env!("CARGO_PKG_VERSION").into(),
        identity: *blake3::hash(derivation.as_bytes()).as_bytes(),
        derivation,
        reach_mm: deformation.displacement().max_norm(),
        policy: Policy::default(),
    };
    supine_dicom::write_series(warped, source, &params, &given.out, progress)
        .map(drop)
        .map_err(Error::Export)
}

/// The files that [`write_fields`] writes.
const FIELDS: [&str; 7] = [
    "deformed_to_ct.nrrd",
    "deformed_to_ct.nii.gz",
    "ct_to_deformed.nrrd",
    "ct_to_deformed.nii.gz",
    "jacobian.nrrd",
    "jacobian.nii.gz",
    "deformed_to_ct.mat",
];

/// Writes the map as fields in both formats, and the backward one as a transform of ITK.
fn write_fields(map: &MovingPart, folder: &Path, progress: Progress<'_>) -> Result<(), Error> {
    std::fs::create_dir_all(folder)
        .map_err(|source| Error::Output { path: folder.into(), source })?;
    let (backward, forward) = (&map.resampling, &map.points);
    for (n, ending) in ["nrrd", "nii.gz"].into_iter().enumerate() {
        let path = |name: &str| folder.join(format!("{name}.{ending}"));
        let part = |a: f64, b: f64| progress.part(0.4 * (n as f64 + a), 0.4 * (n as f64 + b));
        let (to, modeling) = (path("deformed_to_ct"), FieldKind::Modeling);
        write_field(backward, &to, FieldKind::Resampling, part(0.0, 0.4))
            .and_then(|()| write_field(forward, &path("ct_to_deformed"), modeling, part(0.4, 0.8)))
            .and_then(|()| write_scalar(map.fields.jacobian(), &path("jacobian"), part(0.8, 1.0)))
            .map_err(Error::product)?;
    }
    write_transform(backward, &folder.join("deformed_to_ct.mat"), progress.part(0.8, 1.0))
        .map_err(Error::product)
}

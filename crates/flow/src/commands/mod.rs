//! What the commands of the command line do: each is a session with some of its results given, and
//! leaves files whose names the caller chose.
//!
//! Every command is a function of what was asked (`Mesh` and the like) and an [`crate::Observer`];
//! what it returns is what is told of the result, and serialises to what the command prints as
//! JSON. Keys of the table that a command takes are in its list `KEYS`; their values come as a
//! [`Spec`], so that a value is checked in one place wherever it came from.

pub mod carry;
pub mod check;
pub mod coarsen;
pub mod dicom;
pub mod fit;
mod gather;
pub mod init;
pub mod mesh;
pub mod provenance;
pub mod run;
pub mod segment;
pub mod solve;
pub mod usable;
pub mod warp;

pub use supine_dicom::Clock;
pub use supine_exchange::SurfaceFrame;
pub use supine_report::{Colour, status_schema, summary_schema};

use crate::Error;
use crate::session::Session;
use crate::spec::Spec;
use gather::Gather;
use std::path::Path;
use std::sync::Arc;
use supine_exchange::{MeshFile, read_mesh};
use supine_mesh::{Deformation, TetMesh};
use supine_report::Warning;
use supine_space::Failure;

/// A session of one command, with as many threads as the pool of the caller.
fn session(spec: &Spec) -> Result<Session, Error> {
    Session::new(spec.clone(), rayon::current_num_threads())
}

/// Options that do not go together, or with what is given.
fn usage(message: impl Into<String>) -> Error {
    Error::Refused { kind: Failure::Usage, message: message.into() }
}

/// An input that cannot be used.
fn input(message: impl Into<String>) -> Error {
    Error::Refused { kind: Failure::Input, message: message.into() }
}

/// That a file or folder is there.
///
/// # Errors
/// [`Error::Unread`].
pub fn check_there(path: &Path) -> Result<(), Error> {
    let unread = |source| Error::Unread { path: path.into(), source };
    std::fs::metadata(path).map(drop).map_err(unread)
}

/// That a command may write a file, before its work is begun: there is a folder for it, it is none
/// of the `inputs`, and it belongs to no finished run.
///
/// # Errors
/// [`Error::Output`], [`Error::Refused`].
fn check_out_file<'a>(
    file: &Path,
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Error> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
    let found = folder.map_or(Ok(()), |folder| std::fs::read_dir(folder).map(drop));
    found.map_err(|source| Error::Output { path: file.into(), source })?;
    let Ok(there) = file.canonicalize() else { return Ok(()) };
    if inputs.into_iter().any(|input| input.canonicalize().is_ok_and(|input| input == there)) {
        let file = file.display();
        return Err(usage(format!(
            "--out {file} is what is read, and would be lost; name another file"
        )));
    }
    refuse_result("--out", &there)
}

/// Refuses to write where a run has left a result.
fn refuse_result(option: &str, place: &Path) -> Result<(), Error> {
    if !crate::folder::is_result(place) {
        return Ok(());
    }
    Err(usage(format!(
        "{option} {} is a result of the run in its folder, which would then be another; name another place",
        place.display()
    )))
}

/// Endings of files that hold a volume.
const VOLUMES: [&str; 4] = [".nrrd", ".nii", ".nii.gz", ".mha"];

/// Refuses a name that says no format in which something is written, before the work is begun.
fn check_ending(option: &str, file: &Path, what: &str, endings: &[&str]) -> Result<(), Error> {
    let (false, Some((last, others))) = (ends(file, endings), endings.split_last()) else {
        return Ok(());
    };
    let others = if others.is_empty() { String::new() } else { others.join(", ") + " or " };
    Err(usage(format!("{option} {}: {what} written as {others}{last}", file.display())))
}

/// The format of a mesh that is to be written, by its name.
fn mesh_file(out: &Path) -> Result<MeshFile, Error> {
    MeshFile::of(out).map_err(|error| usage(format!("--out: {error}")))
}

/// Whether a name has one of these endings, which are in small letters.
fn ends(path: &Path, endings: &[&str]) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    endings.iter().any(|ending| name.ends_with(ending))
}

/// A mesh at the CT shape (LPS, mm) from a file (`.vtu`, `.msh`).
///
/// # Errors
/// When it cannot be read.
pub fn given_mesh(path: &Path) -> Result<Arc<TetMesh>, Error> {
    Ok(Arc::new(read_mesh(path).map_err(Error::product)?.0))
}

/// The same with its displacement (LPS, mm).
///
/// # Errors
/// When it cannot be read, or holds none.
pub fn given_deformation(path: &Path) -> Result<Deformation, Error> {
    let (mesh, displacement) = read_mesh(path).map_err(Error::product)?;
    let displacement = displacement.ok_or_else(|| Error::NoDisplacement { path: path.into() })?;
    Ok(Deformation::new(Arc::new(mesh), displacement)?)
}

/// Warnings as the JSON of a command holds them.
fn messages<S: serde::Serializer>(warnings: &[Warning], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(warnings.iter().map(|warning| &warning.message))
}

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
mod outputs;
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
use outputs::{Outputs, VOLUMES, check_ending, ends, mesh_file};
use std::path::Path;
use std::sync::Arc;
use supine_exchange::read_mesh;
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

//! What goes wrong.

use crate::pivot::PivotError;
use crate::registration::RegistrationError;
use std::path::PathBuf;
use supine_space::Failure;

/// Why there is no navigation.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The run, or the tissue made of it.
    #[error(transparent)]
    Flow(#[from] supine_flow::Error),
    /// The run is not what would be made now.
    #[error(
        "{path}: the run is not what this version makes of its case and inputs as they are now; \
         run the case again: supine run {path}/summary.json --out {path}"
    )]
    OtherRun {
        /// The folder.
        path: PathBuf,
    },
    /// The applicator cannot be put in.
    #[error(transparent)]
    Tissue(#[from] supine_fem::Error),
    /// The live region.
    #[error(transparent)]
    Warp(#[from] supine_warp::Error),
    /// The grid of the live region.
    #[error("the live region: {0}")]
    Grid(supine_space::GridError),
    /// What a cavity leaves of the mesh.
    #[error("what the cavity leaves of the tissue: {0}")]
    Mesh(#[from] supine_mesh::MeshError),
    /// The registration.
    #[error(transparent)]
    Registration(#[from] RegistrationError),
    /// The calibration.
    #[error(transparent)]
    Pivot(#[from] PivotError),
    /// The tumour lies in no tissue of the mesh.
    #[error(
        "the tumour lies in no tissue that was modelled: it has no place that could be followed"
    )]
    NoTarget,
    /// There is no way in.
    #[error("the applicator has no direction to come from: give another place for it")]
    NoDirection,
    /// Cannot listen.
    #[error(
        "{address}: {source}; give another port with --port, or stop the program that uses this one"
    )]
    Listen {
        /// Where.
        address: String,
        /// Why not.
        source: std::io::Error,
    },
    /// Cannot reach the tracker's server.
    #[error("{address}: {source}; is the tracker's server running, and is the port right?")]
    Connect {
        /// Where.
        address: String,
        /// Why not.
        source: std::io::Error,
    },
    /// A file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{path}: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// A recording that is none.
    #[error("{path}, line {line}: {why}; is it a recording of supine navigate?")]
    Recording {
        /// The file.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong.
        why: String,
    },
    /// The user stopped.
    #[error("stopped")]
    Stopped,
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Flow(error) => error.kind(),
            Self::Tissue(error) => error.kind(),
            Self::Warp(error) => error.kind(),
            Self::Listen { .. } => Failure::Usage,
            Self::Connect { .. } => Failure::Retry,
            Self::Write { .. } => Failure::Output,
            Self::Stopped => Failure::Stopped,
            Self::OtherRun { .. }
            | Self::Registration(_)
            | Self::Pivot(_)
            | Self::NoTarget
            | Self::NoDirection
            | Self::Grid(_)
            | Self::Mesh(_)
            | Self::Read { .. }
            | Self::Recording { .. } => Failure::Input,
        }
    }
}

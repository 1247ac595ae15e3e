//! What can go wrong with a file.

use std::{io, path::PathBuf};
use supine_mesh::{DisplacementError, MeshError, ScanError, SurfaceError};
use supine_space::{Failure, GridError, Stopped};

/// A file that cannot be used or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be opened or read.
    #[error("cannot read {}: {cause}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: io::Error,
    },
    /// The file was read, but what it holds cannot be used.
    #[error("{problem} (file {})", path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: Problem,
    },
    /// The file cannot be written; nothing was left under its name.
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        cause: io::Error,
    },
    /// What is to be written does not fit the format.
    #[error("cannot write {}: {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// Why, and what to do.
        reason: String,
    },
    /// The user asked to stop; nothing was left under the name of an output.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Read { .. } | Self::Input { .. } => Failure::Input,
            Self::Write { cause, .. } => Failure::of_output(cause),
            Self::Unwritable { .. } => Failure::Output,
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

/// What is wrong with the contents of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// Not a format that is read here.
    #[error("the format is not recognised: expected {0}")]
    Format(&'static str),
    /// A kind of file that exists but is not read.
    #[error("{what} is not read: {advice}")]
    Unsupported {
        /// What was found.
        what: String,
        /// What to do.
        advice: &'static str,
    },
    /// A text that is no UTF-8.
    #[error("{reason}: save it as UTF-8")]
    Text {
        /// What it seems to be.
        reason: String,
    },
    /// A field of a header is missing or makes no sense.
    #[error("`{field}`: {reason}")]
    Field {
        /// Name of the field, attribute or array.
        field: String,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// Fewer data than the header says.
    #[error("the data end early: the header asks for {wanted} bytes, there are {found}")]
    Truncated {
        /// Bytes the header asks for.
        wanted: u128,
        /// Bytes there are (`at most` when compressed).
        found: u128,
    },
    /// More data than the header says.
    #[error("there are more data than the {wanted} bytes the header asks for")]
    Excess {
        /// Bytes the header asks for.
        wanted: usize,
    },
    /// The compressed data are damaged.
    #[error("the compressed data are damaged: {0}")]
    Damaged(io::Error),
    /// The data do not fit into memory.
    #[error("there is not enough memory for {0} bytes")]
    Memory(usize),
    /// A voxel whose value cannot be taken.
    #[error("voxel ({}, {}, {}) has the value {}: {reason}", voxel[0], voxel[1], voxel[2], short(*value))]
    Value {
        /// The first such voxel, (i, j, k).
        voxel: [usize; 3],
        /// Its value after scaling.
        value: f64,
        /// What was expected.
        reason: &'static str,
    },
    /// Voxels with a label that has no meaning here.
    #[error("{voxels} voxels have the label {value}{}, which is not one of {known}", named(name))]
    Label {
        /// The label's value in the file.
        value: i64,
        /// Its name in the file.
        name: Option<String>,
        /// Voxels that have it.
        voxels: usize,
        /// Labels that are known.
        known: String,
    },
    /// Voxels that belong to soft tissue and chest wall at once.
    #[error(
        "{voxels} voxels belong both to `{first}` and to `{second}`: let the segments not overlap"
    )]
    Overlap {
        /// A segment.
        first: String,
        /// Another one.
        second: String,
        /// Voxels in both.
        voxels: usize,
    },
    /// The grid makes no sense.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// The mesh makes no sense.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The surface bounds nothing.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The scan is none of a body.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The size of a scan does not tell in which unit it is.
    #[error(
        "the unit of the scan is not sure: from corner to corner it measures {}, which would be {} mm in centimetres, \
         {} mm in inches and {} mm in metres, where a torso has 150 to 1500 mm; say whether its unit is mm, cm, m or inch",
        figures(*size), figures(size * 10.0), figures(size * 25.4), figures(size * 1000.0)
    )]
    Unit {
        /// Diagonal of the box around the points, in the unit of the file.
        size: f64,
    },
    /// The displacement makes no sense.
    #[error(transparent)]
    Displacement(#[from] DisplacementError),
    /// Malformed XML.
    #[error("malformed XML at byte {at}: {reason}")]
    Xml {
        /// Place in the file.
        at: u64,
        /// What the parser says.
        reason: String,
    },
    /// A line of a table or text that cannot be taken.
    #[error("line {line}: {reason}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// Malformed JSON, or JSON that is not a list of markups.
    #[error("not a usable markups file: {0}")]
    Json(String),
    /// Malformed JSON, or JSON that is not landmarks.
    #[error("no usable landmarks: {0}")]
    Landmarks(String),
    /// A control point that cannot be taken.
    #[error("point {number} (`{name}`): {reason}")]
    Point {
        /// Counted from 1.
        number: usize,
        /// Its name.
        name: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

/// Three decimals at most.
fn short(value: f64) -> f64 {
    if value.abs() < 1e9 { (value * 1e3).round() / 1e3 } else { value }
}

/// Three figures, as far as that is readable.
fn figures(value: f64) -> String {
    match value.abs() {
        v if v >= 1e7 || (v > 0.0 && v < 1e-3) => format!("{value:.2e}"),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 1.0 => format!("{value:.1}"),
        _ => format!("{value:.3}"),
    }
}

fn named(name: &Option<String>) -> String {
    name.as_ref().map(|n| format!(" (`{n}`)")).unwrap_or_default()
}

impl Problem {
    /// A field that is missing or makes no sense.
    pub(crate) fn field(field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Field { field: field.into(), reason: reason.into() }
    }

    /// The error of a file.
    pub(crate) fn of(self, path: &std::path::Path) -> Error {
        match self {
            Self::Stopped(stopped) => Error::Stopped(stopped),
            problem => Error::Input { path: path.into(), problem },
        }
    }
}

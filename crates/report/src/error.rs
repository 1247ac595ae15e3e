//! Why there is no report.

use std::path::PathBuf;
use supine_space::Failure;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder cannot be written.
    #[error(
        "the report cannot be written ({source}); check the free space and the rights of {path}"
    )]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A picture cannot be encoded.
    #[error("the picture {name} cannot be encoded as PNG: {source}")]
    Picture {
        /// Its name.
        name: String,
        /// What the encoder says.
        source: png::EncodingError,
    },
    /// The PDF cannot be made.
    #[error("the PDF cannot be made: {0}")]
    Pdf(String),
    /// The page cannot be made.
    #[error("the page cannot be made: {0}")]
    Page(#[from] askama::Error),
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] supine_space::Stopped),
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Write { source, .. } => Failure::of_output(source),
            Self::Picture { .. } | Self::Pdf(_) | Self::Page(_) => Failure::Output,
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

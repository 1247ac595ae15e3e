//! Why there is no report.

use std::path::PathBuf;

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
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] supine_space::Stopped),
}

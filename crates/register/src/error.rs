//! Why a scan could not be brought onto the skin.

use supine_space::{Failure, Stopped};

/// Why a scan could not be brought onto the skin.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Landmarks that fix no pose.
    #[error("{0}")]
    Landmarks(String),
    /// Hardly any point of the scan lies on the skin.
    #[error(
        "only {matched} of {points} points of the scan lie on the skin of the CT: it is of another body or of another part, \
         or the landmarks are wrong"
    )]
    Apart {
        /// Points of the scan that lie on it.
        matched: usize,
        /// Points of the scan.
        points: usize,
    },
    /// The points leave a direction open.
    #[error("the scan does not fix its pose: it needs more of the torso around the breast")]
    Open,
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Stopped(_) => Failure::Stopped,
            _ => Failure::Input,
        }
    }
}

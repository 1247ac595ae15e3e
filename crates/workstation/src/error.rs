//! Why a request cannot be answered.

use std::path::Path;
use supine_space::Failure;

/// Why the page cannot be served, or a request of it not be answered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A stage of the flow failed, or a case cannot be used.
    #[error(transparent)]
    Flow(#[from] supine_flow::Error),
    /// A file or folder cannot be read.
    #[error("{name} cannot be read: {source}")]
    Unreadable {
        /// Its name, without its folders.
        name: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// What was asked for does not lie below the folder that was opened.
    #[error("this is not below the folder that was opened")]
    NotBelow,
    /// No server could be started.
    #[error(
        "no page can be served on port {port}: {source}. Leave --port out, or name another one"
    )]
    Port {
        /// The port that was asked for; 0: any.
        port: u16,
        /// What the system says.
        source: std::io::Error,
    },
    /// Something is worked on.
    #[error("the work before is not done yet: wait for it, or cancel it")]
    Busy,
    /// A run is opened whose results are not those of its case any more.
    #[error(
        "the CT is shown alone: the results in this folder were made by another version of the program, or an input changed since; \
         run it again"
    )]
    OtherRun,
    /// Nothing is open that this could be asked of.
    #[error("no CT is open")]
    Nothing,
    /// The request says something that it may not.
    #[error("the request cannot be understood: {0}")]
    Request(String),
    /// What would be sent is not what the run left.
    #[error("nothing was sent: {0}; write the result again")]
    RunChanged(String),
    /// The work ended in a way that nobody foresaw.
    #[error("internal error; see the terminal for details")]
    Broken,
    /// The system has no random numbers.
    #[error("the system gives no random numbers for the key of the page: {0}")]
    Random(String),
    /// Nothing was written that could be sent.
    #[error("no run was written yet, or the case was changed since")]
    NoResult,
    /// What is sent is not green.
    #[error("the verdict is not green: type \"{0}\" to send it")]
    Confirm(String),
    /// The archive, or the way to it.
    #[error(transparent)]
    Network(#[from] supine_dicom_network::Error),
    /// Somebody else changed the case since.
    #[error("the case was changed in another window: this change was not made")]
    Old,
}

impl Error {
    pub(crate) fn unreadable(path: &Path, source: std::io::Error) -> Self {
        Self::Unreadable { name: crate::names::name_of(path), source }
    }

    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Flow(error) => error.kind(),
            Self::Port { .. } => Failure::Usage,
            Self::Busy => Failure::Retry,
            _ => Failure::Input,
        }
    }

    /// Whether the user ended the work.
    pub(crate) fn is_stop(&self) -> bool {
        match self {
            Self::Flow(error) => matches!(error, supine_flow::Error::Stopped),
            Self::Network(error) => error.kind() == Failure::Stopped,
            _ => false,
        }
    }

    /// The status of an answer.
    pub(crate) fn status(&self) -> u16 {
        match self {
            Self::NotBelow => 403,
            Self::Busy | Self::Old => 409,
            Self::Nothing => 404,
            _ => 400,
        }
    }
}

impl From<supine_flow::CaseError> for Error {
    fn from(error: supine_flow::CaseError) -> Self {
        Self::Flow(error.into())
    }
}

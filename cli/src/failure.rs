//! How a command ends without its result.

use supine_space::Failure as Kind;

/// A message for people and a kind, which has the exit code for scripts.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) kind: Kind,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into() }
    }
}

impl From<supine_flow::Error> for Failure {
    fn from(error: supine_flow::Error) -> Self {
        Self::new(error.kind(), error.to_string())
    }
}

impl From<supine_dicom_network::Error> for Failure {
    fn from(error: supine_dicom_network::Error) -> Self {
        Self::new(error.kind(), error.to_string())
    }
}

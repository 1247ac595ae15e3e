//! How a command ends without its result.

use supine_pipeline::RunError;

/// A message for people and an exit code for scripts.
///
/// 0 done; 1 the input cannot be used; 2 wrong usage; 3 the method failed; 4 a check failed,
/// outputs are there; 5 an output cannot be written; 75 worth a retry; 130 interrupted.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) code: u8,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn input(message: impl Into<String>) -> Self {
        Self { code: 1, message: message.into() }
    }

    pub(crate) fn usage(message: impl Into<String>) -> Self {
        Self { code: 2, message: message.into() }
    }

    pub(crate) fn output(message: impl Into<String>) -> Self {
        Self { code: 5, message: message.into() }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        Self { code: error.exit_code(), message: error.to_string() }
    }
}

impl From<supine_exchange::Error> for Failure {
    fn from(error: supine_exchange::Error) -> Self {
        match error.kind() {
            supine_exchange::ErrorKind::Input => Self::input(error.to_string()),
            supine_exchange::ErrorKind::Output => Self::output(error.to_string()),
            supine_exchange::ErrorKind::Stopped => Self { code: 130, message: error.to_string() },
        }
    }
}

impl From<supine_dicom_network::Error> for Failure {
    fn from(error: supine_dicom_network::Error) -> Self {
        let code = match error.kind() {
            supine_dicom_network::ErrorKind::Input => 1,
            supine_dicom_network::ErrorKind::Output => 5,
            supine_dicom_network::ErrorKind::Retry => 75,
            supine_dicom_network::ErrorKind::Stopped => 130,
        };
        Self { code, message: error.to_string() }
    }
}

impl From<supine_dicom::Error> for Failure {
    fn from(error: supine_dicom::Error) -> Self {
        let code = match error.kind() {
            supine_dicom::ErrorKind::Input => 1,
            supine_dicom::ErrorKind::Output => 5,
            supine_dicom::ErrorKind::Stopped => 130,
        };
        Self { code, message: error.to_string() }
    }
}

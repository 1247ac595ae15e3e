//! What answers bytes that are refused.

use crate::content::status::{Status, StatusCode};
use crate::error::{BodyError, HeaderError};

impl HeaderError {
    /// The STATUS code that answers it.
    pub fn status_code(&self) -> StatusCode {
        match self {
            Self::Version { .. } | Self::Kind { .. } => StatusCode::ConfigurationError,
            Self::TooLarge { .. } => StatusCode::NotEnoughResources,
        }
    }

    /// Whether the connection can be kept: no, since nobody knows where the next message begins, or
    /// since it lies behind more bytes than are worth reading.
    pub fn keeps(&self) -> bool {
        false
    }

    /// The whole answer.
    pub fn status(&self) -> Status {
        let name = match self {
            Self::TooLarge { .. } => "TooLarge",
            Self::Version { .. } | Self::Kind { .. } => "BadHeader",
        };
        Status::new(self.status_code(), name, &self.to_string())
    }
}

impl BodyError {
    /// The STATUS code that answers it.
    pub fn status_code(&self) -> StatusCode {
        match self {
            Self::Checksum { .. } => StatusCode::ChecksumError,
            Self::TooMany { .. } => StatusCode::NotEnoughResources,
            Self::Length { .. }
            | Self::ExtendedHeader { .. }
            | Self::Metadata { .. }
            | Self::Content { .. } => StatusCode::ConfigurationError,
        }
    }

    /// Whether the connection can be kept: yes, unless the body was not read whole.
    pub fn keeps(&self) -> bool {
        !matches!(self, Self::Length { .. })
    }

    /// The whole answer.
    pub fn status(&self) -> Status {
        let name = match self {
            Self::Length { .. } => "BadLength",
            Self::Checksum { .. } => "Checksum",
            Self::ExtendedHeader { .. } => "BadExtendedHeader",
            Self::Metadata { .. } => "BadMetadata",
            Self::Content { .. } => "BadBody",
            Self::TooMany { .. } => "TooMany",
        };
        Status::new(self.status_code(), name, &self.to_string())
    }
}

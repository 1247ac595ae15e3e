//! What kind of failure an error is, and the exit code a command answers it with.

/// What kind of failure an error is: one kind for each exit code. Every crate's error says its
/// kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Failure {
    /// The input cannot be used; the message names the file, slice or key and what to do.
    Input,
    /// The command or an option is wrong.
    Usage,
    /// The method failed: segmentation, mesher or solver says why.
    Method,
    /// A check failed; the outputs are there.
    Check,
    /// An output cannot be written.
    Output,
    /// Worth a retry: memory, disk, a busy folder, a connection.
    Retry,
    /// The user stopped it.
    Stopped,
}

impl Failure {
    /// The published exit code: 1 input, 2 usage, 3 method, 4 check, 5 output, 75 retry, 130
    /// stopped.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Input => 1,
            Self::Usage => 2,
            Self::Method => 3,
            Self::Check => 4,
            Self::Output => 5,
            Self::Retry => 75,
            Self::Stopped => 130,
        }
    }

    /// Its name for scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Usage => "usage",
            Self::Method => "method",
            Self::Check => "check",
            Self::Output => "output",
            Self::Retry => "retry",
            Self::Stopped => "stopped",
        }
    }

    /// The failure of an output: a full disk is worth a retry, a folder that cannot be written is
    /// not.
    pub fn of_output(error: &std::io::Error) -> Self {
        use std::io::ErrorKind as Kind;
        match error.kind() {
            Kind::StorageFull | Kind::QuotaExceeded => Self::Retry,
            _ => Self::Output,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_worth_a_retry() {
        let error = |kind| std::io::Error::from(kind);
        assert_eq!(Failure::of_output(&error(std::io::ErrorKind::StorageFull)), Failure::Retry);
        let denied = error(std::io::ErrorKind::PermissionDenied);
        assert_eq!(Failure::of_output(&denied).exit_code(), 5);
    }
}

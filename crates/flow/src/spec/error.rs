//! Why a case cannot be used.

use super::table::Parameter;
use std::io::ErrorKind;
use std::path::PathBuf;

/// What to do about a file that cannot be read.
pub(crate) fn readable(why: &std::io::Error) -> &'static str {
    match why.kind() {
        ErrorKind::NotFound => "give the path of one that is there",
        ErrorKind::IsADirectory => "name a file, not a folder",
        ErrorKind::InvalidData => "save it as UTF-8",
        ErrorKind::PermissionDenied => "see to it that you may read it",
        _ => "give a path that can be read",
    }
}

/// Why a case cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaseError {
    /// The file cannot be read.
    #[error("the case file {path} cannot be read: {source}; {}", readable(source))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// It is neither TOML nor the summary of a run.
    #[error("the case file {path} is not valid: {reason}")]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Line and reason.
        reason: String,
    },
    /// A key that there is not.
    #[error("{0}")]
    Key(String),
    /// A value is not what its parameter may be, or contradicts another.
    #[error("`{key}`: {reason}")]
    Value {
        /// The key.
        key: &'static str,
        /// What is wrong and what to do.
        reason: String,
    },
    /// A key that has to be given.
    #[error("`{key}` is missing: {what}")]
    Missing {
        /// The key.
        key: &'static str,
        /// What it is.
        what: &'static str,
    },
    /// Keys that have to be given, each with a line to add.
    #[error("{}; add{}", are_missing(keys), add)]
    Incomplete {
        /// The keys.
        keys: Vec<&'static str>,
        /// The lines, each with a line break before it.
        add: String,
    },
    /// The summary of a de-identified run names no files, and the case that was kept beside it is
    /// gone.
    #[error("{path} is of a de-identified run and names no files: run its case file instead")]
    Withheld {
        /// The summary.
        path: PathBuf,
    },
}

fn are_missing(keys: &[&str]) -> String {
    let named: Vec<String> = keys.iter().map(|key| format!("`{key}`")).collect();
    format!("{} {} missing", named.join(", "), if keys.len() == 1 { "is" } else { "are" })
}

/// A value that contradicts another, or a rule of its own.
pub(super) fn value(key: &'static str, reason: impl Into<String>) -> CaseError {
    CaseError::Value { key, reason: reason.into() }
}

/// A value that is not what its parameter may be; the one wording, wherever the value came from.
/// `hint` says what may have happened.
pub(super) fn unfit(parameter: &Parameter, given: &str, hint: &str) -> CaseError {
    value(parameter.key, format!("{given} is not {}{hint}", parameter.expected()))
}

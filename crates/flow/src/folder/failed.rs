//! That a later run into a folder failed: the finished result there is not what its case asks for
//! now.

use super::{USERS, names, summary_of, write_atomically};
use crate::Error;
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use supine_space::Failure;

/// Notes that a run into a folder failed, if it holds a finished result. The code alone: messages
/// name files. A refusal of the folder is none of its case's failures.
pub(crate) fn note_failed(root: &Path, error: &Error) {
    let refused = error.kind() == Failure::Usage || matches!(error, Error::Busy { .. });
    let of_ours = || summary_of(root).is_some_and(|s| s["tool"]["name"] == "supine");
    if refused || !root.join(names::RECORDS).is_dir() || !of_ours() {
        return;
    }
    let note = json!({ "code": error.code() }).to_string();
    // Who cannot write here has failed with that.
    let _noted = write_atomically(&root.join(names::FAILED), note.as_bytes(), USERS);
}

/// The code with which a later run into a folder failed; none when none did.
pub(crate) fn failed_since(root: &Path) -> Option<String> {
    let note: Value = serde_json::from_slice(&fs::read(root.join(names::FAILED)).ok()?).ok()?;
    Some(note["code"].as_str()?.to_owned())
}

/// Forgets it: another run is finished, or the result is of what is asked again.
///
/// # Errors
/// [`Error::Output`] when it cannot be removed.
pub(crate) fn forget_failed(root: &Path) -> Result<(), Error> {
    super::remove(&root.join(names::FAILED))
}

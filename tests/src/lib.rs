//! What the end-to-end tests share: the workspace, the binary under test, small cases, folders.
//!
//! The tests run `supine` as a user does and judge what it leaves. Among the binaries:
//! `flow` (whole runs: independent readers, determinism, Ctrl-C), `bad_input` (one clear message,
//! the right exit code, nothing half-written) and `house` (layers, licences, tidiness).
#![expect(
    clippy::disallowed_methods,
    clippy::missing_panics_doc,
    reason = "only tests call this: files are its work and a panic is a failed test"
)]

mod binary;
mod case;
mod finished;
mod folder;
mod structures;
mod workspace;

pub use binary::{Outcome, python, readers_python, supine, supine_command, tool};
pub use case::{Case, source};
pub use finished::Finished;
pub use folder::{
    FINAL_NAMES, copy_folder, copy_series, files_below, forgotten, leftovers, results,
};
pub use structures::{Drawn, frame_of_reference, write_structures, write_structures_of};
pub use workspace::{metadata, root, target};

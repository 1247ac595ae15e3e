//! Pictures, the HTML report and summary.json of a run.

#![cfg_attr(test, expect(clippy::disallowed_methods, reason = "edge crate: files"))]

mod error;
mod files;
mod summary;

pub use error::Error;
pub use files::write_summary;
pub use summary::*;

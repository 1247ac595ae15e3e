//! DICOM objects to and from an archive (PS3.4 Annex B and C, PS3.7, PS3.8).
//!
//! - [`send`]: the objects below folders, each as it stands in its file, with a record of what the
//!   archive has acknowledged, so that a second call goes on where the first broke off
//! - [`list`]: what an archive holds of a study, a series or a patient
//! - [`fetch`]: the instances that are missing in a folder, by C-GET on the association we opened,
//!   or by C-MOVE to a port that is open only meanwhile
//!
//! The protocol data units are read and written by `dicom-ul`; their length is checked first, so
//! that a peer cannot ask for memory. Data sets travel in the transfer syntax of their file, or in
//! Implicit VR where a peer takes no Explicit VR, and are kept in the one they came in. No message
//! carries the patient's name, ID or dates, nor any text of the peer's that might.
//!
//! ```
//! use supine_dicom_network::Node;
//!
//! # fn main() -> Result<(), String> {
//! let archive: Node = "ARCHIVE@192.0.2.7:104".parse()?;
//! assert_eq!((archive.title.as_str(), archive.port), ("ARCHIVE", 104));
//! # Ok(())
//! # }
//! ```
#![expect(
    clippy::disallowed_methods,
    reason = "edge crate: files, sockets and the clock of timeouts"
)]

mod cancel;
mod command;
mod contexts;
mod error;
mod expected;
mod fetch;
mod find;
mod inbox;
mod journal;
mod link;
mod listener;
mod made;
mod message;
mod mixed;
mod node;
mod patience;
mod pinned;
mod retrieve;
mod send;
mod status;
mod syntaxes;
#[cfg(test)]
mod tests;
mod tls;
mod units;
mod wire;

pub use error::Error;
pub use expected::Strangers;
pub use fetch::{Way, fetch};
pub use find::{QuerySpec, SeriesEntry, StudyEntry, list};
pub use journal::{JOURNAL, acknowledged};
pub use node::{Node, Title};
pub use retrieve::FetchInfo;
pub use send::{Refused, SendInfo, SendParams, send};
pub use tls::{Tls, TlsFiles};

use serde::{Serializer, ser::SerializeSeq as _};
use std::time::Duration;
use supine_space::Warning;

/// Writes warnings as their texts.
fn texts<S: Serializer>(warnings: &[Warning], serializer: S) -> Result<S::Ok, S::Error> {
    let mut texts = serializer.serialize_seq(Some(warnings.len()))?;
    for warning in warnings {
        texts.serialize_element(&warning.to_string())?;
    }
    texts.end()
}

/// Who we talk to, as whom, and how patiently.
#[derive(Clone, Debug)]
pub struct Call {
    /// The archive.
    pub peer: Node,
    /// Our own application entity title.
    pub own: Title,
    /// How TLS is spoken; without it the connection is not encrypted.
    pub tls: Option<Tls>,
    /// Longest silence of the peer.
    pub timeout: Duration,
    /// How often it is tried again without anything new having got through.
    pub retries: u32,
}

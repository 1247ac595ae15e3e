//! The flow from CT to deformed CT: its parameters, its graph of nodes, the session that holds
//! their results, and the folder that keeps them.
//!
//! - [`spec`]: one table of parameters; a [`Spec`] of given values makes a [`Case`].
//! - `nodes`: one file per stage: what it may see, what it makes; the list of them is the whole
//!   flow.
//! - `graph`: keys: what must be made again follows from them.
//! - [`Session`]: what was given, and all results, in memory; set, ask, watch, cancel.
//! - [`RunFolder`]: the only place that knows the names of files.
//!
//! The only crate that knows the order of the stages and the only one below the front ends with a
//! clock.
//!
//! ```
//! use supine_flow::Spec;
//!
//! # fn main() -> Result<(), supine_flow::CaseError> {
//! let case = Spec::from_text("table = { ap = 7.0, lat = 5.0 }", ".")?.case()?;
//! assert_eq!(case.table_pose()?.ap_deg, 7.0);
//! # Ok(())
//! # }
//! ```

#![expect(clippy::disallowed_methods, reason = "edge crate: files, and the clock of the stages")]

pub mod batch;
mod case_file;
mod case_state;
pub mod commands;
mod error;
mod error_facts;
mod figures;
mod folder;
mod graph;
mod inputs;
mod key;
mod lazy;
mod live_tilt;
mod live_tissue;
mod memory;
mod nearest;
mod node_id;
mod nodes;
mod own_objects;
mod own_scans;
mod run;
mod session;
mod shared;
pub mod spec;
mod status;
mod text_file;
mod work;

pub use case_file::CaseFile;
pub use error::Error;
pub use figures::Figure;
pub use folder::{FinishedRun, RunFolder, USERS, write_atomically};
pub use live_tilt::{Applied, ContactResult, LiveTilt};
pub use live_tissue::{LiveMesh, LiveTissue};
pub use memory::{CountingAllocator, memory_was_refused};
pub use node_id::NodeId;
pub use own_objects::{Contours, OwnDose, OwnObjects, OwnSegment, OwnStructure};
pub use run::{Options, run};
pub use session::{Freshness, Lane, Observer, Request, Session, Start, Unwatched};
pub use shared::*;
pub use spec::{Case, CaseError, Spec};
pub use status::{
    Denial, advice, advice_of, case_name, check_text, denial, is_status, run_told, stopped_at_once,
    verdict_lines, write_status, write_text,
};
pub use supine_report::palette;
pub use supine_report::{
    DoseVolumeHistogram, Ended, PatientIdentity, Reason, RunError, RunPlace, RunStatus,
    SphereRecord, Summary, UncertainPatch, Warning, directions, headline, held, is_uncertain,
    moves, too_wide,
};
pub use supine_segment::UNCERTAIN_MM;

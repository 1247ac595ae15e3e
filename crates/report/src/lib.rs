//! Pictures, the HTML report and summary.json of a run.
//!
//! [`write()`] makes `index.html`, self-contained with a slice viewer in it, and its pictures as
//! PNG files from a [`Summary`] and the products of the run ([`Scene`]); [`write_summary`] makes
//! `summary.json`; [`pdf()`] makes one or two sheets for printers and archives. Knows no stage: the
//! pipeline tells what happened. Nothing in the report differs from run to run of the same case;
//! times and memory stand in [`Summary::run`] alone.
//!
//! ```
//! use supine_report::{Movement, directions};
//!
//! let moved = Movement::new([40.0, -30.0, 10.0], [42.0, -29.0, 7.0]);
//! assert!((moved.distance_mm - 14.0_f64.sqrt()).abs() < 1e-12);
//! assert!(directions(moved.displacement_mm).contains("to the patient's left"));
//! ```

#![expect(clippy::disallowed_methods, reason = "edge crate: files")]

mod agreement;
mod body;
mod canvas;
mod cohort;
mod dose_volume;
mod encoded;
mod error;
mod files;
mod first;
mod fonts;
mod html;
mod lettering;
pub mod palette;
mod patient_identity;
mod pdf;
#[cfg(test)]
mod phantom;
mod pictures;
mod place;
mod provenance;
mod scan_tables;
mod scene;
#[cfg(test)]
mod section_tests;
mod status;
mod summary;
mod tables;
mod tg132;
mod verdict;
mod viewer;
mod volumes;
mod words;
mod write;

pub use agreement::agreement;
pub use cohort::{Figures, PICTURES, Patient, TABLE_HEAD, cohort_page, cohort_table};
pub use error::Error;
pub use files::write_summary;
pub use first::{headline, moves};
pub use pdf::pdf;
pub use provenance::provenance;
pub use scan_tables::{write_evaluation_table, write_fit_table};
pub use scene::{Scene, Shown, is_uncertain};
pub use status::{Ended, RunError, RunPlace, RunStatus, TumourMoved, advice_for, status_schema};
pub use summary::*;
pub use supine_record::{DoseTolerance, PatientIdentity};
pub use verdict::{FEW_POINTS, TOLERANCE_MM, TORSO_MM, held, seen_near_mm, too_wide, verdict};
pub use volumes::volume_changes;
pub use words::directions;
pub use write::{Pictures, draw, write, write_mesh};

//! The case file and the whole flow from CT to deformed CT.
//!
//! The only crate that knows the order of the stages and the only one below the edges with a
//! clock. [`run`] shows the whole flow on one screen.

#![expect(clippy::disallowed_methods, reason = "edge crate: files, and the clock of the stages")]

mod bench;
mod case;
mod coarse;
mod ct;
mod error;
mod facts;
mod keys;
mod labels;
mod mesher;
mod meter;
mod moduli;
mod options;
mod outward;
mod refine;
mod registration;
mod rt;
mod run;
#[cfg(any(feature = "cgal", feature = "tetgen", test))]
mod search;
mod stage;
mod statics;
mod store;
mod surfaces;
mod texts;

mod stages {
    pub(crate) mod carry;
    pub(crate) mod export;
    pub(crate) mod import;
    pub(crate) mod mesh;
    pub(crate) mod region;
    pub(crate) mod report;
    pub(crate) mod segment;
    pub(crate) mod solve;
    pub(crate) mod tissues;
    pub(crate) mod warp;
}

pub use bench::Watch;
pub use case::{
    Case, CaseError, ExportWish, MeshWish, RefineWish, Seeds, StiffnessMap, StiffnessWish, side,
};
pub use coarse::coarsen_run;
pub use ct::{CtInput, read_ct};
pub use error::RunError;
pub use facts::mesh_facts;
pub use labels::{Brought, LabelOrigin, PartNames, RoleError, read_brought, write_dicom_labels};
#[cfg(feature = "cgal")]
pub use mesher::by_cgal;
pub use mesher::{Mesher, TETGEN_WORKER, mesh_region};
#[cfg(feature = "tetgen")]
pub use mesher::{by_tetgen, tetgen_work};
pub use options::Options;
pub use outward::{Outward, forgetful_anonymiser};
pub use refine::{Goal, Refine};
pub use registration::write_registration;
pub use rt::{
    CarriedContours, CarriedSegments, Company, DOSE_NOTE, Kind, Wanted, carry_lines,
    carry_named_contours, carry_segments, carry_with_totals, closed_contours, write_carried_dose,
    write_carried_segments, write_carried_structures,
};
pub use run::run;
#[cfg(any(feature = "cgal", feature = "tetgen", test))]
pub use search::{Effort, Found, Try};
pub use stage::Stage;
pub use statics::statics;
pub use supine_report::Summary;
pub use surfaces::{read_surfaces, write_surfaces};

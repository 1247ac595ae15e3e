//! What the stages find, as plain facts: the methods fill them, `summary.json` holds them, report
//! and page show them. A fact is declared here once, with its words and units.

mod agreement;
mod patient;
mod quality_check;
mod sphere;
mod tissue;
mod uncertainty;

pub use agreement::{Consistency, Curved};
pub use patient::PatientIdentity;
pub use quality_check::QualityCheck;
pub use sphere::SphereRecord;
pub use tissue::{Cut, RestState};
pub use uncertainty::{ModulusOrigin, UncertaintyShare, UncertaintySource};

//! What the stages find, as plain facts: the methods fill them, `summary.json` holds them, report
//! and page show them. A fact is declared here once, with its words and units.
//!
//! ```
//! use supine_record::Addition;
//!
//! assert_eq!(Addition::Fibres(2.0).words(), "fibres of 2 times its modulus");
//! ```

mod agreement;
mod boundary;
mod dose_tolerance;
mod fit;
mod law_fit;
mod levels;
mod patient;
mod quality_check;
mod solve;
mod sphere;
mod tissue;
mod uncertainty;
mod wall;
mod warp;

pub use agreement::{Consistency, Curved, SkinDistances, SurfaceDistance};
pub use boundary::{Membrane, SlidingArea};
pub use dose_tolerance::DoseTolerance;
pub use fit::{
    DeviationParts, FitStep, FittedTissues, OffPlace, STRUCTURED_MM, StateFit, interval_95,
};
pub use law_fit::{Addition, LawFit};
pub use levels::TissueLevels;
pub use patient::PatientIdentity;
pub use quality_check::QualityCheck;
pub use solve::{Slid, Solve};
pub use sphere::SphereRecord;
pub use tissue::{Cut, Law, RestState};
pub use uncertainty::{ModulusOrigin, UncertaintyShare, UncertaintySource};
pub use wall::{UncertainPatch, WallUncertainty};
pub use warp::{DenseFate, DenseThing, Jacobian, Warp};

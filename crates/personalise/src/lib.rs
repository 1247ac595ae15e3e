//! What is known of the tissue of one patient, and what that means at the tumour.
//!
//! The displacement of the tumour rests on what nobody knows exactly: Young's modulus, the rest
//! state, the place of the chest wall, the tissue beyond the region, and the mesh.
//! [`tumour_interval`] says how far the tumour moves with 95 % probability, and what each of them
//! adds. Lengths in mm, moduli in kPa, positions and displacements in LPS.
//!
//! ```
//! use supine_personalise::LogNormal;
//!
//! // A modulus of 0.61 kPa, known to 5 %.
//! let [low, high] = LogNormal::new(0.61, 0.05).interval_kpa();
//! assert!(0.5 < low && low < 0.61 && 0.61 < high && high < 0.7);
//! ```

mod beyond;
mod curve;
mod distances;
mod ellipsoid;
mod error;
mod evaluation;
mod fit;
mod interval;
mod modulus_prior;
mod other_laws;
mod question;
mod spread;
mod wall;

pub use ellipsoid::Ellipsoid;
pub use error::Error;
pub use evaluation::{Evaluation, EvaluationQuestion, NEAR_MM, evaluate};
pub use fit::{
    BACK_SHARE, Carried, Choice, DECIDES, Fit, FitQuestion, FittedState, Laws, Part, RankedLaws,
    Tissues, TriedLaw, UPRIGHT_DEG, compare, fit, fit_law, moduli, with_additions,
};
pub use interval::{LEVEL, OtherState, TumourInterval, tumour_interval};
pub use modulus_prior::{LITERATURE_KPA, LogNormal, ModulusPrior};
pub use other_laws::{other_laws, with_law};
pub use question::{ARMS_MM, OtherLaw, Posture, Question, untold};
pub use supine_record::{ModulusOrigin, UncertaintyShare, UncertaintySource};

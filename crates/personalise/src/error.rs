//! Why there is no interval.

use supine_space::{Failure, Stopped};

/// Why there is no interval.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An interval of moduli that is none.
    #[error("the moduli {low} to {high} kPa are no interval: give two above 0 in ascending order")]
    Interval {
        /// Lower end, kPa.
        low: f64,
        /// Higher end, kPa.
        high: f64,
    },
    /// Hardly any modulus of the interval has a solution in the run's rest state.
    #[error(
        "most moduli from {:.3} to {:.3} kPa have no usable shape in the rest state `{}`: \
         how far the tumour moves cannot be bounded",
        young_kpa[0], young_kpa[1], rest.name()
    )]
    NoSolution {
        /// The run's rest state.
        rest: supine_fem::RestState,
        /// The interval, kPa.
        young_kpa: [f64; 2],
    },
    /// The modulus that fits best lies where no more can be solved.
    #[error(
        "the modulus that fits the scan best in the rest state `{}` lies at the end of those that can be solved, {young_kpa:.3} \
         kPa: the scans do not determine it", rest.name()
    )]
    AtEnd {
        /// The rest state.
        rest: supine_fem::RestState,
        /// That modulus, kPa.
        young_kpa: f64,
    },
    /// The breast hardly moved.
    #[error(
        "the breast hardly moves between CT and scan: in the rest state `{}` the stiffest modulus tried, {young_kpa:.1} kPa, \
         fits best, so that the scan does not determine it; is it the scan of the sitting patient?", rest.name()
    )]
    Still {
        /// The rest state.
        rest: supine_fem::RestState,
        /// That modulus, kPa.
        young_kpa: f64,
    },
    /// The scan hardly shows the breast.
    #[error(
        "the scan shows {:.0} % of the breast's skin: too little for a modulus; scan the whole breast from the front and the side",
        100.0 * share
    )]
    NotSeen {
        /// The share that it shows.
        share: f64,
    },
    /// Only a posture that none has explains the scan.
    #[error(
        "the scan fits best to a patient who leans {} by {:.0} degrees, and then lies {misfit_mm:.1} mm rms off the model's \
         skin: she did not sit upright, something holds or covers the breast, the scan is of another patient, or the tissue is \
         far from uniform; no modulus can be told from it",
        if *lean_deg > 0.0 { "back" } else { "forward" }, lean_deg.abs()
    )]
    Posture {
        /// How far she would lean back, degrees.
        lean_deg: f64,
        /// What is left on the breast, mm rms.
        misfit_mm: f64,
    },
    /// The moduli of the tissues ran on.
    #[error(
        "the moduli of the tissues do not settle in the rest state `{}` (gland {gland:.1} and skin {skin:.1} times as stiff as fat at \
         last): the scan does not determine them; leave `tissue.map` out, or give their proportions", rest.name()
    )]
    Unsettled {
        /// The rest state.
        rest: supine_fem::RestState,
        /// Modulus of gland over that of fat, where it was given up.
        gland: f64,
        /// Of skin.
        skin: f64,
    },
    /// No modulus has a solution.
    #[error("no modulus has a solution in the rest state `{}`: {why}", rest.name())]
    NoPath {
        /// The rest state.
        rest: supine_fem::RestState,
        /// What the mechanics said.
        why: String,
    },
    /// The scan could not be brought onto the skin.
    #[error(transparent)]
    Scan(#[from] supine_register::Error),
    /// The mechanics failed.
    #[error(transparent)]
    Mechanics(#[from] supine_fem::Error),
    /// The user asked to stop.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl Error {
    /// What kind of failure it is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Interval { .. } => Failure::Input,
            Self::NoSolution { .. }
            | Self::AtEnd { .. }
            | Self::Still { .. }
            | Self::Unsettled { .. }
            | Self::NoPath { .. } => Failure::Method,
            Self::NotSeen { .. } | Self::Posture { .. } => Failure::Input,
            Self::Scan(error) => error.kind(),
            Self::Mechanics(error) => error.kind(),
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

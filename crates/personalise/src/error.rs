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
            | Self::NoPath { .. } => Failure::Method,
            Self::Scan(error) => error.kind(),
            Self::Mechanics(error) => error.kind(),
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

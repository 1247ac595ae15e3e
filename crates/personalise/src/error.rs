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
            Self::NoSolution { .. } => Failure::Method,
            Self::Mechanics(error) => error.kind(),
            Self::Stopped(_) => Failure::Stopped,
        }
    }
}

//! What is known of the modulus before or after it was measured.

use crate::Error;
use supine_record::ModulusOrigin;

/// Young's moduli (kPa) that were fitted to nine patients in the work this method follows, each as
/// one tissue, the CT shape taken as free of stress.
pub const LITERATURE_KPA: [f64; 9] = [0.3, 0.4, 0.5, 0.6, 0.8, 0.9, 1.2, 1.2, 2.0];

/// Standard deviations on each side of the median that hold 95 % of a normal distribution.
pub(crate) const NORMAL_95: f64 = 1.959_964;

/// A modulus whose logarithm is normally distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogNormal {
    median_kpa: f64,
    /// Standard deviation of the logarithm.
    spread: f64,
}

impl LogNormal {
    /// With this median (kPa) and standard deviation of the logarithm.
    pub fn new(median_kpa: f64, spread: f64) -> Self {
        Self { median_kpa, spread }
    }

    /// The modulus that is as often exceeded as not, kPa.
    pub fn median_kpa(&self) -> f64 {
        self.median_kpa
    }

    /// The modulus that lies so many standard deviations of the logarithm above the median, kPa.
    pub fn at(&self, deviations: f64) -> f64 {
        self.median_kpa * (self.spread * deviations).exp()
    }

    /// The interval that holds the modulus with 95 % probability, kPa.
    pub fn interval_kpa(&self) -> [f64; 2] {
        [self.at(-NORMAL_95), self.at(NORMAL_95)]
    }
}

/// What is known of the mean modulus in the run's rest state, and in the other where that is
/// possible too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModulusPrior {
    known: LogNormal,
    other: Option<LogNormal>,
    origin: ModulusOrigin,
}

impl ModulusPrior {
    /// That of a patient of whom nothing was measured: mean and standard deviation of the
    /// logarithms of [`LITERATURE_KPA`], in either rest state.
    pub fn literature() -> Self {
        let n = LITERATURE_KPA.len() as f64;
        let mean = LITERATURE_KPA.iter().map(|e| e.ln()).sum::<f64>() / n;
        let squares = LITERATURE_KPA.iter().map(|e| (e.ln() - mean).powi(2)).sum::<f64>();
        let spread = (squares / (n - 1.0)).sqrt();
        let known = LogNormal { median_kpa: mean.exp(), spread };
        Self { known, other: Some(known), origin: ModulusOrigin::Literature }
    }

    /// That of an interval (kPa) which holds the modulus with 95 % probability.
    ///
    /// # Errors
    /// [`Error::Interval`] when the ends are not positive, finite and in ascending order.
    pub fn given([low, high]: [f64; 2]) -> Result<Self, Error> {
        if !(low > 0.0 && high > low && high.is_finite()) {
            return Err(Error::Interval { low, high });
        }
        let spread = (high / low).ln() / (2.0 * NORMAL_95);
        let known = LogNormal { median_kpa: (low * high).sqrt(), spread };
        Ok(Self { known, other: None, origin: ModulusOrigin::Given })
    }

    /// That of a fit to scans, with that in the other rest state where the scans do not tell which
    /// holds.
    pub fn fitted(known: LogNormal, other: Option<LogNormal>) -> Self {
        Self { known, other, origin: ModulusOrigin::Scans }
    }

    /// Where it comes from.
    pub fn origin(&self) -> ModulusOrigin {
        self.origin
    }

    /// What is known in the run's rest state.
    pub fn known(&self) -> &LogNormal {
        &self.known
    }

    /// What is known in the other one; `None` where that is no possibility.
    pub fn other(&self) -> Option<&LogNormal> {
        self.other.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_patients_make_a_wide_prior() {
        let prior = ModulusPrior::literature();
        assert!((prior.known().median_kpa() - 0.749).abs() < 1e-3, "{prior:?}");
        let [low, high] = prior.known().interval_kpa();
        assert!((low - 0.231).abs() < 2e-3 && (high - 2.43).abs() < 0.02, "{low} {high}");
        let inside = LITERATURE_KPA.iter().filter(|e| (low..=high).contains(e)).count();
        assert_eq!(inside, 9);
    }

    #[test]
    fn a_given_interval_comes_back() {
        let [low, high] = ModulusPrior::given([0.8, 1.1]).unwrap().known().interval_kpa();
        assert!((low - 0.8).abs() < 1e-12 && (high - 1.1).abs() < 1e-12);
        for bad in [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [0.5, f64::INFINITY], [f64::NAN, 1.0]] {
            assert!(ModulusPrior::given(bad).is_err(), "{bad:?}");
        }
    }
}

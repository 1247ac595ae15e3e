//! The moduli of gland and skin in proportion to that of fat, as parameters beside the mean
//! modulus.
//!
//! The skin does not move linearly with them: each is sought within [`TRUST`] of where it was
//! solved, and solved again there until it stays. On a patient whose gland is four times as stiff
//! as fat the scan tells that to a few hundredths, and how stiff the skin is hardly.

use std::sync::Arc;
use supine_fem::Body;
use supine_record::FittedTissues;
use supine_register::Prior;

/// How far gland and skin may be from the proportions that are taken for likely, one standard
/// deviation of the logarithm: chosen so that published ones lie within two.
const DEVIATIONS: [f64; 2] = [0.8, 1.4];
/// The same of the tumour, which is too small for the skin to tell its modulus.
const TUMOUR: f64 = 0.9;
/// Stiffer and softer than fat by no more than this factor is sought.
const LIMIT: f64 = 300.0;
/// The logarithms are followed this far from where they were solved.
const TRUST: f64 = 0.7;
/// They change by at most so much in one iteration.
const STEP: f64 = 0.35;
/// So near to where they were solved they stay, as a share of their deviation.
const SETTLED: f64 = 0.06;
/// The step of the derivatives.
pub(super) const ASIDE: f64 = 0.2;

/// What a body is made of.
#[derive(Clone, Copy, Debug)]
pub struct Tissues<'a> {
    /// Shares of fat, gland, skin and tumour in each tetrahedron; they add up to 1.
    pub shares: &'a [[f64; 4]],
    /// The same of the coarse mesh.
    pub coarse: &'a [[f64; 4]],
    /// Moduli of these in proportion to each other that are taken for likely.
    pub likely: [f64; 4],
}

/// Moduli of tetrahedra that are made of tissues with these moduli.
pub fn moduli(shares: &[[f64; 4]], kpa: &[f64; 4]) -> Vec<f64> {
    shares.iter().map(|of| of.iter().zip(kpa).map(|(share, e)| share * e).sum()).collect()
}

impl Tissues<'_> {
    /// Logarithms of gland's and skin's modulus over that of fat, as taken for likely.
    pub(super) fn start(&self) -> [f64; 2] {
        let [fat, gland, skin, _] = self.likely;
        [(gland / fat).ln(), (skin / fat).ln()]
    }

    /// What they say.
    pub(super) fn proportions(
        &self,
        values: [f64; 2],
        [gland_deviation, skin_deviation]: [f64; 2],
    ) -> FittedTissues {
        let [gland, skin] = values.map(f64::exp);
        let tumour = self.likely[3] / self.likely[0];
        FittedTissues::new([gland, skin, tumour], [gland_deviation, skin_deviation, TUMOUR])
    }

    /// The body with them.
    pub(super) fn body(&self, body: &Body, values: [f64; 2]) -> Body {
        let kpa = self.proportions(values, [0.0; 2]).proportions();
        Body { young_kpa: Some(Arc::from(moduli(self.shares, &kpa))), ..body.clone() }
    }

    /// What is taken for likely of one of them, near where it was solved.
    pub(super) fn prior(&self, which: usize, about: f64) -> Prior {
        let limit = LIMIT.ln();
        let range = [about - TRUST, about + TRUST].map(|end| end.clamp(-limit, limit));
        Prior { mean: self.start()[which], deviation: DEVIATIONS[which], range, step: STEP }
    }
}

/// Whether they stay where they were solved.
pub(super) fn settled(values: [f64; 2], about: [f64; 2]) -> bool {
    (0..2).all(|k| (values[k] - about[k]).abs() < SETTLED * DEVIATIONS[k])
}

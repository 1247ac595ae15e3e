//! What is asked of the interval of the tumour's displacement.

use crate::modulus_prior::ModulusPrior;
use supine_fem::{Body, Load, Params};
use supine_mesh::{Deformation, Edges, Locator};
use supine_record::{STRUCTURED_MM, UncertainPatch};
use supine_space::{Point, Sphere, Vector};

/// What is asked.
#[derive(Clone, Copy)]
pub struct Question<'a> {
    /// What is deformed.
    pub body: &'a Body,
    /// The same tissue on a mesh that may be coarser: on it is solved how the displacement changes
    /// with modulus and rest state. The run's own displacement takes off what the curves of both
    /// states have too much or too little.
    pub coarse: &'a Body,
    /// Why.
    pub load: &'a Load,
    /// How it was solved, the rest state included.
    pub params: &'a Params,
    /// What was found.
    pub solved: &'a Deformation,
    /// The tumour in the CT, LPS, mm.
    pub tumour: Sphere,
    /// What is known of the modulus.
    pub prior: ModulusPrior,
    /// The error of the chest wall that 19 of 20 places like the one given (LPS, mm) do not exceed,
    /// mm.
    pub wall_error_mm: &'a (dyn Fn(&Point) -> f64 + Sync),
    /// Its uncertain places.
    pub patches: &'a [UncertainPatch],
    /// The body with each proportion of its tissues' moduli another one, by one standard deviation:
    /// independent of each other.
    pub tissues: &'a [Body],
    /// Other laws that what was measured leaves possible.
    pub others: &'a [OtherLaw],
    /// As of [`untold`].
    pub untold: f64,
    /// Arms and breath.
    pub posture: Posture,
}

/// A law of the tissue that may hold in place of that of the run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherLaw {
    /// With which probability.
    pub probability: f64,
    /// How much farther the tumour then moves, LPS, mm.
    pub change: Vector,
}

/// Standard deviation of each component of the tumour's displacement by what no law that was tried
/// says of a breast, as a share of the displacement, from what the fit leaves on its skin beyond
/// noise (mm rms); `None` where nothing was fitted.
///
/// Chosen on synthetic patients (docs/VERIFICATION): a law that describes the scan to its noise had
/// the tumour within 0.06 of its displacement, others within 0.6.
pub fn untold(structured_mm: Option<f64>) -> f64 {
    const UNSEEN: f64 = 0.15;
    /// Structured residuals, mm rms, and the share with them; linear between.
    const RISES: [[f64; 2]; 3] = [[0.35, 0.05], [STRUCTURED_MM, 0.15], [0.6, 0.2]];
    let Some(mm) = structured_mm else { return UNSEEN };
    let [low, .., high] = RISES;
    let between = RISES.windows(2).find(|ends| mm < ends[1][0]);
    match between {
        _ if mm <= low[0] => low[1],
        Some(&[[from, a], [to, b]]) => a + (b - a) * (mm - from) / (to - from),
        _ => high[1],
    }
}

/// What a patient on the table has otherwise than in the CT beside gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture {
    /// The probability that her arms lie otherwise.
    pub arms_moved: f64,
    /// How far each component of the tumour's place is off if they do, one standard deviation, mm.
    pub arms_mm: f64,
    /// The same by breath, mm.
    pub breath_mm: f64,
}

/// How far arms that were moved take each component of a place in the breast along, one standard
/// deviation, mm. Source: Richey et al. 2021 (PMID 34382176), ten breasts, after a rigid
/// registration: 9.3 mm off with the arm moved and 6.5 mm with the arm kept, whose squares differ
/// by (6.7 mm)².
pub const ARMS_MM: f64 = 3.8;

impl Posture {
    /// As in the CT, without breath.
    pub const SAME: Self = Self { arms_moved: 0.0, arms_mm: 0.0, breath_mm: 0.0 };

    /// Arms that were moved with this probability, and a breath that takes the breast this far (mm)
    /// with 95 % probability, in a direction that is not known.
    pub fn new(arms_moved: f64, breathing_mm: f64) -> Self {
        Self { arms_moved, arms_mm: ARMS_MM, breath_mm: breathing_mm / WITHIN_95 }
    }

    /// The same where the skin near the tumour was seen on the table, so far (mm rms) from where it
    /// was expected: arms take it no farther. What moves along the skin is not seen, and is taken
    /// for as large as what moves across it.
    #[must_use]
    pub fn seen(self, off_mm: f64) -> Self {
        if self.arms_moved <= 0.0 {
            return self;
        }
        Self { arms_moved: 1.0, arms_mm: off_mm.min(ARMS_MM), ..self }
    }
}

/// A normal distribution in three dimensions lies within so many standard deviations of a component
/// with 95 % probability.
const WITHIN_95: f64 = 2.795_483;

impl std::fmt::Debug for Question<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Question({:?}, {:?})", self.tumour, self.prior)
    }
}

/// The displacement of the place nearest to a point, LPS, mm.
pub(crate) fn at_centre(solved: &Deformation, centre: &Point) -> Vector {
    let mesh = solved.mesh();
    let nearest = Locator::new(mesh.clone()).nearest(centre);
    solved.displacement().at(mesh, &Edges::new(mesh), nearest.tet, nearest.weights)
}

#[cfg(test)]
mod tests {
    use super::untold;

    #[test]
    fn the_worse_a_law_describes_the_skin_the_less_it_says_of_the_tumour() {
        let near = |mm: f64, share: f64| (untold(Some(mm)) - share).abs() < 1e-12;
        assert!(near(0.0, 0.05) && near(0.35, 0.05) && near(0.4, 0.1), "{}", untold(Some(0.4)));
        assert!(near(0.45, 0.15) && near(0.525, 0.175) && near(0.6, 0.2) && near(3.0, 0.2));
        assert!((untold(None) - 0.15).abs() < 1e-12);
    }
}

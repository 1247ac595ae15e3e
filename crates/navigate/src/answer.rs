//! What is told of the tumour.

use crate::tool::Tool;
use supine_openigtlink::Stamp;
use supine_space::{Point, Pose, Vector};

/// How good an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// An equilibrium of the tissue with the applicator at that pose.
    Ok,
    /// Not in balance yet: a prediction, right to within its bound.
    Predicted,
    /// Right for a pose that is older than what may be shown as now.
    Late,
    /// The last answer; poses stopped, froze or are refused since.
    Stale,
}

impl State {
    /// The name as it stands in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Predicted => "predicted",
            Self::Late => "late",
            Self::Stale => "stale",
        }
    }
}

/// Where the tumour is for one pose of the applicator. Places LPS, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Number of the pose among those that were followed, from 1.
    pub number: u64,
    /// The time stamp of the pose.
    pub stamp: Stamp,
    /// The pose of the applicator, from its own frame to the patient's.
    pub pose: Pose,
    /// The applicator.
    pub tool: Tool,
    /// How good it is.
    pub state: State,
    /// What is in the tissue.
    pub tissue: Followed,
    /// The place lies within this distance with a probability of 95 %, mm: tissue, registration and
    /// solver together. None where the run could not say how sure it is.
    pub within_mm: Option<f64>,
    /// Age of the pose when the answer was ready, or when it was told again, s.
    pub age_s: f64,
    /// Time that the solver took, s.
    pub solve_s: f64,
}

/// The tissue at a pose of the applicator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// The tumour's centre, or that of its bed once it is cut out; LPS, mm.
    pub target: Point,
    /// Displacement from where it lies on the table without applicator, mm.
    pub moved: Vector,
    /// Whether the applicator acts on the tissue.
    pub touches: bool,
    /// Whether the solver found an equilibrium.
    pub settled: bool,
    /// Error of the solver: three times its own estimate, and how far the applicator still has to
    /// go where it has not settled; mm.
    pub error_mm: f64,
    /// Corrections or iterations.
    pub corrections: usize,
    /// Force of the tissue on the applicator, N, LPS.
    pub force_n: Vector,
    /// Distance of the target from the surface of the applicator, mm, negative inside.
    pub from_surface_mm: f64,
    /// Distance of the target from the axis of the applicator, mm.
    pub from_axis_mm: f64,
}

/// How sure the place of the target is, whatever the pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Certainty {
    /// The run's own: the tumour on the table lies within this distance, mm, 95 %. None where it
    /// could not say.
    pub tissue_mm: Option<f64>,
    /// Expected target registration error at the tumour, rms, mm.
    pub registration_mm: f64,
}

impl Certainty {
    /// All together for an error of the solver of at most `error_mm`, 95 %, mm.
    ///
    /// The two that are random add as squares; 95 % of a normal error in space lie within 1.614 of
    /// its rms value (the root of the 95 % quantile of chi-squared with three degrees of freedom,
    /// over that of three).
    pub fn within_mm(&self, error_mm: f64) -> Option<f64> {
        let registration = 1.614 * self.registration_mm;
        Some(self.tissue_mm?.hypot(registration) + error_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_known_is_not_said() {
        let sure = Certainty { tissue_mm: Some(3.0), registration_mm: 4.0 / 1.614 };
        assert!((sure.within_mm(0.5).unwrap() - 5.5).abs() < 1e-12);
        assert_eq!(Certainty { tissue_mm: None, ..sure }.within_mm(0.5), None);
    }
}

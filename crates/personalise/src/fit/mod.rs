//! Young's modulus of one patient from a scan in which gravity pulls another way than in the CT.
//!
//! The CT's own skin, carried by the mechanics ([`Carried`]), is laid onto the scan: pose and ln E
//! are sought together ([`supine_register::align`]), for the torso moves too and a pose taken from
//! it alone carries an error of millimetres into E. The modulus goes from stiff to soft along a
//! path on a coarse mesh, each solution begun from those before, until the objective has risen
//! again; then it is corrected on the mesh that is asked, together with how far the patient leaned:
//! 10 degrees change the load by a tenth, and the skin tells them apart from another modulus. Each
//! rest state has its own modulus.

mod bootstrap;
mod carried;
mod evidence;
mod family;
mod laws;
mod limits;
mod refined;
mod search;
mod structure;
#[cfg(test)]
mod tests;
mod tissues;

pub use carried::{BACK_SHARE, Carried, Part};
pub use evidence::{Choice, DECIDES};
pub use family::UPRIGHT_DEG;
use laws::Lawful;
pub use laws::{Laws, RankedLaws, TriedLaw, with_additions};
use limits::LEANS_DEG;
pub(crate) use limits::REACH_MM;
use refined::Manner;
use search::{Found, STIFFEST_KPA};
pub use tissues::{Tissues, moduli};

use crate::Error;
use rayon::prelude::*;
use supine_fem::{Body, Load, Params, RestState};
use supine_mesh::{Scan, ScanDistances};
use supine_record::{FittedTissues, StateFit};
use supine_register::{Aligned, Skin};
use supine_space::{Beside, Point, Pose, Progress, Sphere};

/// A scan that shows less of the breast's skin does not tell its modulus; a scan from the front
/// shows nine tenths.
const SEEN: f64 = 0.35;

/// What is asked.
#[derive(Clone, Copy, Debug)]
pub struct FitQuestion<'a> {
    /// What is deformed; its modulus does not count.
    pub body: &'a Body,
    /// The same on fewer tetrahedra, for the path.
    pub coarse: &'a Body,
    /// Gravity in the CT and in the scan.
    pub load: &'a Load,
    /// How it is solved; rest state and tolerance do not count.
    pub params: &'a Params,
    /// Rest states to be fitted.
    pub states: &'a [RestState],
    /// The skin of the CT.
    pub skin: &'a Skin,
    /// The middle of the breast, LPS, mm: what the pose turns about.
    pub centre: Point,
    /// The other breast, if there is one: it moves too.
    pub other: Option<&'a Sphere>,
    /// The scan, in a frame of its own.
    pub scan: &'a Scan,
    /// Poses to begin from, from the scan's frame to the patient's.
    pub poses: &'a [Pose],
    /// How far the whole chest wall may be off, one standard deviation, mm.
    pub wall_mm: f64,
    /// What the bodies are made of, when the moduli of the tissues are sought too.
    pub tissues: Option<Tissues<'a>>,
}

/// The modulus that fits best in one rest state, and how it fits.
#[derive(Clone, Debug)]
pub struct FittedState {
    /// What was found.
    pub fit: StateFit,
    /// Whether the moduli of the tissues, where they were sought, stayed where they were solved at
    /// last; if not, they are not told.
    pub settled: bool,
    /// Pose of the scan, the points that lie on the skin, the objective.
    pub aligned: Aligned,
    /// Share of the breast's skin that the scan shows.
    pub seen: f64,
    /// The skin of the model with what was fitted, its points in the order of the CT's, LPS, mm.
    pub skin: Vec<Point>,
}

/// The modulus in each rest state, and what the scan says of these.
#[derive(Clone, Debug)]
pub struct Fit {
    /// In the order asked.
    pub states: Vec<FittedState>,
    /// Which rest state the scan supports.
    pub choice: Choice,
    /// The scan's distances from the skin of the CT (`ct`), and from that of the model in the rest
    /// state to go on with (`fitted`).
    pub distances: ScanDistances,
}

/// That the scan shows the breast, of a patient who sits.
fn check(state: &FittedState) -> Result<(), Error> {
    if state.seen < SEEN {
        return Err(Error::NotSeen { share: state.seen });
    }
    let StateFit { rest, lean_deg, misfit_mm, .. } = state.fit;
    if lean_deg.abs() > LEANS_DEG {
        return Err(Error::Posture { lean_deg, misfit_mm });
    }
    match state.fit.tissues {
        Some(FittedTissues { gland, skin, .. }) if !state.settled => {
            Err(Error::Unsettled { rest, gland, skin })
        }
        _ => Ok(()),
    }
}

/// How much better one fit describes the breast than another on the same mesh: N ln(S'/S), S the
/// squares of the breast's residuals, N of them independent. Above [`DECIDES`] the one is to be
/// taken, below its negative the other.
pub fn compare(question: &FitQuestion<'_>, one: &FittedState, other: &FittedState) -> f64 {
    let carried = Carried::new(question.skin, &question.body.mesh, question.other);
    evidence::evidence(one, other, &carried)
}

/// The modulus in each rest state asked.
///
/// # Errors
/// When the scan does not lie on the skin, shows no motion or hardly any of the breast, fits a
/// patient who lies rather than sits, or the best modulus lies at the end of what can be solved.
pub fn fit(question: &FitQuestion<'_>, progress: Progress<'_>) -> Result<Fit, Error> {
    let coarse = Carried::new(question.skin, &question.coarse.mesh, question.other);
    // Side by side: one alone does not keep two processors busy.
    let beside = Beside::new(progress.part(0.0, 0.6), question.states.len());
    let one = |(n, rest): (usize, &RestState)| {
        let watch = beside.one(n);
        search::search(question, &coarse, *rest, STIFFEST_KPA, Progress::new(&watch))
    };
    let results: Vec<Result<Found, Error>> =
        question.states.par_iter().enumerate().map(one).collect();
    let coarse_fits = results.into_iter().collect::<Result<_, _>>()?;
    finished(question, &coarse, coarse_fits, progress.part(0.6, 1.0))
}

/// The same with a law that was tried, from where that stands on the coarse mesh: one in several
/// rest states. Where it has moduli by tissue, the body has these.
///
/// # Errors
/// As [`fit`].
pub fn fit_law(
    question: &FitQuestion<'_>,
    tried: &[&TriedLaw],
    progress: Progress<'_>,
) -> Result<Fit, Error> {
    let coarse = Carried::new(question.skin, &question.coarse.mesh, question.other);
    let states: Vec<RestState> = tried.iter().map(|law| law.fit.rest).collect();
    let law = Lawful::new(question, tried.first().map_or(&[], |law| &law.fit.additions));
    let question = FitQuestion { states: &states, ..law.question(question) };
    let coarse_fits = tried.iter().map(|law| law.found.clone()).collect();
    let mut fitted = finished(&question, &coarse, coarse_fits, progress)?;
    for (state, law) in fitted.states.iter_mut().zip(tried) {
        state.fit.tissues.clone_from(&law.tissues);
    }
    Ok(fitted)
}

/// The fit on the mesh that is asked, from what was found on the coarse one in each rest state.
fn finished(
    question: &FitQuestion<'_>,
    coarse: &Carried,
    found: Vec<Found>,
    progress: Progress<'_>,
) -> Result<Fit, Error> {
    let fine = Carried::new(question.skin, &question.body.mesh, question.other);
    let beside = Beside::new(progress, found.len());
    let one = |(n, (found, rest)): (usize, (Found, &RestState))| {
        let watch = beside.one(n);
        let asked = (*rest, Manner::WHOLE);
        refined::refined(question, [coarse, &fine], asked, found, Progress::new(&watch))
    };
    let each = found.into_par_iter().zip(question.states).enumerate().map(one);
    let states: Vec<Result<FittedState, Error>> = each.collect();
    let states = states.into_iter().collect::<Result<Vec<_>, _>>()?;
    let choice = evidence::choice(&states, &fine);
    let mut distances = ScanDistances::default();
    if let Some(chosen) = states.iter().find(|state| state.fit.rest == choice.rest()) {
        check(chosen)?;
        let surfaces = [("ct", fine.points.clone()), ("fitted", chosen.skin.clone())];
        distances =
            crate::distances::distances(question.scan, &chosen.aligned.pose, &fine, &surfaces);
    }
    Ok(Fit { states, choice, distances })
}

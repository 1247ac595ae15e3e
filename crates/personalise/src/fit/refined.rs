//! The modulus on the mesh that is asked.

use super::carried::{Carried, Part};
use super::family::Family;
use super::search::{Found, solve};
use super::{FitQuestion, StateFit, bootstrap};
use crate::Error;
use supine_fem::{Params, RestState, Sequence};
use supine_register::{Aligned, Start, align};
use supine_space::Progress;

/// The two moduli that are solved lie this far on each side of the path's best, as a share.
const ASIDE: f64 = 0.06;
/// Farther outside of both the skin is not told by them.
const BEYOND: f64 = 0.06;
/// Attempts before it is given up.
const ATTEMPTS: usize = 3;
/// Reach of the loss at the end, mm.
pub(super) const REACH_MM: f64 = 4.0;
/// Mesh and weights, as a share of E: what no residual shows.
const MODEL: f64 = 0.01;
/// Share of E by which a wall 1 mm off changes it.
const WALL_PER_MM: f64 = 0.035;

/// Corrects what the path found.
pub(super) fn refined(
    question: &FitQuestion<'_>,
    carried: &Carried,
    rest: RestState,
    found: Found,
    progress: Progress<'_>,
) -> Result<StateFit, Error> {
    let Found { mut aligned, path, ended } = found;
    let params = Params { rest, ..*question.params };
    let mut sequence = Sequence::new(question.body, question.load.ct, &params)?;
    for attempt in 0..ATTEMPTS {
        let kpa = aligned.values[0].exp();
        let mut family = Family::new(carried);
        for side in [1.0 + ASIDE, 1.0 - ASIDE] {
            let part = attempt as f64 * 0.2 + if side > 1.0 { 0.0 } else { 0.1 };
            progress.at(part)?;
            solve(question, &mut sequence, &mut family, kpa * side)?;
        }
        family.widen(BEYOND);
        let start = Start { pose: aligned.pose, values: aligned.values.clone() };
        let params = question.params_of([REACH_MM; 2], 40);
        aligned = align(question.scan, &family, &start, &params, Progress::none())?;
        if !aligned.at_end[0] {
            let draws = bootstrap::deviation(question, &family, &aligned, progress.part(0.6, 1.0))?;
            let deviation =
                (draws.powi(2) + MODEL.powi(2) + (WALL_PER_MM * question.wall_mm).powi(2)).sqrt();
            return Ok(StateFit {
                rest,
                young_kpa: aligned.values[0].exp(),
                deviation,
                bootstrap: draws,
                misfit_mm: misfit_mm(&aligned, carried),
                aligned,
                path,
                ended,
            });
        }
    }
    Err(Error::AtEnd { rest, young_kpa: aligned.values[0].exp() })
}

/// Residuals of the breast within the reach, mm rms.
fn misfit_mm(aligned: &Aligned, carried: &Carried) -> f64 {
    let own =
        aligned.matches.0.iter().filter(|m| carried.parts[m.nearest as usize] == Part::Breast);
    let near: Vec<f64> = own.map(|m| m.residual_mm).filter(|r| r.abs() < REACH_MM).collect();
    (near.iter().map(|r| r * r).sum::<f64>() / near.len().max(1) as f64).sqrt()
}

//! What the tissue beyond the region may do to the tumour.
//!
//! What is beyond the sphere is not simulated: springs stand for it. With nothing in their place
//! the tumour moves too far, with everything held not far enough, so that the truth lies between.
//! The springs know neither the weight of the tissue beyond nor where it ends. In a layer that goes
//! on as thick as at the cut they are off by 0.36 of the way from the one to the other (measured on
//! a block; a test holds it). On the synthetic patients, whose truth was solved on the whole half
//! of the chest, they were off by at most 0.2 of it at the tumour, in spheres that reach 5 to 30 mm
//! beyond the breast, where the layer is thin (docs/VERIFICATION, "What stands for the tissue
//! beyond the sphere"), and by 0.1 in one of half its radius.

use crate::Error;
use crate::curve::found;
use crate::modulus_prior::NORMAL_95;
use crate::question::{Question, at_centre};
use supine_fem::{Cut, Params, solve};
use supine_space::{Progress, Vector};

/// What the springs may be off by, of the way between a free and a held cut, with 95 % probability
/// (see above).
const SPRINGS: f64 = 0.4;
/// From a held cut to a free one, over that from a held one to springs: where the free one has no
/// solution, as in a sphere much smaller than the breast. On the synthetic patients 1.2 to 2.1
/// beyond the breast, 3.9 in a sphere of half its radius.
const TO_FREE: f64 = 5.0;

/// One standard deviation of the tumour's displacement by the tissue beyond, mm, LPS; zero where
/// the region has no cut.
///
/// # Errors
/// When the user asks to stop, or the mechanics fail otherwise than by having no solution.
pub(crate) fn beyond(question: &Question<'_>, progress: Progress<'_>) -> Result<Vector, Error> {
    let body = question.coarse.with_mean(question.body.mean_young_kpa());
    let at = |cut: Cut, progress: Progress<'_>| -> Result<Option<Vector>, Error> {
        let params = Params { cut, ..*question.params };
        let solved = found(solve(&body, question.load, &params, progress))?;
        Ok(solved.map(|(deformation, _)| at_centre(&deformation, &question.tumour.centre())))
    };
    let Some(held) = at(Cut::Fixed, progress.part(0.0, 0.3))? else { return Ok(Vector::zeros()) };
    let way = match at(Cut::Free, progress.part(0.3, 0.7))? {
        Some(free) => free - held,
        None => {
            let springs = at(Cut::Spring, progress.part(0.7, 1.0))?;
            springs.map_or(Vector::zeros(), |springs| (springs - held) * TO_FREE)
        }
    };
    // Who has nothing or everything held in place of the springs may be off by the whole way.
    let share = if question.params.cut == Cut::Spring { SPRINGS } else { 1.0 };
    Ok(way * (share / NORMAL_95))
}

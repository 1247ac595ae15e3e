//! The modulus on the mesh that is asked.

use super::carried::{Carried, Part};
use super::family::Family;
use super::search::{Found, solve};
use super::{FitQuestion, StateFit, bootstrap};
use crate::Error;
use supine_fem::{Params, RestState, Sequence};
use supine_mesh::PointTree;
use supine_register::{Aligned, Shape, Start, align};
use supine_space::{Point, Progress};

/// The two moduli that are solved lie this far on each side of the path's best, as a share.
const ASIDE: f64 = 0.06;
/// Farther outside of both the skin is not told by them.
const BEYOND: f64 = 0.06;
/// Variance of residuals, (0.4 mm)², over some 60 that tell on their own.
pub(super) const PRIOR_MM2: f64 = 0.0027;
/// Attempts before it is given up.
const ATTEMPTS: usize = 3;
/// Reach of the loss at the end, mm.
pub(crate) const REACH_MM: f64 = 4.0;
/// A point of the skin is seen where a point of the scan lies this near, mm.
const SEEN_MM: f64 = 6.0;
/// Mesh and weights, as a share of E: what no residual shows.
const MODEL: f64 = 0.01;
/// Residuals of the breast that noise and surfaces alone leave, mm rms, and by what share of E the modulus that moves the
/// tumour may differ for each mm beyond: one modulus then does not describe the breast. Chosen on one such patient.
const MISFIT_MM: f64 = 0.45;
const MISFIT_PER_MM: f64 = 0.25;
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
    let Found { mut aligned, path, ended, other_pose } = found;
    let params = Params { rest, ..*question.params };
    let mut sequence = Sequence::new(question.body, question.load.ct, &params)?;
    for attempt in 0..ATTEMPTS {
        let kpa = aligned.values[0].exp();
        let mut family = Family::new(carried);
        for side in [1.0 + ASIDE, 1.0 - ASIDE] {
            let part = attempt as f64 * 0.2 + if side > 1.0 { 0.0 } else { 0.1 };
            progress.at(part)?;
            solve(question, &mut sequence, &mut family, kpa * side, true)?;
        }
        family.widen(BEYOND);
        let turn = aligned.values.get(1).copied().unwrap_or(0.0);
        aligned.values = vec![aligned.values[0], turn];
        aligned = on_mesh(question, &family, &aligned)?;
        if family.leans(&aligned.values) {
            aligned = on_mesh(question, &family, &aligned)?;
        }
        if !aligned.at_end[0] {
            let draws = bootstrap::deviation(question, &family, &aligned, progress.part(0.6, 1.0))?;
            let skin = family.points(&aligned.values);
            let misfit_mm = misfit_mm(&aligned, carried);
            let wrong = MISFIT_PER_MM * (misfit_mm - MISFIT_MM).max(0.0);
            let wall = WALL_PER_MM * question.wall_mm;
            let shares = [draws, pulled(&aligned, &family), MODEL, wall, wrong];
            let deviation = shares.iter().map(|share| share * share).sum::<f64>().sqrt();
            return Ok(StateFit {
                rest,
                young_kpa: aligned.values[0].exp(),
                lean_deg: aligned.values.get(1).copied().unwrap_or(0.0),
                deviation,
                bootstrap: draws,
                misfit_mm,
                seen: seen(&aligned, carried, &skin),
                skin,
                other_pose,
                aligned,
                path,
                ended,
            });
        }
    }
    Err(Error::AtEnd { rest, young_kpa: aligned.values[0].exp() })
}

/// The best pose, modulus and turn from those before.
fn on_mesh(
    question: &FitQuestion<'_>,
    family: &Family<'_>,
    before: &Aligned,
) -> Result<Aligned, Error> {
    let start = Start { pose: before.pose, values: before.values.clone() };
    let params =
        supine_register::Params { prior_mm2: PRIOR_MM2, ..question.params_of([REACH_MM; 2], 40) };
    Ok(align(question.scan, family, &start, &params, Progress::none())?)
}

/// Standard deviation of ln E because what is taken for likely of the turn, and draws it along, is known no better than its
/// prior says: draws of patches do not show that. With the information H and the prior's weights P it is (H + P)⁻¹ P times
/// the prior's deviation.
fn pulled(aligned: &Aligned, family: &Family<'_>) -> f64 {
    let [_, turn] = family.priors() else { return 0.0 };
    let weight = PRIOR_MM2 / turn.deviation.powi(2);
    let mut information = aligned.information.clone();
    information[(7, 7)] += weight;
    let inverse = information.cholesky().map(|factor| factor.inverse());
    inverse.map_or(f64::INFINITY, |inverse| (inverse[(6, 7)] * weight * turn.deviation).abs())
}

/// Share of the breast's skin that the scan shows.
fn seen(aligned: &Aligned, carried: &Carried, skin: &[Point]) -> f64 {
    let near = aligned.matches.0.iter().filter(|m| m.residual_mm.abs() < REACH_MM);
    let tree = PointTree::new(&near.map(|m| m.place).collect::<Vec<_>>());
    let breast = carried.parts.iter().zip(skin).filter(|(part, _)| **part == Part::Breast);
    let (mut all, mut shown) = (0usize, 0usize);
    for (_, point) in breast {
        all += 1;
        shown += usize::from(tree.nearest(point, SEEN_MM).is_some());
    }
    shown as f64 / all.max(1) as f64
}

/// Residuals of the breast within the reach, mm rms.
fn misfit_mm(aligned: &Aligned, carried: &Carried) -> f64 {
    let own =
        aligned.matches.0.iter().filter(|m| carried.parts[m.nearest as usize] == Part::Breast);
    let near: Vec<f64> = own.map(|m| m.residual_mm).filter(|r| r.abs() < REACH_MM).collect();
    (near.iter().map(|r| r * r).sum::<f64>() / near.len().max(1) as f64).sqrt()
}

//! How the tumour would move with the laws that a scan leaves possible.

use crate::Error;
use crate::curve::found;
use crate::fit::with_additions;
use crate::question::{OtherLaw, at_centre};
use supine_fem::{Body, Load, Params, solve};
use supine_mesh::Deformation;
use supine_record::LawFit;
use supine_space::{Point, Progress, Vector};

/// Less probable laws are left out.
const LEAST: f64 = 0.01;

/// The deformation of plain tissue with a law that was fitted, if it has one under this load.
///
/// # Errors
/// When the user stops.
pub fn with_law(
    law: &LawFit,
    plain: &Body,
    (load, params): (&Load, &Params),
    progress: Progress<'_>,
) -> Result<Option<Deformation>, Error> {
    let params = Params { rest: law.rest, ..*params };
    let (tissue, params) = with_additions(&law.additions, &plain.tissue, &params);
    let body = Body { tissue, ..plain.clone() }.with_mean(law.young_kpa);
    Ok(found(solve(&body, load, &params, progress))?.map(|(deformation, _)| deformation))
}

/// The laws beside the first, with how much farther they move a place in the CT (LPS, mm).
///
/// `plain` is the tissue without additions on a coarse mesh, as of the fit, `params` how it is
/// solved: all are compared on that. Plain tissue in another rest state than the first's is left to
/// the draws of rest states. Laws without a solution under this load are left out.
///
/// # Errors
/// When the user stops.
pub fn other_laws(
    laws: &[LawFit],
    plain: &Body,
    (load, params): (&Load, &Params),
    place: &Point,
    progress: Progress<'_>,
) -> Result<Vec<OtherLaw>, Error> {
    let Some(first) = laws.first() else { return Ok(vec![]) };
    let at = |law: &LawFit, progress: Progress<'_>| -> Result<Option<Vector>, Error> {
        let solved = with_law(law, plain, (load, params), progress)?;
        Ok(solved.map(|deformation| at_centre(&deformation, place)))
    };
    let likely = |law: &&LawFit| law.probability >= LEAST && law.additions != first.additions;
    let others: Vec<&LawFit> = laws[1..].iter().filter(likely).collect();
    let count = others.len() as f64 + 1.0;
    let part = |n: usize| progress.part(n as f64 / count, (n as f64 + 1.0) / count);
    let Some(own) = at(first, part(0))? else { return Ok(vec![]) };
    let mut told = Vec::new();
    for (n, law) in others.into_iter().enumerate() {
        let there = at(law, part(n + 1))?;
        told.extend(there.map(|u| OtherLaw { probability: law.probability, change: u - own }));
    }
    Ok(told)
}

//! Gland and skin with moduli of their own, as one more law that a scan may speak for.
//!
//! It has two parameters more and finer labels to be found, so it is tried last, where no other law
//! describes the breast.

use super::region::Chosen;
use super::tissues::labelled;
use super::{ByTissue, Imported, Law, Meshed, tissue_map};
use crate::Error;
use crate::nodes::segment::Segmented;
use crate::spec::Stiffness;
use crate::work::Work;
use std::sync::Arc;
use supine_fem::Body;
use supine_personalise::{DECIDES, Fit, FitQuestion, FittedState, Tissues, compare, fit};
use supine_report::{Addition, LawFit, STRUCTURED_MM, StateFit};
use supine_space::{Failure, Progress};

/// A breast that is described by moduli by tissue.
pub(super) struct FitByTissue {
    pub(super) fit: Fit,
    pub(super) by: ByTissue,
    /// How much better it describes the breast than the best of the other laws.
    evidence: f64,
}

/// Moduli by tissue, where the best of the other laws (`best`) leaves more than noise explains and
/// the scan speaks for them against it.
///
/// # Errors
/// When tissues cannot be labelled, and when the user stops.
pub(super) fn fit_by_tissue(
    (question, best): (&FitQuestion<'_>, &Fit),
    law: &Law,
    (input, segmented, region, meshed): (&Imported, &Segmented, &Chosen, &Meshed),
    work: &Work<'_>,
) -> Result<Option<FitByTissue>, Error> {
    let Some(other) = chosen(best).filter(|state| state.fit.structured_mm > STRUCTURED_MM) else {
        return Ok(None);
    };
    let (labels, _) = labelled((input, segmented, region), None, work.progress.part(0.8, 0.84))?;
    let Some(map) = tissue_map(input, &labels, true) else { return Ok(None) };
    let by = ByTissue::of(&meshed.mesh, &map, &Stiffness::likely());
    let on = by.on(&question.coarse.mesh, &map);
    let Some(rough) = proportions(question, &on, work.progress.part(0.84, 0.94))? else {
        return Ok(None);
    };
    let body = Body {
        young_kpa: Some(Arc::from(by.fitted(&meshed.mesh, &rough).0)),
        ..law.body(meshed, None, None)
    };
    let coarse = with(question.coarse, on.fitted(&question.coarse.mesh, &rough).0);
    let states = [rough.rest];
    let asked = FitQuestion { body: &body, coarse: &coarse, states: &states, ..*question };
    let Some(mut fitted) = possible(fit(&asked, work.progress.part(0.94, 0.98)))? else {
        return Ok(None);
    };
    fitted.states.iter_mut().for_each(|state| state.fit.tissues.clone_from(&rough.tissues));
    let evidence = chosen(&fitted).map(|own| compare(&asked, own, other));
    let speaks = evidence.filter(|evidence| *evidence > DECIDES);
    Ok(speaks.map(|evidence| FitByTissue { fit: fitted, by, evidence }))
}

/// What fits with the proportions of gland and skin, on the coarse mesh: on the whole one they
/// would take twenty times as long.
fn proportions(
    question: &FitQuestion<'_>,
    on: &ByTissue,
    progress: Progress<'_>,
) -> Result<Option<StateFit>, Error> {
    let body = with(question.coarse, on.young_kpa.clone());
    let tissues = Tissues { shares: &on.shares, coarse: &on.shares, likely: on.kpa() };
    let asked = FitQuestion { body: &body, coarse: &body, tissues: Some(tissues), ..*question };
    let rough = possible(fit(&asked, progress))?;
    let state = rough.as_ref().and_then(chosen).filter(|state| state.settled);
    Ok(state.map(|state| state.fit.clone()))
}

/// A body with a modulus for each tetrahedron.
fn with(body: &Body, young_kpa: Vec<f64>) -> Body {
    Body { young_kpa: Some(Arc::from(young_kpa)), ..body.clone() }
}

/// A fit, if there is one; without it the other laws stand.
fn possible(fit: Result<Fit, supine_personalise::Error>) -> Result<Option<Fit>, Error> {
    match fit {
        Ok(fit) => Ok(Some(fit)),
        Err(error) if error.kind() == Failure::Stopped => Err(Error::Fit(error)),
        Err(_) => Ok(None),
    }
}

/// The fit in the rest state that is gone on with.
fn chosen(fit: &Fit) -> Option<&FittedState> {
    fit.states.iter().find(|state| state.fit.rest == fit.choice.rest())
}

impl FitByTissue {
    /// The laws that were tried before, with this one first.
    pub(super) fn before(&self, others: Vec<LawFit>) -> Vec<LawFit> {
        let Some(own) = chosen(&self.fit) else { return others };
        let own = LawFit {
            additions: vec![Addition::Tissues],
            rest: own.fit.rest,
            young_kpa: own.fit.young_kpa,
            misfit_mm: own.fit.misfit_mm,
            table_mm: None,
            against: 0.0,
            probability: 1.0,
        };
        before(own, self.evidence, others)
    }
}

/// A law and, after it, those that it describes the breast so much better than (N ln(S'/S)).
fn before(mut own: LawFit, evidence: f64, mut others: Vec<LawFit>) -> Vec<LawFit> {
    let rest = (-0.5 * evidence).exp();
    for law in &mut others {
        law.against += evidence;
        law.probability *= rest / (1.0 + rest);
    }
    own.probability = 1.0 / (1.0 + rest);
    others.insert(0, own);
    others
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_fem::RestState;

    #[test]
    fn with_the_law_that_is_taken_probabilities_are_still_one_in_all() {
        let law = |additions, against, probability| LawFit {
            additions,
            rest: RestState::Net,
            young_kpa: 0.7,
            misfit_mm: 1.2,
            table_mm: None,
            against,
            probability,
        };
        let others = vec![law(vec![], 0.0, 0.75), law(vec![Addition::Stiffening(1.5)], 2.0, 0.25)];
        let own = law(vec![Addition::Tissues], 0.0, 1.0);
        let all = before(own, 12.0, others);
        assert_eq!(all[0].additions, [Addition::Tissues]);
        assert!((all.iter().map(|law| law.probability).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!((all[1].against, all[2].against), (12.0, 14.0));
        assert!(all[0].probability > 0.99);
    }
}

//! The law of the tissue that a scan of the sitting patient speaks for.
//!
//! Moduli by tissue need finer labels and have two parameters more than plain tissue, so they are
//! tried only where no law of one tissue comes near the breast: on the coarse mesh, where their
//! proportions are fitted for the whole one too.

use super::fit_scans::Scans;
use super::region::Chosen;
use super::tissues::labelled;
use super::{ByTissue, Imported, Meshed, tissue_map};
use crate::Error;
use crate::nodes::segment::Segmented;
use crate::shared::{PosedScan, landmarks};
use crate::spec::Stiffness;
use crate::work::Work;
use std::sync::Arc;
use supine_fem::Body;
use supine_personalise::{
    Carried, DECIDES, EvaluationQuestion, Fit, FitQuestion, Laws, RankedLaws, Tissues, TriedLaw,
    evaluate, fit, fit_law, moduli, with_law,
};
use supine_report::{Addition, FittedTissues, LawFit};
use supine_space::{Failure, Progress, Warning};

/// A breast with the law that describes it.
pub(super) struct FitByLaw {
    pub(super) fit: Fit,
    /// All laws that were tried, that of the fit first.
    pub(super) laws: Vec<LawFit>,
    /// Moduli by tissue, where these are the law.
    pub(super) by_tissue: Option<ByTissue>,
}

/// What labels of tissues are made from, and the mesh.
pub(super) type Anatomy<'a> = (&'a Imported, &'a Segmented, &'a Chosen, &'a Meshed);

/// The fit with the law that the scans speak for.
///
/// # Errors
/// When plain tissue fits in no rest state, tissues cannot be labelled, the scan on the table
/// cannot be read, and when the user stops.
pub(super) fn fit_by_law(
    question: &FitQuestion<'_>,
    (scans, anatomy): (&Scans, Anatomy<'_>),
    work: &Work<'_>,
) -> Result<FitByLaw, Error> {
    let mut laws = Laws::new(question, work.progress.part(0.4, 0.55)).map_err(Error::Fit)?;
    let tissues = match laws.are_far_off() {
        true => OnMeshes::of(question, anatomy, work.progress.part(0.55, 0.56))?,
        false => None,
    };
    if let Some(tissues) = &tissues {
        let progress = work.progress.part(0.56, 0.6);
        laws.by_tissue(tissues.of_question(), progress).map_err(Error::Fit)?;
    }
    laws.look_about(work.progress.part(0.6, 0.7)).map_err(Error::Fit)?;
    let laws = on_table(scans, question, (laws.ranked(), tissues.as_ref()), work)?;
    fitted(question, (laws.tried, tissues), work)
}

/// Tissues in the tetrahedra of the mesh and of the coarse one.
struct OnMeshes {
    fine: ByTissue,
    coarse: ByTissue,
}

impl OnMeshes {
    /// As the HU say; `None` where they tell no tissues apart.
    fn of(
        question: &FitQuestion<'_>,
        (input, segmented, region, meshed): Anatomy<'_>,
        progress: Progress<'_>,
    ) -> Result<Option<Self>, Error> {
        let (labels, _) = labelled((input, segmented, region), None, progress)?;
        let Some(map) = tissue_map(input, &labels, true) else { return Ok(None) };
        let fine = ByTissue::of(&meshed.mesh, &map, &Stiffness::likely());
        let coarse = fine.on(&question.coarse.mesh, &map);
        Ok(Some(Self { fine, coarse }))
    }

    fn of_question(&self) -> Tissues<'_> {
        let (shares, coarse) = (&self.fine.shares, &self.coarse.shares);
        Tissues { shares, coarse, likely: self.fine.kpa() }
    }
}

/// A body of tissues with moduli in these proportions.
fn with(body: &Body, by: &ByTissue, proportions: &FittedTissues) -> Body {
    let young_kpa = Some(Arc::from(moduli(&by.shares, &proportions.proportions())));
    Body { young_kpa, ..body.clone() }
}

/// The laws held against the scan on the table too, where there is one.
fn on_table(
    scans: &Scans,
    question: &FitQuestion<'_>,
    (laws, tissues): (RankedLaws, Option<&OnMeshes>),
    work: &Work<'_>,
) -> Result<RankedLaws, Error> {
    let Some((file, law)) = &scans.table else { return Ok(laws) };
    let (load, params) = (law.load(), question.params);
    let solved = laws.tried.iter().map(|tried| {
        let part = work.progress.part(0.7, 0.71);
        let by_tissue = tissues.zip(tried.tissues.as_ref());
        let body = by_tissue.map(|(on, found)| with(question.coarse, &on.coarse, found));
        let body = body.as_ref().unwrap_or(question.coarse);
        with_law(&tried.fit, body, (&load, params), part).map_err(Error::Fit)
    });
    let solved = solved.collect::<Result<Vec<_>, Error>>()?;
    let moved: Vec<_> =
        solved.iter().flatten().map(|found| ("law", found.displacement())).collect();
    let marks = landmarks(scans.landmarks.as_ref())?;
    let read = PosedScan::read(file, ("intraop", scans.unit), &marks, work)?;
    let asked = EvaluationQuestion {
        carried: &Carried::new(question.skin, &question.coarse.mesh, question.other),
        models: &moved,
        scan: &read.scan,
        pose: read.pose,
        centre: question.centre,
        tumour: question.centre,
    };
    let evaluation = evaluate(&asked, work.progress.part(0.71, 0.73)).map_err(Error::Evaluation)?;
    // The first is the CT's own skin.
    let mut off_mm = evaluation.spreads().skip(1).map(|(_, [_, breast])| breast.rms_mm);
    let of_laws: Vec<_> =
        solved.iter().map(|one| one.as_ref().and_then(|_| off_mm.next())).collect();
    Ok(laws.with_table(&of_laws))
}

/// The fit with the first of the laws that are possible which has a solution on this mesh.
fn fitted(
    question: &FitQuestion<'_>,
    (mut tried, tissues): (Vec<TriedLaw>, Option<OnMeshes>),
    work: &Work<'_>,
) -> Result<FitByLaw, Error> {
    let progress = work.progress.part(0.73, 0.98);
    let told = |tried: Vec<TriedLaw>| tried.into_iter().map(|law| law.fit).collect();
    let possible = |(n, law): &(usize, &TriedLaw)| *n == 0 || law.fit.against < DECIDES;
    let order = tried.iter().enumerate().filter(possible).map(|(n, _)| n);
    let plain = |law: &&TriedLaw| law.fit.additions.is_empty();
    let order: Vec<usize> = order.take_while(|n| !plain(&&tried[*n])).collect();
    for n in order {
        let by_tissue = tissues.as_ref().zip(tried[n].tissues.as_ref());
        let body = by_tissue.map(|(on, found)| with(question.body, &on.fine, found));
        let asked = FitQuestion { body: body.as_ref().unwrap_or(question.body), ..*question };
        match fit_law(&asked, &[&tried[n]], progress) {
            Ok(fit) => {
                tried[..=n].rotate_right(1);
                let own = tried[0].fit.additions == [Addition::Tissues];
                let by_tissue = tissues.filter(|_| own).map(|on| on.fine);
                return Ok(FitByLaw { fit, laws: told(tried), by_tissue });
            }
            Err(error) if error.kind() == Failure::Stopped => return Err(Error::Fit(error)),
            Err(error) => {
                let text = format!(
                    "the scan of the sitting patient speaks for tissue that is not plain ({}), which could not be fitted on this mesh: \
                     {error}",
                    tried[n].fit.words()
                );
                work.warn(Warning::new("law-not-fitted", text));
            }
        }
    }
    let states: Vec<&TriedLaw> = tried.iter().filter(plain).collect();
    let found = match states.len() == question.states.len() {
        true => fit_law(question, &states, progress),
        // One of the rest states that are asked has none: that is said.
        false => fit(question, progress),
    };
    let fit = found.map_err(Error::Fit)?;
    if let Some(n) = tried.iter().position(|law| plain(&law)) {
        tried[..=n].rotate_right(1);
    }
    Ok(FitByLaw { fit, laws: told(tried), by_tissue: None })
}

//! Which law of the tissue and its boundary a scan supports.
//!
//! Laws are fitted on the coarse mesh, each with its own modulus, lean and pose, and compared by
//! the breast's residuals as the rest states are (`evidence`). First plain tissue, then one of each
//! kind with a parameter in the middle of what is likely, and gland and skin with moduli of their
//! own where no kind comes near the breast; then the neighbours of kinds that the scan does not
//! speak against, and the parameter between those of the best; then pairs with the best where that
//! describes the breast badly. With their evidence and what is taken for likely before, each has a
//! probability.

use super::evidence::{DECIDES, breast, independent};
use super::refined::{Manner, misfit_mm, on_coarse, refined};
use super::search::{Found, JOINT_MM, STIFFEST_KPA, search};
use super::tissues::Tissues;
use super::{Carried, FitQuestion, FittedState, limits};
use crate::Error;
use rayon::prelude::*;
use std::mem::discriminant;
use supine_fem::{Body, Law, Membrane, Params, RestState, SlidingArea, Tissue, slides_everywhere};
use supine_mesh::Scan;
use supine_record::{Addition, FittedTissues, LawFit};
use supine_space::{Beside, Failure, Pose, Progress};

/// Residuals of the breast above which pairs are tried, mm rms: what noise and surfaces leave on
/// synthetic patients is 0.4.
const ROUGH_MM: f64 = 0.5;
/// Above which moduli by tissue are tried: a kind with another parameter than its best leaves less
/// on a breast that is of this kind.
const FAR_MM: f64 = 0.7;
/// Stiffening of the exponential law: that of fat outside the body is 1.5 and more, in place nobody
/// measured it.
const STIFFENING: [f64; 3] = [1.5, 0.7, 3.0];
/// Fibres, times the modulus.
const FIBRES: [f64; 3] = [2.0, 1.0, 4.0];
/// Sliding: radius, mm, over the base of a breast or all of the wall, and shear tractions per way,
/// kPa/mm. A layer of 1 to 1.5 mm with a tenth of the tissue's modulus has 0.02 to 0.03.
const SLIDING: [(f64, [f64; 3]); 2] = [(100.0, [0.02, 0.05, 0.008]), (65.0, [0.02, 0.05, 0.008])];
/// Skin: kPa, mm, stretch. Published moduli of skin in place begin at 20 kPa.
const SKIN: [[f64; 3]; 3] = [[40.0, 1.8, 1.03], [20.0, 1.8, 1.03], [60.0, 1.8, 1.03]];
/// Width of the rim of a wall that slides, as a share of its radius.
const RIM: f64 = 1.0 / 3.0;
/// With an addition moduli are tried from so many times that of plain tissue: sliding tissue is
/// stiffer than plain tissue that moves as far. From stiffer ones the pose is drawn along.
const STIFFER: f64 = 2.2;
/// A lean that is found on the coarse mesh with part of the scan may be off by this, degrees; that of
/// the answer is held to the limit.
const ROUGHLY_DEG: f64 = 2.0;
/// What is taken for likely before: plain tissue, and each kind of addition to it.
const PLAIN: f64 = 0.5;

/// The kinds of additions with their parameters, the likeliest first.
fn kinds() -> Vec<Vec<Addition>> {
    let sliding = |(radius_mm, stiffnesses): (f64, [f64; 3])| {
        let of = |stiffness_kpa_mm| {
            let rim_mm = RIM * radius_mm;
            Addition::Sliding(SlidingArea { centre_mm: None, radius_mm, rim_mm, stiffness_kpa_mm })
        };
        stiffnesses.map(of).to_vec()
    };
    let skin = |[young_kpa, thickness_mm, stretch]: [f64; 3]| {
        Addition::Skin(Membrane { thickness_mm, young_kpa, stretch })
    };
    let mut kinds = vec![
        STIFFENING.map(Addition::Stiffening).into(),
        FIBRES.map(Addition::Fibres).into(),
        SKIN.map(skin).into(),
    ];
    kinds.extend(SLIDING.map(sliding));
    kinds
}

/// The tissue and how it is solved with some additions.
pub fn with_additions(
    additions: &[Addition],
    tissue: &Tissue,
    params: &Params,
) -> (Tissue, Params) {
    let (mut tissue, mut params) = (*tissue, *params);
    for addition in additions {
        match *addition {
            Addition::Stiffening(by) => {
                (tissue.law, tissue.stiffening) = (Law::Exponential, by);
            }
            Addition::Fibres(ratio) => tissue.fibres = ratio,
            Addition::Sliding(area) => params.sliding = Some(area),
            Addition::Skin(skin) => params.skin = Some(skin),
            // They lie in the moduli of the body.
            Addition::Tissues => {}
        }
    }
    (tissue, params)
}

/// A law in one rest state.
#[derive(Clone, Debug)]
struct Trial {
    additions: Vec<Addition>,
    rest: RestState,
    /// Probability before the scan, but for a factor that is common to all.
    likely: f64,
}

/// How a trial fits.
#[derive(Debug)]
struct Tried {
    trial: Trial,
    misfit_mm: f64,
    found: Found,
    tissues: Option<FittedTissues>,
}

impl Tried {
    fn kpa(&self) -> f64 {
        self.found.aligned.values[0].exp()
    }

    fn by_tissue(&self) -> bool {
        self.trial.additions == [Addition::Tissues]
    }
}

/// The laws that were tried with their probabilities, the one to be taken first, the others by how
/// well they fit. To be taken is that with the fewest parameters among those that the scans do not
/// speak against. Moduli by tissue are among them only where they are to be taken.
#[derive(Clone, Debug)]
pub struct RankedLaws {
    /// Never empty.
    pub tried: Vec<TriedLaw>,
    /// Residuals of the breast that tell on their own.
    counted: f64,
}

impl RankedLaws {
    /// Adds what the scan on the table says: of each law the distance of its skin from that, mm
    /// rms. A law without a shape on the table is none.
    #[must_use]
    pub fn with_table(self, table_mm: &[Option<f64>]) -> Self {
        let Self { tried, counted } = self;
        let seen = tried.iter().zip(table_mm).filter_map(|(law, mm)| mm.map(|mm| (law, mm)));
        let least = seen.clone().map(|(_, mm)| mm).fold(f64::INFINITY, f64::min);
        let weighed = |(law, mm): (&TriedLaw, f64)| {
            let off = counted * (mm / least).ln();
            let mut law = law.clone();
            law.fit.table_mm = Some(mm);
            law.fit.against += 2.0 * off;
            law.fit.probability *= (-off).exp();
            law
        };
        let both: Vec<TriedLaw> = seen.map(weighed).collect();
        if both.is_empty() {
            return Self { tried, counted };
        }
        Self { tried: in_order(both), counted }
    }
}

/// The best first, and before it the simplest of those that are not spoken against: one parameter
/// more is believed only where the scans speak for it. Moduli by tissue that are not the first are
/// left out: other laws are held beside the first on one body, which has one modulus then.
fn in_order(mut laws: Vec<TriedLaw>) -> Vec<TriedLaw> {
    let best = laws.iter().map(|law| law.fit.against).fold(f64::INFINITY, f64::min);
    let whole: f64 = laws.iter().map(|law| law.fit.probability).sum();
    for law in &mut laws {
        law.fit.against -= best;
        law.fit.probability /= whole.max(f64::MIN_POSITIVE);
    }
    laws.sort_by(|a, b| a.fit.against.total_cmp(&b.fit.against));
    let possible = laws.iter().enumerate().filter(|(_, law)| law.fit.against < DECIDES);
    if let Some((n, _)) = possible.min_by_key(|(_, law)| parameters(&law.fit.additions)) {
        laws[..=n].rotate_right(1);
    }
    let by_tissue = |law: &TriedLaw| law.fit.additions == [Addition::Tissues];
    let Some(n) = laws.iter().skip(1).position(by_tissue) else { return laws };
    laws.remove(n + 1);
    in_order(laws)
}

/// Parameters beside the modulus that additions have.
fn parameters(additions: &[Addition]) -> usize {
    additions.iter().map(|addition| if *addition == Addition::Tissues { 2 } else { 1 }).sum()
}

/// A law that was tried.
#[derive(Clone, Debug)]
pub struct TriedLaw {
    /// How it fits on the coarse mesh.
    pub fit: LawFit,
    /// The moduli of the tissues in proportion to each other, where these are of the law.
    pub tissues: Option<FittedTissues>,
    /// What [`super::fit_law`] goes on from.
    pub(super) found: Found,
}

/// Laws that are held against a scan.
#[derive(Debug)]
pub struct Laws<'a> {
    question: &'a FitQuestion<'a>,
    /// As many points of the scan as tell laws apart.
    scan: Scan,
    carried: Carried,
    /// Residuals of the breast that tell on their own.
    counted: f64,
    /// Never empty.
    tried: Vec<Tried>,
}

impl<'a> Laws<'a> {
    /// Holds plain tissue and one of each kind of addition against the scan.
    ///
    /// # Errors
    /// When plain tissue fits in no rest state, as [`super::fit`], and when the user stops.
    pub fn new(question: &'a FitQuestion<'a>, progress: Progress<'_>) -> Result<Self, Error> {
        let mut laws = Self::plain(question, progress.part(0.0, 0.3))?;
        laws.one_of_each_kind(progress.part(0.3, 1.0))?;
        Ok(laws)
    }

    /// Whether none comes near the breast, so that moduli by tissue are worth their labels.
    pub fn are_far_off(&self) -> bool {
        self.best().misfit_mm > FAR_MM
    }

    /// Looks about the laws that the scan does not speak against: other parameters, and pairs where
    /// the best leaves more on the breast than noise and surfaces do.
    ///
    /// # Errors
    /// When the user stops.
    pub fn look_about(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        self.neighbours(progress.part(0.0, 0.4))?;
        self.between(progress.part(0.4, 0.5))?;
        if self.best().misfit_mm > ROUGH_MM {
            self.pairs(progress.part(0.5, 1.0))?;
        }
        Ok(())
    }

    /// Plain tissue in each rest state.
    fn plain(question: &'a FitQuestion<'a>, progress: Progress<'_>) -> Result<Self, Error> {
        let carried = Carried::new(question.skin, &question.coarse.mesh, question.other);
        let plain = |rest: &RestState| Trial { additions: vec![], rest: *rest, likely: PLAIN };
        let trials = question.states.iter().map(plain).collect();
        let scan = question.scan.thinned(JOINT_MM);
        let mut search = Self { question, scan, carried, counted: 0.0, tried: vec![] };
        let (fit, not): (Vec<_>, Vec<_>) =
            search.each(trials, question.poses, progress).into_iter().partition(Result::is_ok);
        match (fit.is_empty(), not.into_iter().find_map(Result::err)) {
            (true, Some(error)) => return Err(error),
            _ => search.tried = fit.into_iter().flatten().collect(),
        }
        search.counted = independent(&breast(&search.best().found.aligned, &search.carried));
        Ok(search)
    }

    /// The kinds of additions. A wall of this mesh that slides everywhere is none: nothing tells
    /// where the breast is then, and the search takes minutes.
    fn kinds(&self) -> Vec<Vec<Addition>> {
        let mesh = &self.question.coarse.mesh;
        let everywhere = |kind: &Vec<Addition>| match &kind[0] {
            Addition::Sliding(area) => slides_everywhere(area, mesh),
            _ => false,
        };
        kinds().into_iter().filter(|kind| !everywhere(kind)).collect()
    }

    /// One of each kind of addition, in the rest states that the scan does not speak against.
    fn one_of_each_kind(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        let kinds = self.kinds();
        let states: Vec<RestState> = self.near().map(|tried| tried.trial.rest).collect();
        let mut trials = Vec::new();
        for kind in &kinds {
            let likely = (1.0 - PLAIN) / (kind.len() * kinds.len()) as f64;
            let of = |rest: &RestState| Trial { additions: vec![kind[0]], rest: *rest, likely };
            trials.extend(states.iter().map(of));
        }
        self.add(trials, progress)
    }

    /// Other parameters of those that the scan does not speak against.
    fn neighbours(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        let mut trials = Vec::new();
        for kind in self.kinds() {
            let own = self.near().filter(|tried| tried.trial.additions == [kind[0]]);
            for Tried { trial, .. } in own {
                let of = |other: &Addition| Trial { additions: vec![*other], ..trial.clone() };
                trials.extend(kind[1..].iter().map(of));
            }
        }
        self.add(trials, progress)
    }

    /// The parameter at which the evidence of the best and of those on both sides of it, a parabola
    /// over the logarithm of the parameter, is greatest.
    fn between(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        let best = &self.best().trial;
        let [addition] = best.additions.as_slice() else { return Ok(()) };
        let alike = |tried: &&Tried| match tried.trial.additions.as_slice() {
            [other] => {
                tried.trial.rest == best.rest
                    && with_strength(other, strength(addition)) == *addition
            }
            _ => false,
        };
        let of = |tried: &Tried| (strength(&tried.trial.additions[0]).ln(), self.against(tried));
        let mut tried: Vec<(f64, f64)> = self.tried.iter().filter(alike).map(of).collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let around = tried.windows(3).find(|three| three[1].0 == strength(addition).ln());
        let Some(&[low, middle, high]) = around else { return Ok(()) };
        let at = two_digits(lowest([low, middle, high]).exp());
        if [low, middle, high].iter().any(|(other, _)| (other - at.ln()).abs() < 1e-9) {
            return Ok(());
        }
        let trial = Trial { additions: vec![with_strength(addition, at)], ..best.clone() };
        self.add(vec![trial], progress)
    }

    /// Gland and skin with moduli of their own, in the rest states that the scan does not speak
    /// against; of these tissues only their shares of the coarse mesh are looked at.
    ///
    /// # Errors
    /// When the user stops.
    pub fn by_tissue(&mut self, tissues: Tissues<'_>, progress: Progress<'_>) -> Result<(), Error> {
        let tissues = Tissues { shares: tissues.coarse, ..tissues };
        let near = |rest: &&RestState| self.near().any(|tried| tried.trial.rest == **rest);
        let likely = (1.0 - PLAIN) / kinds().len() as f64;
        let of =
            |rest: &RestState| Trial { additions: vec![Addition::Tissues], rest: *rest, likely };
        let trials: Vec<Trial> = self.question.states.iter().filter(near).map(of).collect();
        let beside = Beside::new(progress, trials.len());
        let one = |(n, trial): (usize, Trial)| {
            let watch = beside.one(n);
            self.one_by_tissue(trial, tissues, Progress::new(&watch))
        };
        let found = trials.into_par_iter().enumerate().map(one).collect();
        self.keep(found)
    }

    /// A second addition beside the best of those that have one alone: of those kinds that alone are
    /// not decidedly worse than plain tissue.
    fn pairs(&mut self, progress: Progress<'_>) -> Result<(), Error> {
        let single = self.tried.iter().filter(|tried| !tried.by_tissue());
        let Some(best) = single.min_by(|a, b| a.misfit_mm.total_cmp(&b.misfit_mm)) else {
            return Ok(());
        };
        let [first] = best.trial.additions.as_slice() else { return Ok(()) };
        let likely = 0.5 * best.trial.likely;
        let same = |other: &Addition| discriminant(other) == discriminant(first);
        let alone = |additions: &[Addition]| {
            let of = |tried: &&Tried| {
                tried.trial.rest == best.trial.rest && tried.trial.additions == additions
            };
            self.tried.iter().find(of).map(|tried| self.against(tried))
        };
        let worse = |kind: &[Addition]| {
            let both = alone(&kind[..1]).zip(alone(&[]));
            both.is_some_and(|(own, plain)| own > plain + DECIDES)
        };
        let others = self.kinds().into_iter().filter(|kind| !same(&kind[0]) && !worse(kind));
        let of = |kind: Vec<Addition>| Trial {
            additions: vec![*first, kind[0]],
            likely,
            ..best.trial.clone()
        };
        let trials = others.map(of).collect();
        self.add(trials, progress)
    }

    /// With probabilities, the one to be taken first.
    pub fn ranked(&self) -> RankedLaws {
        let weight = |tried: &Tried| tried.trial.likely * (-0.5 * self.against(tried)).exp();
        let of = |tried: &Tried| TriedLaw {
            fit: LawFit {
                additions: tried.trial.additions.clone(),
                rest: tried.trial.rest,
                young_kpa: tried.kpa(),
                misfit_mm: tried.misfit_mm,
                table_mm: None,
                against: self.against(tried),
                probability: weight(tried),
            },
            tissues: tried.tissues.clone(),
            found: tried.found.clone(),
        };
        let tried = in_order(self.tried.iter().map(of).collect());
        RankedLaws { tried, counted: self.counted }
    }

    /// The one that fits best.
    fn best(&self) -> &Tried {
        let off = |tried: &&Tried| tried.misfit_mm;
        let best = self.tried.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        best.unwrap_or(&self.tried[0])
    }

    /// N ln(S/S') of one against the best.
    fn against(&self, tried: &Tried) -> f64 {
        2.0 * self.counted * (tried.misfit_mm / self.best().misfit_mm).ln()
    }

    /// The misfit from which on the scan speaks against a law, mm.
    fn possible_mm(&self) -> f64 {
        self.best().misfit_mm * (0.5 * DECIDES / self.counted).exp()
    }

    /// Those that the scan does not speak against.
    fn near(&self) -> impl Iterator<Item = &Tried> {
        self.tried.iter().filter(|tried| self.against(tried) < DECIDES)
    }

    /// Tries more.
    fn add(&mut self, trials: Vec<Trial>, progress: Progress<'_>) -> Result<(), Error> {
        let pose = [self.best().found.aligned.pose];
        self.keep(self.each(trials, &pose, progress))
    }

    /// Keeps those that have a solution.
    fn keep(&mut self, found: Vec<Result<Tried, Error>>) -> Result<(), Error> {
        for found in found {
            match found {
                Ok(tried) => self.tried.push(tried),
                Err(error) if error.kind() == Failure::Stopped => return Err(error),
                Err(_) => {}
            }
        }
        Ok(())
    }

    /// Fits side by side, the scan first in these poses.
    fn each(
        &self,
        trials: Vec<Trial>,
        poses: &[Pose],
        progress: Progress<'_>,
    ) -> Vec<Result<Tried, Error>> {
        let beside = Beside::new(progress, trials.len());
        let one = |(n, trial): (usize, Trial)| {
            let watch = beside.one(n);
            self.one(trial, poses, Progress::new(&watch))
        };
        trials.into_par_iter().enumerate().map(one).collect()
    }

    fn one(&self, trial: Trial, poses: &[Pose], progress: Progress<'_>) -> Result<Tried, Error> {
        let law = Lawful::new(self.question, &trial.additions);
        let asked = law.question(self.question);
        let question = &FitQuestion { body: &law.coarse, poses, scan: &self.scan, ..asked };
        let from_kpa = self.stiffest_kpa(trial.rest);
        let mut best =
            search(question, &self.carried, trial.rest, from_kpa, progress.part(0.0, 0.6))?;
        // Where the lean has no solution, the breast is compared as upright as the path has it.
        let (aligned, rest) = (&best.aligned, trial.rest);
        match on_coarse(question, &self.carried, rest, aligned, progress.part(0.6, 1.0)) {
            Err(error) if error.kind() != Failure::Stopped => {}
            settled => best.aligned = settled?,
        }
        let misfit_mm = misfit_mm(&best.aligned, &self.carried);
        tried(trial, misfit_mm, best, None)
    }

    fn one_by_tissue(
        &self,
        trial: Trial,
        tissues: Tissues<'_>,
        progress: Progress<'_>,
    ) -> Result<Tried, Error> {
        let body = tissues.body(self.question.coarse, tissues.start());
        let poses = [self.best().found.aligned.pose];
        let question = &FitQuestion {
            body: &body,
            coarse: &body,
            poses: &poses,
            scan: &self.scan,
            tissues: Some(tissues),
            ..*self.question
        };
        let (rest, from_kpa) = (trial.rest, self.stiffest_kpa(trial.rest));
        let found = search(question, &self.carried, rest, from_kpa, progress.part(0.0, 0.3))?;
        let (path, levels) = (found.clone(), [&self.carried; 2]);
        let asked = (rest, Manner::compared(self.possible_mm()));
        let state = refined(question, levels, asked, path, progress.part(0.3, 1.0))?;
        let FittedState { fit, aligned, .. } = state;
        match fit.tissues {
            Some(FittedTissues { gland, skin, .. }) if !state.settled => {
                Err(Error::Unsettled { rest, gland, skin })
            }
            tissues => tried(trial, fit.misfit_mm, Found { aligned, ..found }, tissues),
        }
    }

    /// Where the path of a law begins, kPa.
    fn stiffest_kpa(&self, rest: RestState) -> f64 {
        let plain = self.tried.iter().find(|tried| tried.trial.rest == rest);
        plain.map_or(STIFFEST_KPA, |plain| STIFFER * plain.kpa())
    }
}

/// What was tried, unless the patient would have to lie.
fn tried(
    trial: Trial,
    misfit_mm: f64,
    found: Found,
    tissues: Option<FittedTissues>,
) -> Result<Tried, Error> {
    let lean_deg = found.aligned.values.get(1).copied().unwrap_or(0.0);
    if lean_deg.abs() > limits::LEANS_DEG + ROUGHLY_DEG {
        return Err(Error::Posture { lean_deg, misfit_mm });
    }
    Ok(Tried { trial, misfit_mm, found, tissues })
}

/// What is asked, of tissue with additions.
pub(super) struct Lawful {
    body: Body,
    coarse: Body,
    params: Params,
}

impl Lawful {
    pub(super) fn new(question: &FitQuestion<'_>, additions: &[Addition]) -> Self {
        let (tissue, params) = with_additions(additions, &question.body.tissue, question.params);
        let of = |body: &Body| Body { tissue, ..body.clone() };
        Self { body: of(question.body), coarse: of(question.coarse), params }
    }

    pub(super) fn question<'a>(&'a self, question: &FitQuestion<'a>) -> FitQuestion<'a> {
        FitQuestion { body: &self.body, coarse: &self.coarse, params: &self.params, ..*question }
    }
}

/// The parameter of an addition that neighbours differ by.
fn strength(addition: &Addition) -> f64 {
    match addition {
        Addition::Stiffening(by) => *by,
        Addition::Fibres(ratio) => *ratio,
        Addition::Sliding(area) => area.stiffness_kpa_mm,
        Addition::Skin(skin) => skin.young_kpa,
        Addition::Tissues => 1.0,
    }
}

/// The same addition with another such parameter.
fn with_strength(addition: &Addition, strength: f64) -> Addition {
    match *addition {
        Addition::Stiffening(_) => Addition::Stiffening(strength),
        Addition::Fibres(_) => Addition::Fibres(strength),
        Addition::Sliding(area) => {
            Addition::Sliding(SlidingArea { stiffness_kpa_mm: strength, ..area })
        }
        Addition::Skin(skin) => Addition::Skin(Membrane { young_kpa: strength, ..skin }),
        Addition::Tissues => Addition::Tissues,
    }
}

/// Where the parabola through three points, the middle one the lowest, is lowest.
fn lowest([a, b, c]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((b.0 - a.0) * (b.1 - c.1), (b.0 - c.0) * (b.1 - a.1));
    let (upper, lower) = ((b.0 - a.0) * left - (b.0 - c.0) * right, left - right);
    if lower == 0.0 { b.0 } else { b.0 - 0.5 * upper / lower }
}

/// To the digits that a scan tells.
fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_has_two_digits() {
        let found = [0.029_139, 1.596, 47.2].map(two_digits);
        assert_eq!(found, [0.029, 1.6, 47.0]);
    }

    #[test]
    fn between_three_points_lies_the_lowest_of_their_parabola() {
        let parabola = |x: f64| (x, 3.0 * (x - 0.4).powi(2) - 1.0);
        let found = lowest([-1.0, 0.2, 2.0].map(parabola));
        assert!((found - 0.4).abs() < 1e-12, "{found}");
        assert_eq!(lowest([(-1.0, 2.0), (0.0, 2.0), (1.0, 2.0)]), 0.0);
    }

    #[test]
    fn neighbours_differ_by_their_strength_alone() {
        for kind in kinds() {
            for addition in &kind {
                assert_eq!(with_strength(addition, strength(addition)), *addition);
                assert_eq!(with_strength(addition, strength(&kind[0])), kind[0]);
            }
        }
    }
}

//! The modulus on the mesh that is asked.

use super::carried::{Carried, Part};
use super::evidence::breast;
use super::family::Family;
use super::limits::{PRIOR_MM2, REACH_MM};
use super::search::{Found, Solved};
use super::structure::{farthest, structured_mm};
use super::tissues::{self, Tissues, settled};
use super::{FitQuestion, FittedState, bootstrap};
use crate::Error;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::sync::Arc;
use supine_fem::{Body, RestState, Sequence};
use supine_mesh::{Displacement, PointTree};
use supine_record::{DeviationParts, StateFit, interval_95};
use supine_register::{Aligned, Prior, Shape, Start, align};
use supine_space::{Beside, Point, Progress};

/// The two moduli that are solved on each side of the path's best, as shares of it.
const ASIDE: [f64; 2] = [1.06, 0.94];
/// The one that is solved where laws are only compared: its slope tells the others.
const MIDDLE: [f64; 1] = [1.0];
/// Farther outside of them, divided by how many are solved, the skin is not told by them.
const BEYOND: f64 = 0.12;
/// Attempts before it is given up.
const ATTEMPTS: usize = 4;
const ATTEMPTS_BY_TISSUE: usize = 10;
/// After so many, tissues that describe the breast no better than is hoped of them are given up.
const HOPED: usize = 5;
/// A point of the skin is seen where a point of the scan lies this near, mm.
const SEEN_MM: f64 = 6.0;
/// Mesh and weights, as a share of E: what no residual shows.
const MESH: f64 = 0.01;
/// Residuals of the breast that noise and surfaces alone leave, mm rms, and by what share of E the
/// modulus that moves the tumour may differ for each mm beyond: one modulus then does not describe
/// the breast. Chosen on one such patient.
const MISFIT_MM: f64 = 0.45;
const MISFIT_PER_MM: f64 = 0.25;
/// Share of E by which a wall 1 mm off changes it.
const WALL_PER_MM: f64 = 0.035;

/// How a fit is corrected.
#[derive(Clone, Copy)]
pub(super) struct Manner {
    /// The moduli that are solved, as shares of the one that is looked for.
    sides: &'static [f64],
    /// Tissues that leave more than this on the breast are given up, mm.
    hoped_mm: f64,
}

impl Manner {
    /// For the answer.
    pub(super) const WHOLE: Self = Self { sides: &ASIDE, hoped_mm: f64::INFINITY };

    /// For laws that are compared.
    pub(super) fn compared(hoped_mm: f64) -> Self {
        Self { sides: &MIDDLE, hoped_mm }
    }
}

/// Corrects what the path found.
pub(super) fn refined(
    question: &FitQuestion<'_>,
    [coarse, fine]: [&Carried; 2],
    (rest, manner): (RestState, Manner),
    found: Found,
    progress: Progress<'_>,
) -> Result<FittedState, Error> {
    let Found { aligned, path, ended, other_pose } = found;
    let level = |body, carried, tissues| Level { question, manner, body, carried, tissues, rest };
    let about = question.tissues.map(|tissues| tissues.start());
    let mut start = Settled { aligned, about, still: true };
    let (mut from, mut attempts) = (0.0, about.map_or(ATTEMPTS, |_| ATTEMPTS_BY_TISSUE));
    let finer = !Arc::ptr_eq(&question.body.mesh, &question.coarse.mesh);
    if let Some(tissues) = question.tissues.filter(|_| finer) {
        (from, attempts) = (0.4, ATTEMPTS);
        let tissues = Tissues { shares: tissues.coarse, ..tissues };
        let level = level(question.coarse, coarse, Some(tissues));
        start = level.settle(start, ATTEMPTS_BY_TISSUE, progress.part(0.0, from))?.0;
    }
    let level = level(question.body, fine, question.tissues);
    let (settled, family) = level.settle(start, attempts, progress.part(from, 0.8))?;
    let Settled { aligned, still, .. } = settled;
    let draws = bootstrap::deviations(question, &family, &aligned, progress.part(0.8, 1.0))?;
    let (pulls, misfit_mm) = (Pulls::new(&aligned, &family), misfit_mm(&aligned, fine));
    let parts = DeviationParts {
        scan: draws[0],
        posture: pulls.of(0, 1..2),
        tissues: pulls.of(0, 2..4),
        mesh: MESH,
        wall: WALL_PER_MM * question.wall_mm,
        misfit: MISFIT_PER_MM * (misfit_mm - MISFIT_MM).max(0.0),
    };
    let tissues = question.tissues.map(|tissues| {
        let deviations = [2, 3].map(|k: usize| draws[k].hypot(pulls.of(k, 1..4)));
        tissues.proportions([aligned.values[2], aligned.values[3]], deviations)
    });
    let residuals = breast(&aligned, fine);
    let skin = family.points(&aligned.values);
    let (young_kpa, deviation) = (aligned.values[0].exp(), parts.whole());
    let fit = StateFit {
        rest,
        young_kpa,
        interval_kpa: interval_95(young_kpa, deviation),
        deviation,
        parts,
        lean_deg: aligned.values[1],
        misfit_mm,
        structured_mm: structured_mm(&residuals),
        farthest: farthest(&residuals),
        tissues,
        other_pose,
        patient_from_scan: aligned.pose.to_homogeneous().transpose().into(),
        path,
        ended,
    };
    Ok(FittedState { seen: seen(&aligned, fine, &skin), fit, settled: still, aligned, skin })
}

/// Corrects what the path found on the coarse mesh alone, to be compared.
pub(super) fn on_coarse(
    question: &FitQuestion<'_>,
    carried: &Carried,
    rest: RestState,
    aligned: &Aligned,
    progress: Progress<'_>,
) -> Result<Aligned, Error> {
    let (manner, body) = (Manner::compared(f64::INFINITY), question.coarse);
    let level = Level { question, manner, body, carried, tissues: None, rest };
    let start = Settled { aligned: aligned.clone(), about: None, still: true };
    Ok(level.settle(start, ATTEMPTS, progress)?.0.aligned)
}

/// Where the fit stands.
struct Settled {
    aligned: Aligned,
    /// Logarithms of the tissues' proportions about which is solved, where these are sought.
    about: Option<[f64; 2]>,
    /// Whether these stayed where they were solved.
    still: bool,
}

/// A mesh on which is solved.
struct Level<'a> {
    question: &'a FitQuestion<'a>,
    manner: Manner,
    body: &'a Body,
    carried: &'a Carried,
    tissues: Option<Tissues<'a>>,
    rest: RestState,
}

impl<'a> Level<'a> {
    /// Solves and aligns until the modulus lies within those that were solved, and the tissues
    /// stay.
    fn settle(
        &self,
        start: Settled,
        attempts: usize,
        progress: Progress<'_>,
    ) -> Result<(Settled, Family<'a>), Error> {
        let (rest, Settled { mut aligned, mut about, .. }) = (self.rest, start);
        let (mut kept, mut least_mm) = (Vec::new(), f64::INFINITY);
        for attempt in 1..=attempts {
            let [from, to] = [attempt - 1, attempt].map(|n| n as f64 / attempts as f64);
            let kpa = aligned.values[0].exp();
            let mut family = self.family(&mut kept, kpa, about, progress.part(from, to))?;
            let turn = aligned.values.get(1).copied().unwrap_or(0.0);
            aligned.values = vec![aligned.values[0], turn];
            aligned.values.extend(about.iter().flatten());
            aligned = on_mesh(self.question, &family, &aligned)?;
            if family.leans(&aligned.values) {
                aligned = on_mesh(self.question, &family, &aligned)?;
            }
            let (kpa, off_mm) = (aligned.values[0].exp(), misfit_mm(&aligned, self.carried));
            progress.found(&format!("{}: {kpa:.3} kPa, scan {off_mm:.2} mm off", rest.name()));
            least_mm = off_mm.min(least_mm);
            let found = about.map(|_| [aligned.values[2], aligned.values[3]]);
            let still = found.zip(about).is_none_or(|(found, about)| settled(found, about));
            let hopeless = attempt >= HOPED && least_mm > self.manner.hoped_mm;
            if !aligned.at_end[0] && (still || hopeless || attempt == attempts) {
                return Ok((Settled { aligned, about: found, still }, family));
            }
            about = found;
        }
        Err(Error::AtEnd { rest, young_kpa: aligned.values[0].exp() })
    }

    /// The skin near a modulus, and near logarithms of the tissues' proportions where these are
    /// sought. What is solved is kept as long as the tissues stay.
    fn family(
        &self,
        kept: &mut Vec<Sequence>,
        kpa: f64,
        about: Option<[f64; 2]>,
        progress: Progress<'_>,
    ) -> Result<Family<'a>, Error> {
        let tissues = about.zip(self.tissues);
        if let Some((about, tissues)) = tissues {
            *kept = self.sequences(&tissues.body(self.body, about))?;
        } else if kept.is_empty() {
            *kept = self.sequences(self.body)?;
        }
        let beside = Beside::new(progress, kept.len());
        let one = |(n, (sequence, side)): (usize, (&mut Sequence, &f64))| {
            let watch = beside.one(n);
            Solved::at(self.question, sequence, (kpa * side, true), Progress::new(&watch))
        };
        // Side by side: one alone does not keep two processors busy.
        let (solved, further) = rayon::join(
            || {
                let solved = kept.par_iter_mut().zip(self.manner.sides).enumerate().map(one);
                solved.collect::<Vec<_>>()
            },
            || tissues.map(|about| self.further(about, kpa)).transpose(),
        );
        let mut family = Family::new(self.carried);
        for solved in solved {
            solved?.add_to(&mut family);
        }
        family.widen(BEYOND / self.manner.sides.len() as f64);
        for (prior, about, moved) in further?.into_iter().flatten() {
            family.add_further(prior, about, &moved, tissues::ASIDE);
        }
        Ok(family)
    }

    /// What is taken for likely of gland and skin, where they were solved, and the displacement a
    /// step of each from there, mm, at the softest modulus.
    fn further(
        &self,
        (about, tissues): ([f64; 2], Tissues<'_>),
        kpa: f64,
    ) -> Result<Vec<(Prior, f64, Displacement)>, Error> {
        let softest = self.manner.sides.iter().copied().fold(f64::INFINITY, f64::min);
        let target = self.question.load.target;
        let one = |which: usize| {
            let mut there = about;
            there[which] += tissues::ASIDE;
            let mut aside = self.sequence(&tissues.body(self.body, there))?;
            let moved = aside.at(kpa * softest, target, false, Progress::none())?;
            let moved = moved.deformation.displacement().clone();
            Ok((tissues.prior(which, about[which]), about[which], moved))
        };
        let both: Vec<_> = (0..about.len()).into_par_iter().map(one).collect();
        both.into_iter().collect()
    }

    /// One for each side.
    fn sequences(&self, body: &Body) -> Result<Vec<Sequence>, Error> {
        self.manner.sides.iter().map(|_| self.sequence(body)).collect()
    }

    fn sequence(&self, body: &Body) -> Result<Sequence, Error> {
        Ok(Sequence::new(body, self.question.load.ct, &self.question.solver(self.rest))?)
    }
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

/// What is taken for likely of parameters draws each other one along.
struct Pulls {
    /// (H + P)⁻¹ with the information H and the priors' weights P.
    inverse: Option<DMatrix<f64>>,
    /// Weight times deviation of each parameter's prior; 0 without one.
    priors: Vec<f64>,
}

impl Pulls {
    fn new(aligned: &Aligned, family: &Family<'_>) -> Self {
        let mut information = aligned.information.clone();
        let mut priors = Vec::new();
        for (k, prior) in family.priors().iter().enumerate() {
            information[(6 + k, 6 + k)] += PRIOR_MM2 / prior.deviation.powi(2);
            let known = prior.deviation.is_finite();
            priors.push(if known { PRIOR_MM2 / prior.deviation } else { 0.0 });
        }
        let inverse = information.cholesky().map(|factor| factor.inverse());
        Self { inverse, priors }
    }

    /// Standard deviation of a parameter because these others are known no better than their priors
    /// say, which draws of patches do not show: (H + P)⁻¹ P times the priors' deviations.
    fn of(&self, which: usize, others: std::ops::Range<usize>) -> f64 {
        let Some(inverse) = &self.inverse else { return f64::INFINITY };
        let known = others.filter(|other| *other < self.priors.len());
        let pulls = known.map(|other| inverse[(6 + which, 6 + other)] * self.priors[other]);
        pulls.map(|pull| pull * pull).sum::<f64>().sqrt()
    }
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
pub(super) fn misfit_mm(aligned: &Aligned, carried: &Carried) -> f64 {
    let own =
        aligned.matches.0.iter().filter(|m| carried.parts[m.nearest as usize] == Part::Breast);
    let near: Vec<f64> = own.map(|m| m.residual_mm).filter(|r| r.abs() < REACH_MM).collect();
    (near.iter().map(|r| r * r).sum::<f64>() / near.len().max(1) as f64).sqrt()
}

//! How far the modulus would be another with other patches of skin.
//!
//! Residuals of a scan are alike over a centimetre and more, so points are not drawn one by one:
//! cells of 30 mm are, with as many as there are, each as often as it comes, and the fit is done
//! again from the best. Source: block bootstrap, Künsch, Ann. Stat. 17, 1989.

use super::FitQuestion;
use super::family::Family;
use super::limits::{PRIOR_MM2, REACH_MM};
use crate::Error;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use std::collections::BTreeMap;
use supine_mesh::Scan;
use supine_register::{Aligned, Params, Posed, Start, align_near};
use supine_space::{Pose, Progress};

/// Side of a cell, mm.
const CELL_MM: f64 = 30.0;
/// Draws.
const DRAWS: usize = 60;
/// Distance of the points that take part, mm.
const SPACING_MM: f64 = 4.0;
/// Iterations of a draw from the best fit.
const ITERATIONS: usize = 5;
/// Start of the draws: the same each time.
const SEED: u64 = 30;

/// Standard deviation of each parameter over the draws.
pub(super) fn deviations(
    question: &FitQuestion<'_>,
    family: &Family<'_>,
    best: &Aligned,
    progress: Progress<'_>,
) -> Result<Vec<f64>, Error> {
    let scan = question.scan.thinned(SPACING_MM);
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let draws: Vec<Vec<f64>> = (0..DRAWS).map(|_| counts(&scan, &best.pose, &mut random)).collect();
    progress.at(0.1)?;
    let start = Start { pose: best.pose, values: best.values.clone() };
    let posed = Posed::new(family, &best.values);
    let once = |counts: Option<&[f64]>| {
        let params = Params {
            counts,
            prior_mm2: PRIOR_MM2,
            ..question.params_of([REACH_MM; 2], ITERATIONS)
        };
        Ok::<_, Error>(align_near(&scan, family, &posed, &start, &params)?.values)
    };
    let estimates: Vec<Vec<f64>> =
        draws.par_iter().map(|draw| once(Some(draw))).collect::<Result<_, _>>()?;
    progress.at(1.0)?;
    let deviation = |k: usize| {
        let mean = estimates.iter().map(|v| v[k]).sum::<f64>() / estimates.len() as f64;
        let squares = estimates.iter().map(|v| (v[k] - mean).powi(2)).sum::<f64>();
        (squares / (estimates.len() - 1) as f64).sqrt()
    };
    Ok((0..best.values.len()).map(deviation).collect())
}

/// How often each point of a scan counts in one draw of cells.
fn counts(scan: &Scan, pose: &Pose, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut share = || f64::from(random.next_u32()) / f64::from(u32::MAX);
    let offset = [share(), share(), share()];
    let cell = |p: &supine_space::Point| {
        let p = pose * p;
        [0, 1, 2].map(|a| (p[a] / CELL_MM + offset[a]).floor() as i64)
    };
    let cells: Vec<[i64; 3]> = scan.points().iter().map(cell).collect();
    let mut times: BTreeMap<[i64; 3], f64> = cells.iter().map(|c| (*c, 0.0)).collect();
    let all: Vec<[i64; 3]> = times.keys().copied().collect();
    for _ in 0..all.len() {
        let drawn = (share() * all.len() as f64) as usize;
        *times.entry(all[drawn.min(all.len() - 1)]).or_default() += 1.0;
    }
    cells.iter().map(|c| times[c]).collect()
}

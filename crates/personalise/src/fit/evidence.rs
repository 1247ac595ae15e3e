//! Which rest state a scan supports.

use super::FittedState;
use super::carried::{Carried, Part};
use super::limits::REACH_MM;
use supine_fem::RestState;
use supine_register::{Aligned, Match};
use supine_space::Point;

/// Evidence from which on one of the two is taken.
pub const DECIDES: f64 = 10.0;
/// Width of a class of distances, mm, and their number.
const CLASS_MM: f64 = 3.0;
const CLASSES: usize = 25;
/// Below this correlation residuals count as independent.
const INDEPENDENT: f64 = 0.05;
/// Points of the residuals that are compared, at most.
const COMPARED: usize = 3000;

/// Which rest state a scan supports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Choice {
    /// One alone was asked.
    Asked(RestState),
    /// One fits so much better.
    Decided {
        /// It.
        rest: RestState,
        /// N ln(S'/S), S the squares of the residuals of one and the other, N of them independent.
        evidence: f64,
    },
    /// Both fit about as well.
    Open {
        /// The one that fits better.
        better: RestState,
        /// As of `Decided`.
        evidence: f64,
    },
}

impl Choice {
    /// The rest state to go on with.
    pub fn rest(&self) -> RestState {
        match self {
            Self::Asked(rest) | Self::Decided { rest, .. } | Self::Open { better: rest, .. } => {
                *rest
            }
        }
    }
}

/// N ln(S'/S) for one fit (S) against another on the same mesh, S the squares of the breast's
/// residuals, N of them independent in the better one; negative when the other is better.
pub(super) fn evidence(one: &FittedState, other: &FittedState, carried: &Carried) -> f64 {
    let better = if one.fit.misfit_mm <= other.fit.misfit_mm { one } else { other };
    independent(&breast(&better.aligned, carried))
        * 2.0
        * (other.fit.misfit_mm / one.fit.misfit_mm).ln()
}

/// Compares the squares of the breast's residuals.
pub(super) fn choice(states: &[FittedState], carried: &Carried) -> Choice {
    let [a, b] = states else { return Choice::Asked(states[0].fit.rest) };
    let (better, worse) = if a.fit.misfit_mm <= b.fit.misfit_mm { (a, b) } else { (b, a) };
    let evidence = evidence(better, worse, carried);
    match evidence > DECIDES {
        true => Choice::Decided { rest: better.fit.rest, evidence },
        false => Choice::Open { better: better.fit.rest, evidence },
    }
}

/// Places and residuals of the breast.
pub(super) fn breast(aligned: &Aligned, carried: &Carried) -> Vec<(Point, f64)> {
    let own = |m: &&Match| {
        carried.parts[m.nearest as usize] == Part::Breast && m.residual_mm.abs() < REACH_MM
    };
    aligned.matches.0.iter().filter(own).map(|m| (m.place, m.residual_mm)).collect()
}

/// How many residuals tell on their own: the area of the breast over that within which they are
/// alike, ∫ ρ(d) 2π d dd up to where their correlation ρ vanishes.
pub(super) fn independent(residuals: &[(Point, f64)]) -> f64 {
    let every = residuals.len().div_ceil(COMPARED).max(1);
    let some: Vec<(Point, f64)> = residuals.iter().step_by(every).copied().collect();
    let variance = some.iter().map(|r| r.1 * r.1).sum::<f64>() / some.len().max(1) as f64;
    let (mut products, mut counts) = ([0.0; CLASSES], [0usize; CLASSES]);
    for (n, (p, r)) in some.iter().enumerate() {
        for (q, s) in &some[..n] {
            let class = ((p - q).norm() / CLASS_MM) as usize;
            if class < CLASSES {
                products[class] += r * s;
                counts[class] += 1;
            }
        }
    }
    let mut alike_mm2 = 0.0;
    for class in 0..CLASSES {
        let correlation = products[class] / (counts[class].max(1) as f64 * variance);
        if correlation < INDEPENDENT {
            break;
        }
        let middle = (class as f64 + 0.5) * CLASS_MM;
        alike_mm2 += correlation * 2.0 * std::f64::consts::PI * middle * CLASS_MM;
    }
    area_mm2(&some) / f64::max(alike_mm2, CLASS_MM * CLASS_MM)
}

/// Area that points on a surface cover, by the cubes that they lie in, mm²: a plane cuts about 1.5
/// times as many as lie beside each other in it.
fn area_mm2(points: &[(Point, f64)]) -> f64 {
    const SIDE_MM: f64 = 8.0;
    let cell = |p: &Point| [0, 1, 2].map(|a| (p[a] / SIDE_MM).floor() as i64);
    let mut cells: Vec<[i64; 3]> = points.iter().map(|(p, _)| cell(p)).collect();
    cells.sort_unstable();
    cells.dedup();
    cells.len() as f64 * SIDE_MM * SIDE_MM / 1.5
}

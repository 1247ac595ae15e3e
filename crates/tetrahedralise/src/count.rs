//! Bringing the mesh to exactly the asked number of tetrahedra.

use crate::collapse::CollapseRule;
use crate::mesher::Mesher;
use crate::remesh::MAX_REWORKED;
use std::collections::BTreeMap;
use supine_space::{Progress, Stopped};

/// Beyond this many tetrahedra from the goal, splits or collapses are simply done in order.
const NEAR: i64 = 8;
/// Candidates of each kind that are tried for the last steps.
const CANDIDATES: usize = 80;
/// So many when those offer nothing of this quality.
const MORE_CANDIDATES: usize = 320;
const FAIR: f64 = 0.45;
/// Best candidates kept for each change of the count.
const KEPT: usize = 4;
/// Qualities that single operations must reach, tried in this order.
const FLOORS: [f64; 8] = [0.58, 0.54, 0.5, 0.45, 0.4, 0.3, 0.2, 0.08];
/// Passes of the last steps before the count is given up.
const PASSES: usize = 40;
/// A collapse makes no edge longer than this multiple of the wanted length.
const LONGEST: f64 = 1.8;
/// A polishing round that betters the worst by less than this was idle.
const IDLE: f64 = 1e-3;
/// Smoothing can be hoped to better a tetrahedron from this share of the floor.
const HOPE: f64 = 0.45;
/// Tetrahedra worse than this are not made at all.
const MIN_QUALITY: f64 = 0.02;
/// The trade works on tetrahedra that are this much better than the worst at most, ...
const NARROW: f64 = 0.01;
/// ... and gives up when this much did not help.
const WIDE: f64 = 0.031;
/// A trade may leave faces this far off their surface in units of the edge length there.
const OFF: f64 = 0.07;
/// After a trade, tetrahedra this much better than the worst are polished.
const NEARLY_WORST: f64 = 0.05;
/// No change of the count.
pub(crate) const NONE: std::ops::RangeInclusive<i64> = 0..=0;

/// An operation that changes the count.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Step {
    Collapse([u32; 2]),
    Split([u32; 2]),
}

/// A tried operation: worst quality after it.
#[derive(Clone, Copy, Debug)]
struct Tried {
    step: Step,
    quality: f64,
}

impl Mesher<'_> {
    /// Brings the count to `goal`, in the last steps without faces more than `off` (mm) from their
    /// surface; false when it could not.
    pub(crate) fn reach(
        &mut self,
        goal: usize,
        off: f64,
        progress: Progress<'_>,
    ) -> Result<bool, Stopped> {
        let missing = |m: &Self| goal as i64 - m.mesh.count() as i64;
        for (n, floor) in FLOORS.into_iter().enumerate() {
            progress.at(0.5 * n as f64 / FLOORS.len() as f64)?;
            if missing(self).abs() > NEAR {
                self.approach(goal, floor);
            }
        }
        for pass in 0..PASSES {
            if missing(self) == 0 {
                return Ok(true);
            }
            progress.at(0.5 + 0.5 * pass as f64 / PASSES as f64)?;
            if !self.step_towards(missing(self), off) {
                return Ok(false);
            }
        }
        Ok(missing(self) == 0)
    }

    /// Splits or collapses in order of length while each step leaves tetrahedra of at least
    /// `floor` and the goal is not near.
    fn approach(&mut self, goal: usize, floor: f64) {
        let edges = self.edges_by_length();
        let over = self.mesh.count() > goal;
        let steps: Vec<Step> = if over {
            edges.into_iter().map(|(_, e)| Step::Collapse(e)).collect()
        } else {
            edges.into_iter().rev().map(|(_, e)| Step::Split(e)).collect()
        };
        for step in steps {
            let missing = goal as i64 - self.mesh.count() as i64;
            if missing.abs() <= NEAR || (missing < 0) != over {
                break;
            }
            self.mesh.begin();
            let good = self.take(step, HOPE * floor).is_some_and(|_| {
                let (before, after) = self.mesh.effect();
                after >= floor.min(before)
            });
            if good { self.mesh.commit() } else { self.mesh.rollback() }
        }
    }

    /// Does a step that leaves at least `floor` and smooths around it; the change of the count.
    fn take(&mut self, step: Step, floor: f64) -> Option<i64> {
        let before = self.mesh.count() as i64;
        let v = match step {
            Step::Split([a, b]) => self.split(a, b, floor)?,
            Step::Collapse(edge) => {
                if edge.iter().any(|&v| self.mesh.star[v as usize].is_empty()) {
                    return None;
                }
                let longest = LONGEST * self.sizing.at(&self.mesh.middle(edge));
                if !self.collapse_edge(edge, CollapseRule { floor, longest }) {
                    return None;
                }
                edge.into_iter().find(|&v| !self.mesh.star[v as usize].is_empty())?
            }
        };
        self.smooth_around(v);
        Some(self.mesh.count() as i64 - before)
    }

    /// Does the best one or two steps found that bring the count by `missing` to the goal, or the
    /// best that leads nearer.
    fn step_towards(&mut self, missing: i64, off: f64) -> bool {
        let quality =
            |plan: &Vec<Tried>| plan.iter().map(|t| t.quality).fold(f64::INFINITY, f64::min);
        let mut best: Option<Vec<Tried>> = None;
        for candidates in [CANDIDATES, MORE_CANDIDATES] {
            if candidates > CANDIDATES && missing.abs() > NEAR {
                break;
            }
            let options = self.options(candidates, off);
            let alternatives = plans(&options, missing);
            best = alternatives
                .into_iter()
                .reduce(|a, b| if quality(&b) > quality(&a) { b } else { a });
            if best.as_ref().is_some_and(|best| quality(best) >= FAIR) {
                break;
            }
        }
        let Some(best) = best else { return false };
        for tried in best {
            self.mesh.begin();
            if self.take(tried.step, MIN_QUALITY).is_some() {
                self.mesh.commit()
            } else {
                self.mesh.rollback()
            }
        }
        true
    }

    /// The best steps for each change of the count, among so many of the shortest and of the
    /// longest edges, that leave no face further than `off` (mm) from its surface.
    fn options(&mut self, candidates: usize, off: f64) -> BTreeMap<i64, Vec<Tried>> {
        let edges = self.edges_by_length();
        let short = edges.iter().take(candidates).map(|e| Step::Collapse(e.1));
        let long = edges.iter().rev().take(candidates).map(|e| Step::Split(e.1));
        let mut options: BTreeMap<i64, Vec<Tried>> = BTreeMap::new();
        for step in short.chain(long) {
            self.mesh.begin();
            let delta = self.take(step, MIN_QUALITY);
            let (_, quality) = self.mesh.effect();
            let good = quality > 0.0 && self.stays_near(off);
            self.mesh.rollback();
            if let Some(delta) = delta.filter(|_| good) {
                options.entry(delta).or_default().push(Tried { step, quality });
            }
        }
        for tried in options.values_mut() {
            tried.sort_by(|a, b| b.quality.total_cmp(&a.quality));
            tried.truncate(KEPT);
        }
        options
    }

    /// Whether what the running transaction changed has no face further than `off` (mm) from its
    /// surface.
    pub(crate) fn stays_near(&self, off: f64) -> bool {
        off.is_infinite() || self.mesh.changed().all(|id| self.off(id) <= off)
    }

    /// Betters the tetrahedra worse than `threshold` without change of the count until the worst
    /// gains no more, at most `rounds` times.
    pub(crate) fn polish(
        &mut self,
        threshold: f64,
        rounds: usize,
        progress: Progress<'_>,
    ) -> Result<(), Stopped> {
        let (mut worst, mut idle) = (self.mesh.worst(), 0);
        for round in 0..rounds {
            progress.at(round as f64 / rounds as f64)?;
            let repaired = self.repair(threshold, &NONE);
            let smoothed = self.smooth_all(threshold + 0.03, 3);
            let now = self.mesh.worst();
            idle = if now > worst + IDLE { 0 } else { idle + 1 };
            worst = now;
            if repaired + smoothed == 0 || idle == 2 {
                break;
            }
        }
        Ok(())
    }

    /// Betters the worst tetrahedra by operations that change the count, and restores the count
    /// elsewhere; kept when the worst of all got better and no face lies far off. At most `rounds`
    /// times, until all are better than `threshold`.
    pub(crate) fn trade(
        &mut self,
        goal: usize,
        threshold: f64,
        rounds: usize,
        progress: Progress<'_>,
    ) -> Result<(), Stopped> {
        let mut reach = NARROW;
        for round in 0..rounds {
            let part = progress.part(round as f64 / rounds as f64, 1.0);
            let worst = self.mesh.worst();
            if worst >= threshold {
                break;
            }
            let off = self.furthest().max(OFF * self.sizing.base);
            let saved = self.mesh.clone();
            self.rework((worst + reach).min(threshold), off, part.part(0.0, 0.2))?;
            let reached = self.reach(goal, off, part.part(0.2, 0.4))?;
            self.polish((worst + NEARLY_WORST).min(threshold), 3, part.part(0.4, 0.6))?;
            if reached && self.mesh.worst() > worst + 1e-4 && self.furthest() <= off {
                reach = NARROW;
                continue;
            }
            self.mesh = saved;
            // More of the bad ones may help, if there are more that can be taken on.
            let taken = self.bad((worst + reach).min(threshold)).len();
            reach *= 3.0;
            let more = self.bad((worst + reach).min(threshold)).len();
            if reach > WIDE || taken >= MAX_REWORKED || more == taken {
                break;
            }
        }
        Ok(())
    }
}

/// The ways to change the count by `missing` in one or two steps, or else in one to come nearer.
fn plans(options: &BTreeMap<i64, Vec<Tried>>, missing: i64) -> Vec<Vec<Tried>> {
    let mut plans: Vec<Vec<Tried>> = Vec::new();
    for (&delta, tried) in options {
        if delta == missing {
            plans.push(vec![tried[0]]);
        }
        let others = options.get(&(missing - delta)).map_or(&[][..], |others| &others[..]);
        for &first in tried {
            let second = others.iter().find(|o| !shares(o.step, first.step));
            plans.extend(second.map(|&second| vec![first, second]));
        }
    }
    if plans.is_empty() {
        let nearer = options.iter().filter(|(d, _)| (missing - **d).abs() < missing.abs());
        plans.extend(nearer.map(|(_, tried)| vec![tried[0]]));
    }
    plans
}

fn shares(a: Step, b: Step) -> bool {
    let ends = |s: Step| match s {
        Step::Collapse(e) | Step::Split(e) => e,
    };
    ends(a).iter().any(|v| ends(b).contains(v))
}

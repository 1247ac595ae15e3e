//! From the cut lattice to a mesh of the wanted sizes: coarsening, then rounds of split, collapse,
//! swap and smooth.

use crate::collapse::CollapseRule;
use crate::complex::EDGES;
use crate::mesher::Mesher;
use crate::shape::det;
use std::ops::RangeInclusive;
use supine_space::{Progress, Stopped, Vector};

/// Coarsening proceeds in steps of this factor in edge length.
const COARSENING: f64 = 1.4;
/// Edges shorter than this share of the wanted length are collapsed while coarsening, ...
const SHORT_COARSE: f64 = 0.75;
/// ... and in the rounds.
const SHORT: f64 = 0.72;
/// Edges longer than this multiple of the wanted length are split.
const LONG: f64 = 1.4;
/// A collapse makes no edge longer than this multiple of the wanted length.
const LONGEST: f64 = 1.5;
/// Tetrahedra better than this are left alone.
const GOOD: f64 = 0.62;
/// Most tetrahedra that one rework takes on.
pub(crate) const MAX_REWORKED: usize = 6;
/// A swap may first make this much worse what smoothing then betters.
const LENIENCE: f64 = 0.25;
/// An operation must better the worst tetrahedron by this much.
const GAIN: f64 = 2e-3;
/// An operation may first leave tetrahedra as bad as this.
const FLAT: f64 = 1e-3;
/// After an operation, tetrahedra worse than this are swapped.
const UNTIDY: f64 = 0.45;
/// Splits of long edges leave tetrahedra of at least this quality in the first round, ...
const FLOOR: f64 = 0.1;
/// ... this much better ones in each further round, so that sizes that cannot be had do not break
/// again and again what was bettered, ...
const FLOOR_RISE: f64 = 0.06;
/// ... up to this.
const HIGHEST_FLOOR: f64 = 0.4;
/// Collapses of short edges leave tetrahedra this much better than splits of long ones.
const COLLAPSE_FLOOR: f64 = 0.1;
/// The base length has settled when the cube root of the count is within this share of the goal's.
const SETTLED: f64 = 0.02;
/// Rounds after which the base length follows the count more boldly.
const PATIENT: usize = 4;
/// Rounds after which the count has to be reached otherwise.
const MAX_ROUNDS: usize = 12;
/// A mesh after few rounds has about so many tetrahedra in the cube of the wanted edge length.
const PER_CUBE: f64 = 12.0;
/// Tetrahedra that are looked at to tell what number the sizes come to, and how often.
const SAMPLED: usize = 4000;
const AIMINGS: usize = 4;
/// Any change of the count.
pub(crate) const ANY: RangeInclusive<i64> = -99..=99;

/// What an operation must respect to be kept.
struct Keep {
    /// Change of the count.
    delta: RangeInclusive<i64>,
    /// Faces lie no further from their surface, mm.
    off: f64,
}

impl Mesher<'_> {
    /// Puts the boundary vertices onto their surfaces, as far as the tetrahedra bear it.
    pub(crate) fn settle(&mut self) {
        for v in 0..self.mesh.points.len() as u32 {
            if self.mesh.class[v as usize] == 0 || self.mesh.star[v as usize].is_empty() {
                continue;
            }
            if let Some(to) = self.project(v, self.mesh.points[v as usize]) {
                self.draw(v, to);
            }
        }
    }

    /// Moves a vertex towards `to` as far as the tetrahedra bear it.
    pub(crate) fn draw(&mut self, v: u32, to: Vector) {
        let from = self.mesh.points[v as usize];
        let before = self.mesh.worst_of(&self.mesh.star[v as usize]);
        let bearable = (0.5 * before).min(0.05);
        let taken = [1.0, 0.5, 0.25].into_iter().any(|share| {
            self.mesh.move_vertex(v, from + (to - from) * share);
            self.mesh.worst_of(&self.mesh.star[v as usize]) > bearable
        });
        if !taken {
            self.mesh.move_vertex(v, from);
        }
    }

    /// Coarsens from edges of about `from` mm to the wanted ones.
    pub(crate) fn coarsen(&mut self, from: f64, progress: Progress<'_>) -> Result<(), Stopped> {
        let goal = self.sizing.base;
        let steps = ((goal / from).ln() / COARSENING.ln()).ceil().max(1.0) as usize;
        for step in 1..=steps {
            self.sizing.base = from * (goal / from).powf(step as f64 / steps as f64);
            for half in 0..2 {
                progress.at((step as f64 - 1.0 + 0.5 * f64::from(half)) / steps as f64)?;
                let collapses = self.collapse_short(SHORT_COARSE, 0.12);
                self.swap_all(0.3, &ANY);
                if collapses == 0 {
                    break;
                }
            }
            self.smooth_all(0.25, 2);
            self.mesh = self.mesh.compact();
        }
        self.sizing.base = goal;
        Ok(())
    }

    /// Collapses edges shorter than `short` of the wanted length, shortest first.
    fn collapse_short(&mut self, short: f64, floor: f64) -> usize {
        let edges = self.edges_by_length();
        let mut collapses = 0;
        for (_, edge) in edges.into_iter().take_while(|e| e.0 < short) {
            if edge.iter().any(|&v| self.mesh.star[v as usize].is_empty()) {
                continue;
            }
            let size = self.sizing.at(&self.mesh.middle(edge));
            if self.mesh.length(edge) > short * size {
                continue;
            }
            let rule = CollapseRule { floor, longest: LONGEST * size };
            collapses += usize::from(self.collapse_edge(edge, rule));
        }
        collapses
    }

    /// Collapses an edge to its middle when both ends are alike, or else to one of its ends.
    pub(crate) fn collapse_edge(&mut self, [a, b]: [u32; 2], rule: CollapseRule) -> bool {
        let class = |v: u32| self.mesh.class[v as usize];
        let (a, b) = if class(a).count_ones() > class(b).count_ones() { (b, a) } else { (a, b) };
        let alike = class(a) == class(b);
        if alike
            && let Some(middle) = self.project(b, self.mesh.middle([a, b]))
            && self.collapse(a, b, middle, rule)
        {
            return true;
        }
        let (pa, pb) = (self.mesh.points[a as usize], self.mesh.points[b as usize]);
        self.collapse(a, b, pb, rule) || (alike && self.collapse(b, a, pa, rule))
    }

    /// Splits edges longer than `long` times the wanted length, longest first.
    fn split_long(&mut self, long: f64, floor: f64) -> usize {
        let edges = self.edges_by_length();
        let mut splits = 0;
        for (_, [a, b]) in edges.into_iter().rev().take_while(|e| e.0 > long) {
            splits += usize::from(self.split(a, b, floor).is_some());
        }
        splits
    }

    /// Sets the base length with which the wanted sizes come to `count` tetrahedra.
    pub(crate) fn aim(&mut self, count: usize) {
        for _ in 0..AIMINGS {
            self.sizing.base *= (self.expected() / count as f64).cbrt();
        }
    }

    /// Number of tetrahedra that the wanted sizes come to, told from some of the mesh.
    fn expected(&self) -> f64 {
        let mesh = &self.mesh;
        let (mut sum, mut volume) = (0.0, 0.0);
        let sparse = (mesh.count() / SAMPLED).max(1);
        let det_of = |id: u32| det(&mesh.corners(mesh.tets[id as usize]));
        for id in mesh.ids().step_by(sparse) {
            let middle = mesh.corners(mesh.tets[id as usize]).iter().sum::<Vector>() / 4.0;
            sum += det_of(id) / self.sizing.at(&middle).powi(3);
            volume += det_of(id);
        }
        PER_CUBE / 6.0 * sum / volume * mesh.ids().map(det_of).sum::<f64>()
    }

    /// At least `rounds` rounds of split, collapse, swap and smooth, with the base length led to
    /// `count`; more where thin parts make the length slow to settle.
    pub(crate) fn rounds(
        &mut self,
        rounds: usize,
        count: usize,
        progress: Progress<'_>,
    ) -> Result<(), Stopped> {
        for round in 0..MAX_ROUNDS.max(rounds) {
            let at = |part: f64| (round as f64 + part) / MAX_ROUNDS.max(rounds) as f64;
            progress.at(at(0.0))?;
            self.unfold_rims();
            let floor = (FLOOR + FLOOR_RISE * round as f64).min(HIGHEST_FLOOR);
            self.split_long(LONG, floor);
            self.collapse_short(SHORT, floor + COLLAPSE_FLOOR);
            self.swap_all(GOOD, &ANY);
            progress.at(at(0.4))?;
            self.smooth_all(GOOD, 3);
            self.swap_all(GOOD, &ANY);
            progress.at(at(0.7))?;
            self.smooth_all(GOOD, 2);
            if round % 2 == 1 {
                self.repair(0.5, &ANY);
            }
            let excess = (self.mesh.count() as f64 / count as f64).cbrt();
            let hurry = if round < PATIENT { 1.0 } else { 2.0 };
            self.sizing.base *= excess.powf(hurry).clamp(0.9, 1.1);
            self.mesh = self.mesh.compact();
            if round + 1 >= rounds && (excess - 1.0).abs() < SETTLED {
                break;
            }
        }
        Ok(())
    }

    /// Tries every operation on each tetrahedron worse than `threshold`, worst first, keeping
    /// what betters the worst tetrahedron concerned and changes the count by a number in
    /// `delta`. Returns how many were bettered.
    pub(crate) fn repair(&mut self, threshold: f64, delta: &RangeInclusive<i64>) -> usize {
        let rule = Keep { delta: delta.clone(), off: f64::INFINITY };
        let mut repaired = 0;
        for id in self.bad(threshold) {
            let n = id as usize;
            if !self.mesh.live[n] || self.mesh.quality[n] >= threshold {
                continue;
            }
            let (tet, before) = (self.mesh.tets[n], self.mesh.quality[n]);
            for v in tet {
                self.smooth(v, 4);
            }
            let better = self.mesh.quality[n] > before + 0.02
                || self.swap_at(id, delta)
                || (delta.contains(&-1) && self.collapse_at(tet, &rule))
                || (delta.contains(&1) && self.split_at(tet, &rule));
            repaired += usize::from(better);
        }
        repaired
    }

    /// A collapse at a tetrahedron that betters the worst one concerned.
    fn collapse_at(&mut self, tet: [u32; 4], rule: &Keep) -> bool {
        EDGES.iter().any(|&[p, q]| self.attempt_collapse([tet[p], tet[q]], rule))
    }

    fn attempt_collapse(&mut self, edge: [u32; 2], rule: &Keep) -> bool {
        let longest = 1.7 * self.sizing.at(&self.mesh.middle(edge));
        self.attempt(rule, |m| {
            let done = m.collapse_edge(edge, CollapseRule { floor: 0.05, longest });
            let kept = edge.into_iter().find(|&v| !m.mesh.star[v as usize].is_empty());
            if let Some(v) = kept.filter(|_| done) {
                m.tidy(v);
            }
            done
        })
    }

    /// Smooths around a vertex, swaps what is still bad there and smooths again.
    fn tidy(&mut self, v: u32) {
        self.smooth_around(v);
        let mut swapped = false;
        for id in self.mesh.star[v as usize].clone() {
            let n = id as usize;
            let bad = self.mesh.live[n] && self.mesh.quality[n] < UNTIDY;
            swapped |= bad && self.swap_at(id, &ANY);
        }
        if swapped {
            self.smooth_around(v);
        }
    }

    /// A split at a tetrahedron that, smoothed, betters the worst one concerned.
    fn split_at(&mut self, tet: [u32; 4], rule: &Keep) -> bool {
        let mut edges = EDGES.map(|[p, q]| [tet[p], tet[q]]);
        edges.sort_by(|a, b| self.mesh.length(*b).total_cmp(&self.mesh.length(*a)));
        edges.into_iter().take(4).any(|edge| self.attempt_split(edge, rule))
    }

    fn attempt_split(&mut self, [a, b]: [u32; 2], rule: &Keep) -> bool {
        self.attempt(rule, |m| {
            let new = m.split(a, b, FLAT);
            if let Some(v) = new {
                m.tidy(v);
            }
            new.is_some()
        })
    }

    /// Tries every operation on every edge that meets a tetrahedron worse than `threshold`, worst
    /// first, with smoothing, keeping what betters the worst tetrahedron concerned and leaves no
    /// face further than `off` (mm) from its surface.
    pub(crate) fn rework(
        &mut self,
        threshold: f64,
        off: f64,
        progress: Progress<'_>,
    ) -> Result<(), Stopped> {
        let bad = self.bad(threshold);
        for (n, &id) in bad.iter().enumerate().take(MAX_REWORKED) {
            progress.at(n as f64 / bad.len() as f64)?;
            if self.mesh.live[id as usize] && self.mesh.quality[id as usize] < threshold {
                self.rework_one(self.mesh.tets[id as usize], off);
            }
        }
        Ok(())
    }

    fn rework_one(&mut self, tet: [u32; 4], off: f64) -> bool {
        let rule = Keep { delta: ANY, off };
        if self.collapse_at(tet, &rule) || self.split_at(tet, &rule) {
            return true;
        }
        let edges = self.edges_around(tet);
        for &[a, b] in &edges {
            let done = self.attempt(&rule, |m| {
                let around: Vec<u32> =
                    m.mesh.ring(a, b).iter().flat_map(|&t| m.mesh.tets[t as usize]).collect();
                m.remove_edge(a, b, -LENIENCE, &ANY) && {
                    around.into_iter().for_each(|v| {
                        m.smooth(v, 3);
                    });
                    true
                }
            });
            if done {
                return true;
            }
        }
        edges
            .iter()
            .any(|&edge| self.attempt_collapse(edge, &rule) || self.attempt_split(edge, &rule))
    }

    /// The edges that meet a vertex of the tetrahedron.
    fn edges_around(&self, tet: [u32; 4]) -> Vec<[u32; 2]> {
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for v in tet {
            edges.extend(self.mesh.neighbours(v).into_iter().map(|w| [v.min(w), v.max(w)]));
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Keeps an operation only when it betters the worst tetrahedron that it concerns and the rule
    /// allows it.
    fn attempt(&mut self, rule: &Keep, operation: impl FnOnce(&mut Self) -> bool) -> bool {
        let count = self.mesh.count() as i64;
        self.mesh.begin();
        let done = operation(self);
        let (before, after) = self.mesh.effect();
        let change = self.mesh.count() as i64 - count;
        let keep = done
            && after > before + GAIN
            && rule.delta.contains(&change)
            && self.stays_near(rule.off);
        if keep {
            self.mesh.commit()
        } else {
            self.mesh.rollback()
        }
        keep
    }
}

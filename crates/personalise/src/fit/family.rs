//! The carried skin over the modulus.
//!
//! With x = 1/E the product w(x) = E u is nearly constant: exactly so for small displacements.
//! Through values and slopes of w at the moduli that were solved goes a cubic in x between each
//! two; dw/dx = −E² (u + E du/dE).

use super::carried::Carried;
use rayon::prelude::*;
use supine_mesh::Displacement;
use supine_register::{Prior, Shape};
use supine_space::{Point, Vector};

/// How upright a patient sits, one standard deviation, degrees: chosen.
pub const UPRIGHT_DEG: f64 = 4.0;
const TURN: Prior = Prior { mean: 0.0, deviation: UPRIGHT_DEG, range: [-25.0, 25.0], step: 5.0 };
/// The deviation of those who do not sit upright, degrees: chosen.
const LEANING_DEG: f64 = 12.0;
/// The logarithm of the modulus changes by at most so much in one iteration.
const STEP: f64 = 0.25;

/// The skin at all moduli between the softest and the stiffest that were solved. Its parameters are
/// ln E, E in kPa, and where that was solved too how far gravity turned from where it was said to
/// pull, degrees, and further ones, each linear about where it was solved.
#[derive(Debug)]
pub(crate) struct Family<'a> {
    carried: &'a Carried,
    /// From soft to stiff.
    nodes: Vec<Node>,
    priors: Vec<Prior>,
    /// Parameters after the turn.
    further: Vec<Further>,
}

/// A parameter on which the skin depends linearly.
#[derive(Debug)]
struct Further {
    /// Where it was solved.
    about: f64,
    /// E times the change of u with it, kPa mm.
    slope: Vec<Vector>,
}

/// The carried points at one modulus.
#[derive(Debug)]
struct Node {
    /// 1/E, per kPa.
    x: f64,
    /// E u, kPa mm.
    w: Vec<Vector>,
    /// dw/dx, kPa² mm.
    slope: Vec<Vector>,
    /// E times the change of u with the turn, kPa mm per degree; empty where it was not solved.
    turn: Vec<Vector>,
}

impl<'a> Family<'a> {
    pub(crate) fn new(carried: &'a Carried) -> Self {
        let prior = Prior { mean: 0.0, deviation: f64::INFINITY, range: [0.0; 2], step: STEP };
        Self { carried, nodes: Vec::new(), priors: vec![prior], further: Vec::new() }
    }

    /// Adds what was solved at a modulus: displacement, mm, and its derivative by the modulus,
    /// mm/kPa.
    pub(crate) fn add(
        &mut self,
        kpa: f64,
        displacement: &Displacement,
        by_kpa: &Displacement,
        turned: Option<(&Displacement, f64)>,
    ) {
        let (u, du) = (self.carried.carry(displacement), self.carried.carry(by_kpa));
        let slope: Vec<Vector> =
            u.iter().zip(du).map(|(u, du)| (u + du * kpa) * (-kpa * kpa)).collect();
        let by_degree = |(there, degrees): (&Displacement, f64)| -> Vec<Vector> {
            let there = self.carried.carry(there);
            u.iter().zip(there).map(|(u, v)| (v - u) * (kpa / degrees)).collect()
        };
        let turn = turned.map_or_else(Vec::new, by_degree);
        if !turn.is_empty() && self.priors.len() == 1 {
            self.priors.push(TURN);
        }
        let node = Node { x: 1.0 / kpa, w: u.iter().map(|u| u * kpa).collect(), slope, turn };
        let place = self.nodes.partition_point(|other| other.x > node.x);
        self.nodes.insert(place, node);
        let ends = [&self.nodes[0], &self.nodes[self.nodes.len() - 1]];
        self.priors[0].range = ends.map(|node| -node.x.ln());
    }

    /// Adds a further parameter: the displacement, mm, at the first modulus that was solved, a step
    /// from where all others were.
    pub(crate) fn add_further(
        &mut self,
        prior: Prior,
        about: f64,
        there: &Displacement,
        step: f64,
    ) {
        let node = &self.nodes[0];
        let there = self.carried.carry(there);
        let pairs = node.w.iter().zip(there);
        let slope = pairs.map(|(w, there)| (there / node.x - w) / step).collect();
        self.priors.push(prior);
        self.further.push(Further { about, slope });
    }

    /// Lets the modulus go beyond those that were solved by a share.
    pub(crate) fn widen(&mut self, share: f64) {
        let [low, high] = self.priors[0].range;
        self.priors[0].range = [low - share, high + share];
    }

    /// Whether these values are of a patient who does not sit upright, by what was taken for
    /// likely. If so that is not taken for likely any more.
    pub(crate) fn leans(&mut self, values: &[f64]) -> bool {
        match (self.priors.get_mut(1), values.get(1)) {
            (Some(turn), Some(degrees)) if degrees.abs() > turn.deviation => {
                turn.deviation = LEANING_DEG.max(turn.deviation);
                true
            }
            _ => false,
        }
    }

    /// w and dw/dx of each carried point.
    fn at(&self, x: f64) -> Vec<(Vector, Vector)> {
        let after = self.nodes.partition_point(|node| node.x > x);
        let (a, b) = match (after.checked_sub(1).map(|n| &self.nodes[n]), self.nodes.get(after)) {
            (Some(a), Some(b)) => (a, b),
            (Some(node), None) | (None, Some(node)) => {
                let pairs = node.w.iter().zip(&node.slope);
                return pairs.map(|(w, s)| (w + s * (x - node.x), *s)).collect();
            }
            (None, None) => return Vec::new(),
        };
        let way = b.x - a.x;
        let (t, s) = ((x - a.x) / way, (b.x - x) / way);
        let of = |n: usize| {
            let (p, q) = (a.w[n], b.w[n]);
            let (m, k) = (a.slope[n] * way, b.slope[n] * way);
            let value =
                (p * (1.0 + 2.0 * t) + m * t) * (s * s) + (q * (3.0 - 2.0 * t) - k * s) * (t * t);
            let slope =
                (q - p) * (6.0 * t * s) + m * (s * (1.0 - 3.0 * t)) + k * (t * (3.0 * t - 2.0));
            (value, slope / way)
        };
        (0..a.w.len()).into_par_iter().map(of).collect()
    }
}

impl Family<'_> {
    /// E times the change of u with the turn at each carried point, linear in x between two moduli.
    fn turn(&self, x: f64) -> Vec<Vector> {
        let after = self.nodes.partition_point(|node| node.x > x);
        let last = self.nodes.len() - 1;
        let [a, b] = [after.saturating_sub(1).min(last), after.min(last)].map(|n| &self.nodes[n]);
        if a.x == b.x {
            return a.turn.clone();
        }
        let t = ((x - a.x) / (b.x - a.x)).clamp(0.0, 1.0);
        a.turn.iter().zip(&b.turn).map(|(a, b)| a * (1.0 - t) + b * t).collect()
    }
}

impl Shape for Family<'_> {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.carried.triangles
    }

    fn weights(&self) -> &[f64] {
        &self.carried.weights
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn points(&self, values: &[f64]) -> Vec<Point> {
        let x = (-values[0]).exp();
        let mut u: Vec<Vector> = self.at(x).into_iter().map(|(w, _)| w * x).collect();
        if let Some(degrees) = values.get(1) {
            u.iter_mut().zip(self.turn(x)).for_each(|(u, turn)| *u += turn * (x * degrees));
        }
        for (further, value) in self.further.iter().zip(values.iter().skip(2)) {
            let by = x * (value - further.about);
            u.iter_mut().zip(&further.slope).for_each(|(u, slope)| *u += slope * by);
        }
        self.carried.displaced(&u)
    }

    fn slopes(&self, values: &[f64]) -> Vec<Vec<Vector>> {
        let x = (-values[0]).exp();
        let mut by_ln: Vec<Vector> =
            self.at(x).into_iter().map(|(w, slope)| (w + slope * x) * -x).collect();
        let Some(degrees) = values.get(1) else { return vec![self.carried.spread(&by_ln)] };
        let turn: Vec<Vector> = self.turn(x).into_iter().map(|turn| turn * x).collect();
        by_ln.iter_mut().zip(&turn).for_each(|(slope, turn)| *slope -= turn * *degrees);
        let mut slopes = vec![turn];
        for (further, value) in self.further.iter().zip(values.iter().skip(2)) {
            let slope: Vec<Vector> = further.slope.iter().map(|slope| slope * x).collect();
            let by = value - further.about;
            by_ln.iter_mut().zip(&slope).for_each(|(of, slope)| *of -= slope * by);
            slopes.push(slope);
        }
        std::iter::once(by_ln).chain(slopes).map(|slope| self.carried.spread(&slope)).collect()
    }
}

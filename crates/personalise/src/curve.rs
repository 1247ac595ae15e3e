//! The displacement of the tumour over the modulus.
//!
//! With x = 1/E the product w(x) = E u is nearly constant: exactly so for small displacements.
//! Through values and slopes of w at the moduli that were solved goes a cubic in x between each
//! two; dw/dx = −E² (u + E du/dE). On the stiff side w goes on along its slope.

use crate::Error;
use supine_fem::{Body, Load, Params, RestState, sensitivity, unload};
use supine_mesh::{Edges, Located, Locator};
use supine_space::{Point, Progress, Vector, Warning};

/// Iterations after which a soft modulus is given up: usable solutions are found in ten or less.
const PATIENCE: usize = 20;
/// The softest modulus that has an unloaded shape, and that which has a solution on the table, are
/// found to this ratio: where the tissue gives way, the displacement grows by as much within a
/// hundredth as by a degree of tilt.
const FINE: f64 = 1.01;
/// A solution whose product of modulus and displacement is so many times that of the stiff end has
/// snapped to another position: on breasts it grows by half at most.
const SNAPPED: f64 = 3.0;
/// Solutions that are put between two whose slopes lead elsewhere.
const BETWEEN: usize = 5;

/// What is asked.
#[derive(Clone, Copy)]
pub(crate) struct Solver<'a> {
    pub(crate) body: &'a Body,
    pub(crate) load: &'a Load,
    pub(crate) params: &'a Params,
    pub(crate) place: &'a Point,
}

/// The displacement of a place over the modulus in one rest state.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// From soft to stiff.
    nodes: Vec<Node>,
    /// Whether no modulus softer than the first can be solved.
    ends: bool,
    /// The softest modulus that is possible in this state, kPa: zero when every modulus is.
    pub(crate) possible_from_kpa: f64,
    pub(crate) warnings: Vec<Warning>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// 1/E, per kPa.
    x: f64,
    /// E u, kPa mm.
    w: Vector,
    /// dw/dx, kPa² mm.
    slope: Vector,
}

impl Curve {
    /// Through the solutions at both ends of a range of moduli, kPa. Where the softer end has none,
    /// through those on the way to the softest modulus that has one; `None` when the stiffer end
    /// has none either.
    ///
    /// # Errors
    /// When the user asks to stop.
    pub(crate) fn through(
        solver: Solver<'_>,
        rest: RestState,
        [soft, stiff]: [f64; 2],
        progress: Progress<'_>,
    ) -> Result<Option<Self>, Error> {
        let mut rough_kpa = None;
        let mut steps = Steps(progress);
        let mut solve = |kpa: f64| -> Result<Option<Node>, Error> {
            let Some((node, told)) = found(solver.at(rest, kpa, steps.next()))? else {
                return Ok(None);
            };
            // What is told of a solution here is not told of the result: it has its own.
            if told.iter().any(|warning| warning.code() == "folded-elements") {
                rough_kpa = Some(rough_kpa.map_or(kpa, |other: f64| other.min(kpa)));
            }
            Ok(Some(node))
        };
        let Some(last) = solve(stiff)? else { return Ok(None) };
        let mut solve = |kpa: f64| -> Result<Option<Node>, Error> {
            Ok(solve(kpa)?.filter(|node| node.w.norm() <= SNAPPED * last.w.norm()))
        };
        let mut nodes = vec![last];
        let ends_at = softest([soft, stiff], |kpa| {
            let node = solve(kpa)?;
            nodes.extend(node);
            Ok(node.is_some())
        })?;
        nodes.sort_by(|a, b| b.x.total_cmp(&a.x));
        for _ in 0..BETWEEN {
            let Some(after) = nodes.windows(2).position(|pair| is_bent(&pair[0], &pair[1])) else {
                break;
            };
            let middle = (nodes[after].x * nodes[after + 1].x).sqrt();
            let Some(node) = solve(1.0 / middle)? else { break };
            nodes.insert(after + 1, node);
        }
        let rough = rough_kpa.map(|kpa| {
            let text = format!(
                "with {kpa:.2} kPa, which the interval holds in the rest state `{}`, tetrahedra of its coarse mesh fold over: that end of \
                 the interval is rough; the result is of another mesh and modulus",
                rest.name()
            );
            Warning::new("interval-rough", text)
        });
        let warnings = rough.into_iter().collect();
        Ok(Some(Self { nodes, ends: ends_at > soft, possible_from_kpa: 0.0, warnings }))
    }

    /// The same in the unloaded state, where a modulus is possible only from `floor_kpa` on and if
    /// it has an unloaded shape. Which have one is a question of the CT's gravity alone, so that no
    /// tilt makes a modulus impossible.
    ///
    /// # Errors
    /// As [`Curve::through`].
    pub(crate) fn of_unloaded(
        solver: Solver<'_>,
        [low, stiff]: [f64; 2],
        floor_kpa: f64,
        progress: Progress<'_>,
    ) -> Result<Option<Self>, Error> {
        let soft = low.max(floor_kpa).min(stiff);
        let part = progress.part(0.0, 0.7);
        let curve = Self::through(solver, RestState::Unloaded, [soft, stiff], part)?;
        let Some(curve) = curve else { return Ok(None) };
        let mut steps = Steps(progress.part(0.7, 1.0));
        // What was solved has a shape.
        let from = match curve.ends {
            true => softest([soft, stiff], |kpa| solver.has_shape(kpa, steps.next()))?,
            false => soft,
        };
        let possible_from_kpa = if from > low { from } else { 0.0 };
        Ok(Some(Self { possible_from_kpa, ..curve }))
    }

    /// The softest modulus that is possible, or that was solved when all are, kPa.
    pub(crate) fn softest_kpa(&self) -> f64 {
        let solved = self.nodes.first().map_or(f64::INFINITY, |node| 1.0 / node.x);
        if self.possible_from_kpa > 0.0 { self.possible_from_kpa } else { solved }
    }

    /// The displacement at a modulus, mm. Where none softer than the first can be solved, the
    /// displacement turns without measure near that one, and its slope leads nowhere: softer ones
    /// move farther in proportion to 1/E.
    pub(crate) fn at(&self, kpa: f64) -> Vector {
        let x = 1.0 / kpa;
        if let Some(softest) = self.nodes.first().filter(|node| self.ends && x > node.x) {
            return softest.w * x;
        }
        let after = self.nodes.iter().position(|node| node.x < x).unwrap_or(self.nodes.len());
        let w = match (after.checked_sub(1).map(|n| &self.nodes[n]), self.nodes.get(after)) {
            (Some(a), Some(b)) => between(a, b, x),
            (Some(node), None) | (None, Some(node)) => node.w + node.slope * (x - node.x),
            (None, None) => Vector::zeros(),
        };
        w * x
    }
}

/// The progress of solutions whose number is not known: each takes a third of what is left.
struct Steps<'a>(Progress<'a>);

impl<'a> Steps<'a> {
    fn next(&mut self) -> Progress<'a> {
        let part = self.0.part(0.0, 1.0 / 3.0);
        self.0 = self.0.part(1.0 / 3.0, 1.0);
        part
    }
}

/// Whether the slope at one of two solutions leads past the other by more than lies between them:
/// the cubic would swing.
fn is_bent(a: &Node, b: &Node) -> bool {
    let (way, rise) = (b.x - a.x, b.w - a.w);
    let off = |slope: Vector| (slope * way - rise).norm();
    off(a.slope).max(off(b.slope)) > rise.norm() + 0.05 * b.w.norm()
}

/// The softest modulus of a range that can be solved, within [`FINE`]; its stiff end can.
fn softest(
    [soft, stiff]: [f64; 2],
    mut is_solved: impl FnMut(f64) -> Result<bool, Error>,
) -> Result<f64, Error> {
    if soft >= stiff || is_solved(soft)? {
        return Ok(soft.min(stiff));
    }
    let (mut without, mut with) = (soft, stiff);
    while with > FINE * without {
        let middle = (without * with).sqrt();
        *(if is_solved(middle)? { &mut with } else { &mut without }) = middle;
    }
    Ok(with)
}

/// What the mechanics found; `None` when there is no solution.
pub(crate) fn found<T>(result: Result<T, supine_fem::Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(found) => Ok(Some(found)),
        Err(
            supine_fem::Error::NonConvergence { .. }
            | supine_fem::Error::NoUnloadedShape { .. }
            | supine_fem::Error::Singular
            | supine_fem::Error::Flat { .. },
        ) => Ok(None),
        Err(error) => Err(error.into()),
    }
}

/// The cubic through values and slopes at both.
fn between(a: &Node, b: &Node, x: f64) -> Vector {
    let way = b.x - a.x;
    let t = (x - a.x) / way;
    let s = 1.0 - t;
    (a.w * (1.0 + 2.0 * t) + a.slope * (way * t)) * (s * s)
        + (b.w * (3.0 - 2.0 * t) - b.slope * (way * s)) * (t * t)
}

impl Solver<'_> {
    /// Whether a mean modulus has an unloaded shape.
    fn has_shape(&self, kpa: f64, progress: Progress<'_>) -> Result<bool, Error> {
        let body = self.body.with_mean(kpa);
        Ok(found(unload(&body, self.load.ct, self.params, progress))?.is_some())
    }

    /// The place's displacement and its slope at a mean modulus.
    fn at(
        &self,
        rest: RestState,
        kpa: f64,
        progress: Progress<'_>,
    ) -> Result<(Node, Vec<Warning>), supine_fem::Error> {
        let body = self.body.with_mean(kpa);
        let params = Params { rest, max_iterations: PATIENCE, ..*self.params };
        let (deformation, slope, info) = sensitivity(&body, self.load, &params, progress)?;
        let mesh = deformation.mesh();
        let Located { tet, weights, .. } = Locator::new(mesh.clone()).nearest(self.place);
        let edges = Edges::new(mesh);
        let u = deformation.displacement().at(mesh, &edges, tet, weights);
        let by_kpa = slope.at(mesh, &edges, tet, weights);
        let node = Node { x: 1.0 / kpa, w: u * kpa, slope: (u + by_kpa * kpa) * (-kpa * kpa) };
        Ok((node, info.warnings))
    }
}

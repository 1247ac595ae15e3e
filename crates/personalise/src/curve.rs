//! The displacement of the tumour over the modulus.
//!
//! With x = 1/E the product w(x) = E u is nearly constant: exactly so for small displacements. Through values and slopes
//! of w at the moduli that were solved goes a cubic in x between each two; dw/dx = −E² (u + E du/dE). On the stiff side
//! w goes on along its slope.

use crate::Error;
use supine_fem::{Body, Load, Params, RestState, sensitivity};
use supine_mesh::{Edges, Located, Locator};
use supine_space::{Point, Progress, Vector, Warning};

/// Iterations after which a soft modulus is given up: usable unloaded shapes are found in ten or less.
const PATIENCE: usize = 20;
/// A modulus at which there is no usable solution is followed by one so many times larger.
const STIFFER: f64 = 1.4;
/// Attempts before no curve is drawn.
const ATTEMPTS: usize = 4;

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
    /// Through solutions at moduli from soft to stiff, kPa. Where the softest has no usable solution, a stiffer one takes
    /// its place; `None` when none up to the next modulus has.
    ///
    /// # Errors
    /// As [`supine_fem::sensitivity`] at the other moduli, and when the user asks to stop.
    pub(crate) fn through(
        solver: Solver<'_>,
        rest: RestState,
        moduli_kpa: &[f64],
        progress: Progress<'_>,
    ) -> Result<Option<Self>, Error> {
        let (mut nodes, mut warnings) = (Vec::new(), Vec::new());
        let mut solve = |kpa: f64, progress| -> Result<Node, supine_fem::Error> {
            let (node, told) = solver.at(rest, kpa, progress)?;
            // Of a stretched belief not each solution's warnings: what the run's own solution says counts.
            if told.iter().any(|warning| warning.code() == "folded-elements") {
                warnings.extend(told);
            }
            Ok(node)
        };
        let share = |n: usize| {
            let whole = moduli_kpa.len() as f64;
            progress.part(n as f64 / whole, (n + 1) as f64 / whole)
        };
        for (n, kpa) in moduli_kpa.iter().enumerate().skip(1) {
            nodes.push(solve(*kpa, share(n))?);
        }
        let (soft, next) = (moduli_kpa[0], moduli_kpa.get(1).copied().unwrap_or(f64::INFINITY));
        let tries = (0..ATTEMPTS as i32).map(|n| soft * STIFFER.powi(n)).take_while(|e| *e < next);
        for kpa in tries {
            match solve(kpa, share(0)) {
                Ok(node) => {
                    nodes.insert(0, node);
                    break;
                }
                Err(stopped @ supine_fem::Error::Stopped(_)) => return Err(stopped.into()),
                Err(_) => {}
            }
        }
        Ok((!nodes.is_empty()).then_some(Self { nodes, warnings }))
    }

    /// The softest modulus that was solved, kPa.
    pub(crate) fn softest_kpa(&self) -> f64 {
        self.nodes.first().map_or(f64::INFINITY, |node| 1.0 / node.x)
    }

    /// The displacement at a modulus, mm.
    pub(crate) fn at(&self, kpa: f64) -> Vector {
        let x = 1.0 / kpa;
        let after = self.nodes.iter().position(|node| node.x < x).unwrap_or(self.nodes.len());
        let w = match (after.checked_sub(1).map(|n| &self.nodes[n]), self.nodes.get(after)) {
            (Some(a), Some(b)) => between(a, b, x),
            (Some(node), None) | (None, Some(node)) => node.w + node.slope * (x - node.x),
            (None, None) => Vector::zeros(),
        };
        w * x
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

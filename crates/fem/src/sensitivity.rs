//! How the displacement depends on the modulus.
//!
//! All moduli are taken s times; s = 1 is the body as given, and a kPa is one of its mean modulus
//! E. The internal forces are linear in the moduli, so at fixed shapes ∂f/∂s = f(u), springs of a
//! given stiffness at the cut left out.
//!
//! [`crate::RestState::Net`]: the stress-free shape is the CT's. Of K du/ds + f(u) = 0 over the
//! free nodes,
//!
//! E du/dE = −K⁻¹ f(u).
//!
//! [`crate::RestState::Unloaded`]: the stress-free shape X depends on the modulus too. With
//! R(X, x; d) the internal less external forces of a body with stress-free nodes X and present ones
//! x under gravity d, R(X, x_CT; d_CT) = 0 gives X and R(X, x; d) = 0 gives x, so that
//!
//! A E dX/dE = −f(X, x_CT), A = ∂R/∂X at (X, x_CT; d_CT): the derivative of the inverse problem,
//!
//! K E dx/dE = −f(X, x) − B E dX/dE, K = ∂R/∂x and B = ∂R/∂X at (X, x; d).
//!
//! A and B are the same formula on two loaded shapes (`inverse`); the displacement is x − x_CT, so
//! its derivative is dx/dE. Without a change of gravity A = B and it vanishes, as it must.

use crate::element::Elements;
use crate::inverse::{Inverse, Solver};
use crate::model::Model;
use crate::newton::Newton;
use crate::{Body, Error, Info, Job, Load, Params, Solution, SolveOptions, found};
use supine_mesh::{Deformation, Displacement};
use supine_space::{Progress, Vector, Warning};

/// The deformation as by [`crate::solve`], and the derivative of its displacement by the modulus,
/// mm/kPa.
///
/// Poisson's ratio and the weight stay; the moduli of all tetrahedra keep their proportions, and a
/// kPa is one of their mean over the volume. The derivative costs one linear solution more, or two
/// when the CT shape is not the stress-free one.
///
/// # Errors
/// As [`crate::solve`]; [`Error::Singular`] when the solution is not a stable one.
pub fn sensitivity(
    body: &Body,
    load: &Load,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(Deformation, Displacement, Info), Error> {
    let asked = SolveOptions { stiffer: 1.0, slope: true };
    let Solution { deformation, slope, info } = found(body, load, params, asked, progress)?;
    Ok((deformation, slope.ok_or(Error::Singular)?, info))
}

/// The displacement at both ends of an interval of moduli.
#[derive(Clone, Debug, PartialEq)]
pub struct Between {
    /// With the lower modulus, mm.
    pub low: Deformation,
    /// With the higher one, mm.
    pub high: Deformation,
    /// How far the displacement with a modulus between may lie outside what both span, mm: of any
    /// component of any node, by the cubics in 1/E through values and slopes at both ends. Near 0
    /// as long as every component only grows or only falls with the modulus.
    pub overshoot_mm: f64,
    /// What a user should know.
    pub warnings: Vec<Warning>,
}

/// The displacement when the mean modulus lies between `young_kpa`'s two, the proportions kept.
///
/// Both ends are solved for themselves: nothing is taken for linear. At any point the displacement
/// lies between the two fields there, within [`Between::overshoot_mm`].
///
/// # Errors
/// As [`crate::solve`], and [`Error::OutOfRange`] when the two are not in ascending order.
pub fn between(
    body: &Body,
    load: &Load,
    params: &Params,
    young_kpa: [f64; 2],
    progress: Progress<'_>,
) -> Result<Between, Error> {
    body.check()?;
    let [low_kpa, high_kpa] = young_kpa;
    if low_kpa.is_nan() || high_kpa.is_nan() || low_kpa >= high_kpa {
        let name = "the higher end of the modulus interval (kPa)";
        return Err(Error::OutOfRange { name, value: high_kpa, range: "above the lower one" });
    }
    let mean = body.mean_young_kpa();
    let mut warnings = Vec::new();
    let mut end = |kpa: f64, progress| -> Result<(Deformation, Vec<Vector>), Error> {
        let asked = SolveOptions { stiffer: kpa / mean, slope: true };
        let Solution { deformation, slope, info } = found(body, load, params, asked, progress)?;
        warnings.extend(info.warnings.into_iter().map(|w| w.of(format!("at {kpa:.3} kPa: "))));
        // Slopes are per kPa of the mean modulus; by 1/E they are −E² times those.
        let slope = slope.ok_or(Error::Singular)?;
        Ok((deformation, slope.values().iter().map(|s| s * (-kpa * kpa)).collect()))
    };
    let (low, low_slope) = end(low_kpa, progress.part(0.0, 0.5))?;
    let (high, high_slope) = end(high_kpa, progress.part(0.5, 1.0))?;
    let way = 1.0 / high_kpa - 1.0 / low_kpa;
    let slopes = low_slope.iter().zip(&high_slope);
    let [from, to] = [&low, &high].map(|end| end.displacement().values());
    let overshoot_mm = from
        .iter()
        .zip(to)
        .zip(slopes)
        .flat_map(|((a, b), (m, n))| {
            [0, 1, 2].map(|k| overshoot(a[k], b[k], m[k] * way, n[k] * way))
        })
        .fold(0.0, f64::max);
    Ok(Between { low, high, overshoot_mm, warnings })
}

/// How far the cubic from a to b with the slopes m and n there goes beyond the two between 0 and 1.
fn overshoot(a: f64, b: f64, m: f64, n: f64) -> f64 {
    let cubic = |t: f64| {
        let s = 1.0 - t;
        s * s * (a * (1.0 + 2.0 * t) + m * t) + t * t * (b * (3.0 - 2.0 * t) - n * s)
    };
    // Roots of its slope p t² + q t + m.
    let (p, q) = (6.0 * (a - b) + 3.0 * (m + n), 6.0 * (b - a) - 4.0 * m - 2.0 * n);
    let root = (q * q - 4.0 * p * m).max(0.0).sqrt();
    // The stable pair: one by the sum without cancellation, one by their product m / p.
    let larger = -0.5 * (q + root.copysign(q));
    let (low, high) = (a.min(b), a.max(b));
    [larger / p, m / larger]
        .into_iter()
        .filter(|t| (0.0..=1.0).contains(t))
        .map(cubic)
        .map(|v| (v - high).max(low - v).max(0.0))
        .fold(0.0, f64::max)
}

/// du/dE at the equilibrium `u` from the stress-free CT shape: −K⁻¹ f(u) / E, mm/kPa.
pub(crate) fn net<const N: usize, const Q: usize>(
    job: &Job<'_>,
    newton: &mut Newton<'_, N, Q>,
    u: &[Vector],
) -> Result<Vec<Vector>, Error> {
    let forces = newton.model().forces_by_modulus(u).ok_or(Error::Singular)?;
    stable_solution(newton, u, &forces, job.young_kpa())
}

/// −E dX/dE of the stress-free shape that `inverse` found, mm: A⁻¹ f(X, x_CT).
///
/// `model` is the body on it, `to_ct` the displacement from it to the CT shape.
pub(crate) fn of_rest<const N: usize, const Q: usize>(
    inverse: &Inverse<'_, N, Q>,
    solver: &mut Solver,
    model: &Model<N, Q>,
    to_ct: &[Vector],
) -> Result<Vec<Vector>, Error> {
    let to_rest: Vec<Vector> = to_ct.iter().map(|v| -v).collect();
    let at_ct = model.forces_by_modulus(to_ct).ok_or(Error::Singular)?;
    let unknowns = inverse.full.unknowns();
    let slope = inverse.linearised(solver, &to_rest, &at_ct);
    slope.map_err(|_| Error::Memory { unknowns })?.ok_or(Error::Singular)
}

/// dx/dE at the equilibrium `u` from the stress-free shape that `inverse` found, mm/kPa.
///
/// `to_ct` and `u` are displacements from that shape, to the CT shape and to the equilibrium;
/// `rest` is as by [`of_rest`].
pub(crate) fn unloaded<const N: usize, const Q: usize>(
    job: &Job<'_>,
    newton: &mut Newton<'_, N, Q>,
    inverse: &Inverse<'_, N, Q>,
    [to_ct, rest]: [&[Vector]; 2],
    u: &[Vector],
) -> Result<Vec<Vector>, Error> {
    let model = newton.model();
    let unknowns = newton.unknowns();
    let memory = |_| Error::Memory { unknowns };
    let moved: Vec<Vector> =
        inverse.positions.iter().zip(to_ct).zip(u).map(|((x, ct), u)| x - ct + u).collect();
    let shape = Elements::new(&moved, inverse.loaded.nodes.clone()).map_err(Error::flat)?;
    let force = job.load.target * job.body.tissue.weight();
    let from_ct: Vec<Vector> = moved.iter().zip(inverse.positions).map(|(x, ct)| x - ct).collect();
    let fibres = inverse.fibres.map(|fibres| fibres.pushed(inverse.loaded, &from_ct));
    let fibres = fibres.as_ref();
    let there = Inverse { loaded: &shape, positions: &moved, force, fibres, ..*inverse };
    let back: Vec<Vector> = u.iter().map(|u| -u).collect();
    let carried = there.times_derivative(&back, rest).map_err(memory)?.ok_or(Error::Singular)?;
    let forces = model.forces_by_modulus(u).ok_or(Error::Singular)?;
    let right: Vec<Vector> = forces.iter().zip(&carried).map(|(f, c)| f - c).collect();
    stable_solution(newton, u, &right, job.young_kpa())
}

/// −K(u)⁻¹ `right` / E over the free nodes.
fn stable_solution<const N: usize, const Q: usize>(
    newton: &mut Newton<'_, N, Q>,
    u: &[Vector],
    right: &[Vector],
    young_kpa: f64,
) -> Result<Vec<Vector>, Error> {
    let shifted = newton.effort.indefinite;
    let unknowns = newton.unknowns();
    let solutions = newton.linearised(u, [right]).map_err(|_| Error::Memory { unknowns })?;
    let [solution] = solutions.ok_or(Error::Singular)?;
    // A shifted stiffness solves another system.
    if newton.effort.indefinite > shifted {
        return Err(Error::Singular);
    }
    Ok(solution.into_iter().map(|v| v / -young_kpa).collect())
}

#[cfg(test)]
#[path = "sensitivity_tests.rs"]
mod tests;

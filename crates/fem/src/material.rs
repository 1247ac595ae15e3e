//! The compressible neo-Hookean solid: energy, stress, tangent.

use crate::Tissue;
use nalgebra::SymmetricEigen;
use supine_space::{Matrix, Vector};

/// Lamé parameters of the solid, kPa.
///
/// Ψ(F) = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 (ln J)², J = det F. Source: Bonet and Wood, Nonlinear
/// Continuum Mechanics for Finite Element Analysis, 2nd edition 2008, section 6.4.3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NeoHookean {
    /// Shear modulus μ, kPa.
    pub(crate) mu: f64,
    /// λ, kPa.
    pub(crate) lambda: f64,
}

/// The deformation gradient at a point.
#[derive(Clone, Debug)]
pub(crate) struct Gradient {
    /// grad u = F − I; row = displacement, column = reference axis.
    gradient: Matrix,
    /// F^-T.
    pub(crate) inverse_transpose: Matrix,
    /// J = det F.
    pub(crate) j: f64,
    /// ln J.
    pub(crate) ln_j: f64,
}

impl Gradient {
    /// The deformation with displacement gradient grad u.
    ///
    /// `None` unless det F is finite and above 0: the material would be turned inside out. J is
    /// summed from the invariants of grad u, so that ln J is not lost in rounding at small strain.
    pub(crate) fn new(gradient: Matrix) -> Option<Self> {
        let h = &gradient;
        let minors = h[(0, 0)] * h[(1, 1)] - h[(0, 1)] * h[(1, 0)] + h[(1, 1)] * h[(2, 2)]
            - h[(1, 2)] * h[(2, 1)]
            + h[(0, 0)] * h[(2, 2)]
            - h[(0, 2)] * h[(2, 0)];
        let swelling = h.trace() + minors + h.determinant();
        let j = 1.0 + swelling;
        (j > 0.0 && j.is_finite()).then(|| Self {
            inverse_transpose: cofactor(&(gradient + Matrix::identity())) / j,
            gradient,
            j,
            ln_j: swelling.ln_1p(),
        })
    }

    /// F.
    pub(crate) fn f(&self) -> Matrix {
        self.gradient + Matrix::identity()
    }
}

/// Cofactor matrix: J F^-T.
pub(crate) fn cofactor(f: &Matrix) -> Matrix {
    let [a, b, c] = [0, 1, 2].map(|k| f.column(k).into_owned());
    Matrix::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)])
}

impl NeoHookean {
    /// μ = E / 2(1+ν), λ = Eν / ((1+ν)(1−2ν)).
    pub(crate) fn new(tissue: &Tissue) -> Self {
        let (e, nu) = (tissue.young_kpa, tissue.poisson);
        Self { mu: e / (2.0 * (1.0 + nu)), lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)) }
    }

    /// Energy Ψ per stress-free volume, kPa.
    #[cfg(test)]
    pub(crate) fn energy(&self, d: &Gradient) -> f64 {
        // tr FᵀF − 3 by way of grad u, without the cancellation.
        let stretch = 2.0 * d.gradient.trace() + d.gradient.norm_squared();
        self.mu * (0.5 * stretch - d.ln_j) + 0.5 * self.lambda * d.ln_j * d.ln_j
    }

    /// c = λ ln J − μ, kPa: the factor of F^-T in stress and tangent.
    pub(crate) fn c(&self, d: &Gradient) -> f64 {
        self.lambda * d.ln_j - self.mu
    }

    /// First Piola-Kirchhoff stress P = μ F + (λ ln J − μ) F^-T, kPa.
    ///
    /// Row = current axis, column = stress-free axis.
    pub(crate) fn stress(&self, d: &Gradient) -> Matrix {
        d.f() * self.mu + d.inverse_transpose * self.c(d)
    }

    /// What must be added to the tangent to shift its eigenvalues to at least `floor` (kPa):
    /// weights (kPa, 0 or above) and unit directions M of dF, to be added as Σ weight M (M : dF).
    ///
    /// With F = U S Vᵀ the tangent couples, in the frame of U and V, only the diagonal of dF and
    /// each pair of its mirrored entries: one 3 × 3 and three 2 × 2 eigenproblems instead of a
    /// 9 × 9 one. Compare Smith, de Goes and Kim, Analytic eigensystems for isotropic distortion
    /// energies, ACM Trans. Graph. 38, 2019, section 4.
    pub(crate) fn shift(&self, d: &Gradient, floor: f64) -> Vec<(f64, Matrix)> {
        let svd = d.f().svd(true, true);
        let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Vec::new() };
        let inverse = svd.singular_values.map(|s| 1.0 / s);
        let c = self.c(d);
        let mut modes = Vec::with_capacity(9);
        let mut consider = |eigenvalue: f64, frame: Matrix| {
            if eigenvalue < floor {
                modes.push((floor - eigenvalue, u * frame * vt));
            }
        };
        for (i, k) in [(0, 1), (0, 2), (1, 2)] {
            let cross = c * inverse[i] * inverse[k];
            for (sign, eigenvalue) in [(1.0, self.mu - cross), (-1.0, self.mu + cross)] {
                let mut frame = Matrix::zeros();
                frame[(i, k)] = std::f64::consts::FRAC_1_SQRT_2;
                frame[(k, i)] = sign * std::f64::consts::FRAC_1_SQRT_2;
                consider(eigenvalue, frame);
            }
        }
        let own = inverse.map(|s| self.mu - c * s * s);
        let diagonal = inverse * inverse.transpose() * self.lambda + Matrix::from_diagonal(&own);
        let eigen = SymmetricEigen::new(diagonal);
        for k in 0..3 {
            let axis: Vector = eigen.eigenvectors.column(k).into_owned();
            consider(eigen.eigenvalues[k], Matrix::from_diagonal(&axis));
        }
        modes
    }
}

#[cfg(test)]
#[path = "material_tests.rs"]
mod tests;

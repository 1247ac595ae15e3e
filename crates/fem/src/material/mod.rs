//! The compressible neo-Hookean solid: energy, stress, tangent.
//!
//! The only place that writes its closed form: for one point here, for several elements at once in
//! [`packed`].

mod packed;

pub(crate) use packed::{Nine, PackedGradient, PackedNeoHookean, Triple};

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
    mu: f64,
    /// λ, kPa.
    lambda: f64,
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

    /// That of two Lamé parameters, kPa.
    #[cfg(test)]
    pub(crate) const fn of_lame(mu: f64, lambda: f64) -> Self {
        Self { mu, lambda }
    }

    /// The shear modulus at small strain, kPa.
    pub(crate) fn shear_kpa(&self) -> f64 {
        self.mu
    }

    /// Energy Ψ per stress-free volume, kPa.
    #[cfg(test)]
    pub(crate) fn energy(&self, d: &Gradient) -> f64 {
        // tr FᵀF − 3 by way of grad u, without the cancellation.
        let stretch = 2.0 * d.gradient.trace() + d.gradient.norm_squared();
        self.mu * (0.5 * stretch - d.ln_j) + 0.5 * self.lambda * d.ln_j * d.ln_j
    }

    /// c = λ ln J − μ, kPa: the factor of F^-T in stress and tangent.
    fn c(&self, d: &Gradient) -> f64 {
        self.lambda * d.ln_j - self.mu
    }

    /// First Piola-Kirchhoff stress P = μ F + (λ ln J − μ) F^-T, kPa.
    ///
    /// Row = current axis, column = stress-free axis.
    pub(crate) fn stress(&self, d: &Gradient) -> Matrix {
        d.f() * self.mu + d.inverse_transpose * self.c(d)
    }

    /// Change of P where F changes by `df`, kPa: dP = μ dF − c F^-T dFᵀ F^-T + λ (F^-T : dF) F^-T.
    pub(crate) fn stress_change(&self, d: &Gradient, df: &Matrix) -> Matrix {
        let it = d.inverse_transpose;
        df * self.mu - it * df.transpose() * it * self.c(d) + it * (self.lambda * it.dot(df))
    }

    /// The tangent between the nodes of an element whose shape functions have the gradients `g` at
    /// the point, times `weight`.
    pub(crate) fn tangent<const N: usize>(
        &self,
        d: &Gradient,
        weight: f64,
        g: &[Vector; N],
    ) -> NodalTangent<N> {
        NodalTangent {
            g: *g,
            h: g.map(|g| d.inverse_transpose * g),
            mu: weight * self.mu,
            c: weight * self.c(d),
            lambda: weight * self.lambda,
        }
    }

    /// The same state seen from the loaded shape, whose gradient `back` leads to the stress-free
    /// one.
    pub(crate) fn loaded(&self, back: &Gradient) -> LoadedState {
        let f = back.inverse_transpose.transpose();
        let b = f * f.transpose();
        let pressure = Matrix::identity() * (self.mu + self.lambda * back.ln_j);
        let stress = (b * self.mu - pressure) * back.j;
        LoadedState { f, b, j: back.j, stress, mu: self.mu, lambda: self.lambda }
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

/// The tangent at a point between the nodes of an element.
pub(crate) struct NodalTangent<const N: usize> {
    g: [Vector; N],
    /// F^-T g.
    h: [Vector; N],
    mu: f64,
    c: f64,
    lambda: f64,
}

impl<const N: usize> NodalTangent<N> {
    /// Adds the block of the nodes a and b: λ h_a h_bᵀ − c h_b h_aᵀ + μ (g_a · g_b) I.
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, b: usize) {
        let Self { g, h, mu, c, lambda } = self;
        *block += h[a] * (h[b] * *lambda).transpose();
        *block -= h[b] * (h[a] * *c).transpose();
        *block += Matrix::from_diagonal_element(mu * g[a].dot(&g[b]));
    }
}

/// The state of a point on the loaded shape; f = F^-1, j = det f.
pub(crate) struct LoadedState {
    /// F.
    f: Matrix,
    /// F Fᵀ.
    b: Matrix,
    /// j.
    pub(crate) j: f64,
    /// Cauchy stress σ = j [μ (b − I) − λ ln j I], kPa.
    pub(crate) stress: Matrix,
    mu: f64,
    lambda: f64,
}

impl LoadedState {
    /// How the force of node a, σ g_a − j N_a times the `body` force, changes with the stress-free
    /// positions of node c, for all pairs: the terms that every pair of a shares.
    pub(crate) fn change<const N: usize>(
        &self,
        weight: f64,
        g: &[Vector; N],
        body: [Vector; N],
    ) -> LoadedTangent<N> {
        let Self { f, b, j, stress, mu, lambda } = self;
        LoadedTangent {
            f: *f,
            g: *g,
            t: g.map(|g| f.tr_mul(&g)),
            bg: g.map(|g| b * g),
            left: std::array::from_fn(|a| (stress * g[a] - g[a] * (j * lambda) - body[a]) * weight),
            shear: weight * j * mu,
        }
    }
}

/// The derivative of the inverse problem at a point between the nodes of an element.
pub(crate) struct LoadedTangent<const N: usize> {
    f: Matrix,
    g: [Vector; N],
    /// Fᵀ g.
    t: [Vector; N],
    /// b g.
    bg: [Vector; N],
    /// w (σ g − j λ g − j N force).
    left: [Vector; N],
    /// w j μ.
    shear: f64,
}

impl<const N: usize> LoadedTangent<N> {
    /// Adds the block of the nodes a and c: left_a t_cᵀ − w j μ ((g_a · b g_c) F + (b g_c) t_aᵀ).
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, c: usize) {
        let Self { f, g, t, bg, left, shear } = self;
        *block += left[a] * t[c].transpose();
        *block -= f * (shear * g[a].dot(&bg[c]));
        *block -= bg[c] * (t[a] * *shear).transpose();
    }
}

#[cfg(test)]
mod tests;

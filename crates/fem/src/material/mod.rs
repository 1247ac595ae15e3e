//! What tissue is made of: energy, stress, tangent.
//!
//! Every law is Ψ = W(Q) + λ/2 (ln J)² ([`laws`]). With m = 2 W′(Q), k = 4 W″(Q), c = λ ln J − m and
//! S = F − F^-T
//!
//! P = m F + c F^-T,
//!
//! dP = m dF − c F^-T dFᵀ F^-T + λ (F^-T : dF) F^-T + k (S : dF) S;
//!
//! for one point here, for several elements at once in [`packed`]. The files of the laws are the
//! only ones that write a closed form.

mod exponential;
mod fibres;
mod gent;
mod laws;
mod neo_hookean;
mod packed;
mod yeoh;

pub(crate) use exponential::Exponential;
pub(crate) use fibres::{Fibres, PackedFibres};
pub(crate) use gent::Gent;
pub(crate) use laws::{Stretching, by_law};
pub(crate) use neo_hookean::NeoHookean;
pub(crate) use packed::{Nine, PackedGradient, PackedMaterial, Triple};
pub(crate) use yeoh::Yeoh;

use crate::Tissue;
use nalgebra::SymmetricEigen;
use supine_record::Law;
use supine_space::{Matrix, Vector};

/// What an element is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Material {
    /// Shear modulus μ at small strain, kPa.
    mu: f64,
    /// λ, kPa.
    lambda: f64,
    /// How W grows.
    law: Law,
    /// The parameter of that, see [`Stretching::new`].
    stiffening: f64,
}

/// Shear modulus at a point and how it grows there, kPa.
#[derive(Clone, Copy, Debug)]
struct Response {
    /// 2 W′.
    m: f64,
    /// 4 W″.
    growth: f64,
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

    /// Q = tr FᵀF − 3 − 2 ln J, by way of grad u without the cancellation.
    fn q(&self) -> f64 {
        2.0 * self.gradient.trace() + self.gradient.norm_squared() - 2.0 * self.ln_j
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

impl Material {
    /// μ = E / 2(1+ν), λ = Eν / ((1+ν)(1−2ν)).
    pub(crate) fn new(tissue: &Tissue) -> Self {
        let (e, nu) = (tissue.young_kpa, tissue.poisson);
        Self {
            mu: e / (2.0 * (1.0 + nu)),
            lambda: e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)),
            law: tissue.law,
            stiffening: tissue.stiffening,
        }
    }

    /// That of a law and two Lamé parameters, kPa.
    #[cfg(test)]
    pub(crate) const fn of_law(law: Law, mu: f64, lambda: f64) -> Self {
        Self { mu, lambda, law, stiffening: STIFFENING }
    }

    /// The shear modulus at small strain, kPa.
    pub(crate) fn shear_kpa(&self) -> f64 {
        self.mu
    }

    /// Its law.
    pub(crate) fn law(&self) -> Law {
        self.law
    }

    /// m and k at Q.
    fn response(&self, q: f64) -> Response {
        by_law!(self.law, f64, L => {
            let law = L::new(self.mu, self.stiffening);
            Response { m: law.shear(q), growth: law.growth(q) }
        })
    }

    /// Whether tissue can be stretched as far as at a point.
    fn reaches(&self, q: f64) -> bool {
        by_law!(self.law, f64, L => L::new(self.mu, self.stiffening).reaches(q))
    }

    /// Energy Ψ per stress-free volume, kPa.
    #[cfg(test)]
    pub(crate) fn energy(&self, d: &Gradient) -> f64 {
        let w = by_law!(self.law, f64, L => L::new(self.mu, self.stiffening).energy(d.q()));
        w + 0.5 * self.lambda * d.ln_j * d.ln_j
    }

    /// First Piola-Kirchhoff stress P, kPa.
    ///
    /// Row = current axis, column = stress-free axis.
    pub(crate) fn stress(&self, d: &Gradient) -> Matrix {
        let m = self.response(d.q()).m;
        d.f() * m + d.inverse_transpose * (self.lambda * d.ln_j - m)
    }

    /// Change of P where F changes by `df`, kPa.
    pub(crate) fn stress_change(&self, d: &Gradient, df: &Matrix) -> Matrix {
        let (it, Response { m, growth }) = (d.inverse_transpose, self.response(d.q()));
        let c = self.lambda * d.ln_j - m;
        let change = df * m - it * df.transpose() * it * c + it * (self.lambda * it.dot(df));
        if growth > 0.0 {
            let s = d.f() - it;
            return change + s * (growth * s.dot(df));
        }
        change
    }

    /// The tangent between the nodes of an element whose shape functions have the gradients `g` at
    /// the point, times `weight`.
    pub(crate) fn tangent<const N: usize>(
        &self,
        d: &Gradient,
        weight: f64,
        g: &[Vector; N],
    ) -> NodalTangent<N> {
        let Response { m, growth } = self.response(d.q());
        let h = g.map(|g| d.inverse_transpose * g);
        NodalTangent {
            g: *g,
            h,
            s: grown(growth, |a| d.f() * g[a] - h[a]),
            mu: weight * m,
            c: weight * (self.lambda * d.ln_j - m),
            lambda: weight * self.lambda,
            growth: weight * growth,
        }
    }

    /// The same state seen from the loaded shape, whose gradient `back` leads to the stress-free
    /// one; `None` when tissue cannot be stretched so far.
    pub(crate) fn loaded(&self, back: &Gradient) -> Option<LoadedState> {
        let f = back.inverse_transpose.transpose();
        let b = f * f.transpose();
        let q = b.trace() - 3.0 + 2.0 * back.ln_j;
        if !self.reaches(q) {
            return None;
        }
        let Response { m, growth } = self.response(q);
        let pressure = Matrix::identity() * (m + self.lambda * back.ln_j);
        let stress = (b * m - pressure) * back.j;
        let lambda = self.lambda;
        Some(LoadedState { back: back.f(), f, b, j: back.j, stress, m, lambda, growth })
    }

    /// What must be added to the tangent so that its eigenvalues are at least `floor` (kPa):
    /// weights (kPa, 0 or above) and unit directions M of dF, to be added as Σ weight M (M : dF).
    /// The growth k (S : dF) S is left out of account: it lowers none.
    ///
    /// With F = U S Vᵀ the tangent couples, in the frame of U and V, only the diagonal of dF and
    /// each pair of its mirrored entries: one 3 × 3 and three 2 × 2 eigenproblems instead of a
    /// 9 × 9 one. Compare Smith, de Goes and Kim, Analytic eigensystems for isotropic distortion
    /// energies, ACM Trans. Graph. 38, 2019, section 4.
    pub(crate) fn shift(&self, d: &Gradient, floor: f64) -> Vec<(f64, Matrix)> {
        let svd = d.f().svd(true, true);
        let (Some(u), Some(vt)) = (svd.u, svd.v_t) else { return Vec::new() };
        let inverse = svd.singular_values.map(|s| 1.0 / s);
        let m = self.response(d.q()).m;
        let c = self.lambda * d.ln_j - m;
        let mut modes = Vec::with_capacity(9);
        let mut consider = |eigenvalue: f64, frame: Matrix| {
            if eigenvalue < floor {
                modes.push((floor - eigenvalue, u * frame * vt));
            }
        };
        for (i, k) in [(0, 1), (0, 2), (1, 2)] {
            let cross = c * inverse[i] * inverse[k];
            for (sign, eigenvalue) in [(1.0, m - cross), (-1.0, m + cross)] {
                let mut frame = Matrix::zeros();
                frame[(i, k)] = std::f64::consts::FRAC_1_SQRT_2;
                frame[(k, i)] = sign * std::f64::consts::FRAC_1_SQRT_2;
                consider(eigenvalue, frame);
            }
        }
        let own = inverse.map(|s| m - c * s * s);
        let diagonal = inverse * inverse.transpose() * self.lambda + Matrix::from_diagonal(&own);
        let eigen = SymmetricEigen::new(diagonal);
        for k in 0..3 {
            let axis: Vector = eigen.eigenvectors.column(k).into_owned();
            consider(eigen.eigenvalues[k], Matrix::from_diagonal(&axis));
        }
        modes
    }
}

/// A vector of each node, of a tissue that stiffens.
fn grown<const N: usize>(growth: f64, of: impl Fn(usize) -> Vector) -> [Vector; N] {
    if growth > 0.0 { std::array::from_fn(of) } else { [Vector::zeros(); N] }
}

/// The tangent at a point between the nodes of an element.
pub(crate) struct NodalTangent<const N: usize> {
    g: [Vector; N],
    /// F^-T g.
    h: [Vector; N],
    /// (F − F^-T) g.
    s: [Vector; N],
    mu: f64,
    c: f64,
    lambda: f64,
    growth: f64,
}

impl<const N: usize> NodalTangent<N> {
    /// Adds the block of the nodes a and b: λ h_a h_bᵀ − c h_b h_aᵀ + m (g_a · g_b) I + k s_a s_bᵀ.
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, b: usize) {
        let Self { g, h, s, mu, c, lambda, growth } = self;
        *block += h[a] * (h[b] * *lambda).transpose();
        *block -= h[b] * (h[a] * *c).transpose();
        *block += Matrix::from_diagonal_element(mu * g[a].dot(&g[b]));
        if *growth > 0.0 {
            *block += s[a] * (s[b] * *growth).transpose();
        }
    }
}

/// The state of a point on the loaded shape; f = F^-1, j = det f.
pub(crate) struct LoadedState {
    /// f.
    back: Matrix,
    /// F.
    f: Matrix,
    /// F Fᵀ.
    b: Matrix,
    /// j.
    pub(crate) j: f64,
    /// Cauchy stress σ = j [m (b − I) − λ ln j I], kPa.
    pub(crate) stress: Matrix,
    m: f64,
    lambda: f64,
    growth: f64,
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
        let Self { f, b, j, stress, m, lambda, growth, .. } = self;
        let bg = g.map(|g| b * g);
        LoadedTangent {
            f: *f,
            g: *g,
            t: g.map(|g| f.tr_mul(&g)),
            strain: grown(*growth, |a| bg[a] - g[a]),
            bg,
            left: std::array::from_fn(|a| (stress * g[a] - g[a] * (j * lambda) - body[a]) * weight),
            shear: weight * j * m,
            growth: weight * j * growth,
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
    /// (b − I) g.
    strain: [Vector; N],
    /// w j m.
    shear: f64,
    /// w j k.
    growth: f64,
}

impl<const N: usize> LoadedTangent<N> {
    /// Adds the block of the nodes a and c: left_a t_cᵀ − w j m ((g_a · b g_c) F + (b g_c) t_aᵀ) − w
    /// j k ((b − I) g_a) (Fᵀ (b − I) g_c)ᵀ.
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, c: usize) {
        let Self { f, g, t, bg, left, strain, shear, growth } = self;
        *block += left[a] * t[c].transpose();
        *block -= f * (shear * g[a].dot(&bg[c]));
        *block -= bg[c] * (t[a] * *shear).transpose();
        if *growth > 0.0 {
            *block -= strain[a] * (f.tr_mul(&strain[c]) * *growth).transpose();
        }
    }
}

/// Stiffening of the materials of tests: Gent's tissue reaches Q = 4.
#[cfg(test)]
pub(crate) const STIFFENING: f64 = 0.25;

#[cfg(test)]
mod tests;

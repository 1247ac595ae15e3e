//! Fibres, which bear tension alone.
//!
//! A family along the unit vector a on the stress-free shape adds, with I₄ = |F a|² and ⟨x⟩ = max(x,
//! 0),
//!
//! ψ = c/4k (exp(k ⟨I₄ − 1⟩²) − 1),
//!
//! P = 2ψ′ F a aᵀ,   dP = 2ψ′ dF a aᵀ + 4ψ″ (F a · dF a) F a aᵀ.
//!
//! At small strain the modulus along the fibres grows by 2c. Source: Holzapfel, Gasser and Ogden, A
//! new constitutive framework for arterial wall mechanics, J. Elast. 61 (2000) 1, without
//! dispersion.

use super::laws::Number;
use super::packed::{Nine, PackedGradient, Triple};
use super::{Gradient, LoadedState};
use crate::element::{Elements, kept};
use supine_space::{LANES, Matrix, Pack, Vector};

/// k ⟨I₄ − 1⟩² above which ψ is taken for infinite.
const FURTHEST: f64 = 500.0;

/// The fibres at the quadrature points of a body.
#[derive(Clone, Debug)]
pub(crate) struct Fibres<const Q: usize> {
    /// c of each element, kPa.
    pub(crate) c: Vec<f64>,
    /// k.
    pub(crate) k: f64,
    /// Their direction on the shape that they are given on; zero where there are none.
    pub(crate) along: Vec<[Vector; Q]>,
}

/// ψ, 2ψ′ and 4ψ″ at I₄ − 1, kPa.
#[inline(always)]
fn response<S: Number>(c: S, k: S, strain: S) -> [S; 3] {
    let e = strain.positive_part();
    let square = k * e * e;
    let grown = square.exp_m1();
    let ex = S::all(1.0) + grown;
    let second = S::all(2.0) * c * ex * (S::all(1.0) + S::all(2.0) * square);
    [S::all(0.25) * c / k * grown, c * e * ex, second * strain.above_zero()]
}

/// Whether ψ is finite.
#[inline(always)]
fn reaches<S: Number>(k: S, strain: S) -> bool {
    let e = strain.positive_part();
    (S::all(FURTHEST) - k * e * e).all_positive()
}

impl<const Q: usize> Fibres<Q> {
    /// F a, 2ψ′ and 4ψ″ at a quadrature point.
    fn at(&self, e: usize, q: usize, d: &Gradient) -> (Vector, [f64; 3]) {
        let (a, stretched) = (self.along[e][q], d.gradient * self.along[e][q]);
        let strain = 2.0 * a.dot(&stretched) + stretched.norm_squared();
        (a + stretched, response(self.c[e], self.k, strain))
    }

    /// ψ, kPa.
    #[cfg(test)]
    pub(crate) fn energy(&self, e: usize, q: usize, d: &Gradient) -> f64 {
        self.at(e, q, d).1[0]
    }

    /// Their part of P, kPa.
    pub(crate) fn stress(&self, e: usize, q: usize, d: &Gradient) -> Matrix {
        let (fa, [_, first, _]) = self.at(e, q, d);
        fa * (self.along[e][q] * first).transpose()
    }

    /// Its change where F changes by `df`, kPa.
    pub(crate) fn stress_change(&self, e: usize, q: usize, d: &Gradient, df: &Matrix) -> Matrix {
        let (a, (fa, [_, first, second])) = (self.along[e][q], self.at(e, q, d));
        let change = df * a;
        (change * first + fa * (second * fa.dot(&change))) * a.transpose()
    }

    /// Their tangent between the nodes of an element, times `weight`: see
    /// [`FibreTangent::add_to`].
    pub(crate) fn tangent<const N: usize>(
        &self,
        (e, q): (usize, usize),
        d: &Gradient,
        weight: f64,
        g: &[Vector; N],
    ) -> FibreTangent<N> {
        let (fa, [_, first, second]) = self.at(e, q, d);
        let along = g.map(|g| g.dot(&self.along[e][q]));
        FibreTangent { fa, along, first: weight * first, second: weight * second }
    }

    /// Adds their Cauchy stress to that of a `state` on the loaded shape, on which they are given;
    /// `None` when they cannot be stretched so far. With m there and f, j as in [`LoadedState`], s =
    /// |f m|²: F a = m / |f m|, I₄ = |m|² / s, σ = j 2ψ′ m mᵀ / s.
    pub(crate) fn load(&self, e: usize, q: usize, state: &mut LoadedState) -> Option<()> {
        let (m, s) = self.loaded(e, q, state);
        if s <= 0.0 {
            return Some(());
        }
        let strain = m.norm_squared() / s - 1.0;
        let [_, first, _] = response(self.c[e], self.k, strain);
        state.stress += m * m.transpose() * (state.j * first / s);
        reaches(self.k, strain).then_some(())
    }

    /// m and s.
    fn loaded(&self, e: usize, q: usize, state: &LoadedState) -> (Vector, f64) {
        let m = self.along[e][q];
        (m, (state.back * m).norm_squared())
    }

    /// What the stress of [`Self::load`] adds to the derivative of the inverse problem beside its
    /// part in [`super::LoadedTangent`]: see [`LoadedFibres::add_to`].
    pub(crate) fn change<const N: usize>(
        &self,
        (e, q): (usize, usize),
        state: &LoadedState,
        weight: f64,
        g: &[Vector; N],
    ) -> LoadedFibres<N> {
        let (m, s) = self.loaded(e, q, state);
        let factor = if s > 0.0 {
            let i4 = m.norm_squared() / s;
            let [_, first, second] = response(self.c[e], self.k, i4 - 1.0);
            -2.0 * weight * state.j * (0.5 * second * i4 + first) / (s * s)
        } else {
            0.0
        };
        LoadedFibres { m, back: state.back * m, along: g.map(|g| g.dot(&m)), factor }
    }

    /// Carried by the displacement `y` (mm) of the nodes of `elements`, on which they are given:
    /// (I + grad y) times each.
    pub(crate) fn pushed<const N: usize>(&self, elements: &Elements<N, Q>, y: &[Vector]) -> Self {
        let push = |e: usize, q: usize| {
            let m = self.along[e][q];
            m + elements.gradient(e, q, y) * m
        };
        let along = (0..self.along.len()).map(|e| std::array::from_fn(|q| push(e, q))).collect();
        Self { along, ..self.clone() }
    }

    /// With unit vectors.
    pub(crate) fn unit(mut self) -> Self {
        self.along.iter_mut().flatten().for_each(|a| {
            *a = a.try_normalize(0.0).unwrap_or_default();
        });
        self
    }

    /// Those of the elements that are to be kept.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        Self { c: kept(&self.c, keep), along: kept(&self.along, keep), ..*self }
    }

    /// Those of several elements.
    pub(crate) fn pack(&self, of: [usize; LANES]) -> PackedFibres<Q> {
        let along =
            std::array::from_fn(|q| [0, 1, 2].map(|k| Pack(of.map(|e| self.along[e][q][k]))));
        PackedFibres { c: Pack(of.map(|e| self.c[e])), k: Pack::all(self.k), along }
    }
}

/// The tangent of fibres between the nodes of an element.
pub(crate) struct FibreTangent<const N: usize> {
    fa: Vector,
    /// g · a.
    along: [f64; N],
    first: f64,
    second: f64,
}

impl<const N: usize> FibreTangent<N> {
    /// Adds the block of the nodes a and b: (g_a · a) (g_b · a) (2ψ′ I + 4ψ″ F a (F a)ᵀ).
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, b: usize) {
        let Self { fa, along, first, second } = self;
        let both = along[a] * along[b];
        *block += Matrix::from_diagonal_element(first * both);
        *block += fa * (fa * (second * both)).transpose();
    }
}

/// The derivative of the inverse problem by the turning of fibres.
pub(crate) struct LoadedFibres<const N: usize> {
    m: Vector,
    /// f m.
    back: Vector,
    /// g · m.
    along: [f64; N],
    factor: f64,
}

impl<const N: usize> LoadedFibres<N> {
    /// Adds the block of the nodes a and c: −2 w j (2ψ″ I₄ + 2ψ′) / s² (m · g_a) (m · g_c) m (f m)ᵀ.
    pub(crate) fn add_to(&self, block: &mut Matrix, a: usize, c: usize) {
        let Self { m, back, along, factor } = self;
        *block += m * (back * (factor * along[a] * along[c])).transpose();
    }
}

/// The fibres of several elements.
#[derive(Clone, Debug)]
pub(crate) struct PackedFibres<const Q: usize> {
    c: Pack,
    k: Pack,
    along: [Triple; Q],
}

impl<const Q: usize> PackedFibres<Q> {
    /// F a and I₄ − 1.
    #[inline(always)]
    fn at(&self, q: usize, state: &PackedGradient) -> (Triple, Pack) {
        let (a, h) = (&self.along[q], &state.gradient);
        let mut fa = *a;
        let mut strain = Pack::ZERO;
        for i in 0..3 {
            let stretched = h[3 * i] * a[0] + h[3 * i + 1] * a[1] + h[3 * i + 2] * a[2];
            fa[i] += stretched;
            strain += stretched * (a[i] + fa[i]);
        }
        (fa, strain)
    }

    /// Their energy, kPa times `weight`; adds their part of P. `None` when they cannot be stretched
    /// so far.
    #[inline(always)]
    pub(crate) fn add_stress(
        &self,
        q: usize,
        state: &PackedGradient,
        weight: Pack,
        stress: &mut Nine,
    ) -> Option<Pack> {
        let (fa, strain) = self.at(q, state);
        if !reaches(self.k, strain) {
            return None;
        }
        let [energy, first, _] = response(self.c, self.k, strain);
        let by = weight * first;
        for i in 0..3 {
            for k in 0..3 {
                stress[3 * i + k] += by * fa[i] * self.along[q][k];
            }
        }
        Some(weight * energy)
    }

    /// Adds their tangent to the blocks of the pairs (a, b ≤ a).
    #[inline(always)]
    pub(crate) fn add_tangent<const N: usize>(
        &self,
        q: usize,
        state: &PackedGradient,
        weight: Pack,
        (gradients, blocks): (&[Triple; N], &mut [Nine]),
    ) {
        let (fa, strain) = self.at(q, state);
        let [_, first, second] = response(self.c, self.k, strain);
        let a = &self.along[q];
        let mut along = [Pack::ZERO; N];
        for (along, g) in along.iter_mut().zip(gradients) {
            *along = g[0] * a[0] + g[1] * a[1] + g[2] * a[2];
        }
        let mut pair = 0;
        for n in 0..N {
            for m in 0..=n {
                let both = weight * along[n] * along[m];
                let (own, by) = (both * first, fa.map(|v| v * both * second));
                let block = &mut blocks[pair];
                pair += 1;
                for i in 0..3 {
                    for k in 0..3 {
                        block[3 * i + k] += by[i] * fa[k];
                    }
                    block[4 * i] += own;
                }
            }
        }
    }
}

//! The same for several elements at once: what a solver spends its time on.

use super::Material;
use super::laws::Stretching;
use supine_space::{LANES, Pack};

/// A vector and a matrix (row by row) of several elements.
pub(crate) type Triple = [Pack; 3];
pub(crate) type Nine = [Pack; 9];

/// The deformation gradient at a point of several elements.
pub(crate) struct PackedGradient {
    /// grad u.
    pub(super) gradient: Nine,
    /// F^-1, row by row.
    pub(crate) inverse: Nine,
    /// ln J.
    pub(crate) ln_j: Pack,
}

impl PackedGradient {
    /// As [`super::Gradient::new`]; `None` when one of the elements is turned inside out.
    #[inline(always)]
    pub(crate) fn new(h: Nine) -> Option<Self> {
        let minor = |a: Pack, d: Pack, b: Pack, c: Pack| a * d - b * c;
        let det = h[0] * minor(h[4], h[8], h[5], h[7]) - h[1] * minor(h[3], h[8], h[5], h[6])
            + h[2] * minor(h[3], h[7], h[4], h[6]);
        let minors = minor(h[0], h[4], h[1], h[3])
            + minor(h[4], h[8], h[5], h[7])
            + minor(h[0], h[8], h[2], h[6]);
        let swelling = h[0] + h[4] + h[8] + minors + det;
        let one = Pack::all(1.0);
        let j = one + swelling;
        if !j.all_positive() {
            return None;
        }
        let mut f = h;
        (0..3).for_each(|i| f[4 * i] += one);
        let r = one / j;
        let inverse = [
            minor(f[4], f[8], f[5], f[7]) * r,
            minor(f[2], f[7], f[1], f[8]) * r,
            minor(f[1], f[5], f[2], f[4]) * r,
            minor(f[5], f[6], f[3], f[8]) * r,
            minor(f[0], f[8], f[2], f[6]) * r,
            minor(f[2], f[3], f[0], f[5]) * r,
            minor(f[3], f[7], f[4], f[6]) * r,
            minor(f[1], f[6], f[0], f[7]) * r,
            minor(f[0], f[4], f[1], f[3]) * r,
        ];
        Some(Self { gradient: h, inverse, ln_j: swelling.ln_1p() })
    }

    /// As [`super::Gradient::q`].
    #[inline(always)]
    fn q(&self) -> Pack {
        let h = &self.gradient;
        let trace = h[0] + h[4] + h[8];
        let mut squares = Pack::ZERO;
        h.iter().for_each(|v| squares += *v * *v);
        let two = Pack::all(2.0);
        two * trace + squares - two * self.ln_j
    }
}

/// The materials of several elements, all of the law `L`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedMaterial<L> {
    law: L,
    lambda: Pack,
}

impl<L: Stretching<Pack>> PackedMaterial<L> {
    /// The materials `of` each lane.
    pub(crate) fn new(of: [&Material; LANES]) -> Self {
        let law = L::new(Pack(of.map(|m| m.mu)), Pack(of.map(|m| m.stiffening)));
        Self { law, lambda: Pack(of.map(|m| m.lambda)) }
    }

    /// Ψ, kPa; `None` when tissue cannot be stretched so far.
    #[inline(always)]
    pub(crate) fn energy(&self, state: &PackedGradient) -> Option<Pack> {
        let q = state.q();
        if L::STIFFENS && !self.law.reaches(q) {
            return None;
        }
        let half = Pack::all(0.5);
        Some(self.law.energy(q) + half * self.lambda * state.ln_j * state.ln_j)
    }

    /// P times `weight`: m F + c F^-T.
    #[inline(always)]
    pub(crate) fn stress(&self, state: &PackedGradient, weight: Pack) -> Nine {
        let m = self.law.shear(state.q());
        let (m, c) = (m * weight, (self.lambda * state.ln_j - m) * weight);
        let mut stress = state.gradient;
        for i in 0..3 {
            stress[4 * i] += Pack::all(1.0);
            for k in 0..3 {
                stress[3 * i + k] = stress[3 * i + k] * m + state.inverse[3 * k + i] * c;
            }
        }
        stress
    }

    /// Adds the tangent between the nodes of the elements, times `weight`, to the blocks of the
    /// pairs (a, b ≤ a); `ln_j` is that of the state, or as a step foresaw it.
    #[inline(always)]
    pub(crate) fn add_tangent<const N: usize>(
        &self,
        (state, ln_j): (&PackedGradient, Pack),
        weight: Pack,
        gradients: &[Triple; N],
        blocks: &mut [Nine],
    ) {
        let m = self.law.shear(state.q());
        let (mu, c) = (weight * m, weight * (self.lambda * ln_j - m));
        let lambda = weight * self.lambda;
        let mut h = [[Pack::ZERO; 3]; N];
        for (h, g) in h.iter_mut().zip(gradients) {
            for i in 0..3 {
                let inverse = &state.inverse;
                h[i] = inverse[i] * g[0] + inverse[3 + i] * g[1] + inverse[6 + i] * g[2];
            }
        }
        let mut pair = 0;
        for a in 0..N {
            let (by_lambda, by_c) = (h[a].map(|v| v * lambda), h[a].map(|v| v * c));
            for b in 0..=a {
                let (g, k) = (&gradients[a], &gradients[b]);
                let own = mu * (g[0] * k[0] + g[1] * k[1] + g[2] * k[2]);
                let block = &mut blocks[pair];
                pair += 1;
                for i in 0..3 {
                    for k in 0..3 {
                        block[3 * i + k] += by_lambda[i] * h[b][k] - h[b][i] * by_c[k];
                    }
                    block[4 * i] += own;
                }
            }
        }
        if L::STIFFENS {
            self.add_growth((state, &h), weight, gradients, blocks);
        }
    }

    /// Adds k s_a s_bᵀ, s = F g − F^-T g.
    #[inline(always)]
    fn add_growth<const N: usize>(
        &self,
        (state, h): (&PackedGradient, &[Triple; N]),
        weight: Pack,
        gradients: &[Triple; N],
        blocks: &mut [Nine],
    ) {
        let growth = weight * self.law.growth(state.q());
        let mut s = [[Pack::ZERO; 3]; N];
        for a in 0..N {
            let (g, d) = (&gradients[a], &state.gradient);
            for i in 0..3 {
                let moved = d[3 * i] * g[0] + d[3 * i + 1] * g[1] + d[3 * i + 2] * g[2];
                s[a][i] = g[i] + moved - h[a][i];
            }
        }
        let mut pair = 0;
        for a in 0..N {
            let by_growth = s[a].map(|v| v * growth);
            for b in 0..=a {
                let block = &mut blocks[pair];
                pair += 1;
                for i in 0..3 {
                    for k in 0..3 {
                        block[3 * i + k] += by_growth[i] * s[b][k];
                    }
                }
            }
        }
    }
}

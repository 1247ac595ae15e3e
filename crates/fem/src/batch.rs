//! Energy, forces and stiffness of several elements at once: what a solver spends its time on.
//!
//! The same formulas as in [`crate::material`] and [`crate::model`], which stay the plain twin they
//! are tested against.

use crate::element::Elements;
use crate::material::NeoHookean;
use crate::pattern::{Block, Pattern};
use pulp::{Arch, Simd, WithSimd};
use supine_space::{LANES, Pack, Vector};

/// A vector and a matrix (row by row) of several elements.
type Triple = [Pack; 3];
type Nine = [Pack; 9];

/// Several elements; the last ones of a mesh may stand for none, with volume 0.
#[derive(Clone, Debug)]
struct Batch<const N: usize, const Q: usize> {
    nodes: [[u32; LANES]; N],
    gradients: [[Triple; N]; Q],
    weights: [Pack; Q],
    mu: Pack,
    lambda: Pack,
}

/// All elements of a body.
#[derive(Clone, Debug)]
pub(crate) struct Batches<const N: usize, const Q: usize> {
    elements: usize,
    batches: Vec<Batch<N, Q>>,
}

/// ln J at the quadrature points of all elements, as a step predicted it.
#[derive(Clone, Debug)]
pub(crate) struct VolumeStrain<const Q: usize>(Vec<[Pack; Q]>);

/// The state of a quadrature point of several elements.
struct State {
    /// grad u.
    gradient: Nine,
    /// F^-1, row by row.
    inverse: Nine,
    ln_j: Pack,
    /// λ ln J − μ, kPa.
    c: Pack,
}

impl<const N: usize, const Q: usize> Batches<N, Q> {
    /// `elements` of `materials`, in their order.
    pub(crate) fn new(elements: &Elements<N, Q>, materials: &[NeoHookean]) -> Self {
        let count = elements.nodes.len();
        let batch = |first: usize| {
            let own: [usize; LANES] = std::array::from_fn(|lane| (first + lane).min(count - 1));
            let pack = |of: &dyn Fn(usize) -> f64| Pack(own.map(of));
            Batch {
                nodes: std::array::from_fn(|a| own.map(|e| elements.nodes[e][a])),
                gradients: std::array::from_fn(|q| {
                    std::array::from_fn(|a| {
                        [0, 1, 2].map(|k| pack(&|e| elements.gradients[e][q][a][k]))
                    })
                }),
                weights: std::array::from_fn(|q| {
                    let of = |lane: usize| {
                        if first + lane < count { elements.weights[own[lane]][q] } else { 0.0 }
                    };
                    Pack(std::array::from_fn(of))
                }),
                mu: pack(&|e| materials[e].mu),
                lambda: pack(&|e| materials[e].lambda),
            }
        };
        Self { elements: count, batches: (0..count).step_by(LANES).map(batch).collect() }
    }

    /// Elastic energy ∫ Ψ (mN mm) and internal nodal forces ∫ P grad N_a (mN), written to `forces`.
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn evaluate(&self, u: &[Vector], forces: &mut [Vector]) -> Option<f64> {
        forces.fill(Vector::zeros());
        Arch::new().dispatch(Evaluate { batches: &self.batches, u, forces })
    }

    /// ln J after a `step` (mm) from `u`, to first order: ln J + F^-T : grad step.
    ///
    /// `None` when an element is turned inside out at `u`.
    pub(crate) fn predicted(&self, u: &[Vector], step: &[Vector]) -> Option<VolumeStrain<Q>> {
        Arch::new().dispatch(Foresee { batches: &self.batches, u, step })
    }

    /// Fills `blocks` with the stiffness, see [`crate::model::Model::stiffness`].
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn stiffness(
        &self,
        u: &[Vector],
        predicted: Option<&VolumeStrain<Q>>,
        pattern: &Pattern,
        blocks: &mut [Block],
    ) -> Option<()> {
        blocks.fill([0.0; 9]);
        let own = vec![[Pack::ZERO; 9]; N * (N + 1) / 2];
        Arch::new().dispatch(Stiffness { all: self, u, predicted, own, pattern, blocks })
    }
}

/// The work of [`Batches::evaluate`].
struct Evaluate<'a, const N: usize, const Q: usize> {
    batches: &'a [Batch<N, Q>],
    u: &'a [Vector],
    forces: &'a mut [Vector],
}

impl<const N: usize, const Q: usize> WithSimd for Evaluate<'_, N, Q> {
    type Output = Option<f64>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<f64> {
        let mut energy = Pack::ZERO;
        for batch in self.batches {
            energy += batch.evaluate(self.u, self.forces)?;
        }
        Some(energy.0.iter().sum())
    }
}

/// The work of [`Batches::predicted`].
struct Foresee<'a, const N: usize, const Q: usize> {
    batches: &'a [Batch<N, Q>],
    u: &'a [Vector],
    step: &'a [Vector],
}

impl<const N: usize, const Q: usize> WithSimd for Foresee<'_, N, Q> {
    type Output = Option<VolumeStrain<Q>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<VolumeStrain<Q>> {
        let mut strain = Vec::with_capacity(self.batches.len());
        for batch in self.batches {
            strain.push(batch.predicted(self.u, self.step)?);
        }
        Some(VolumeStrain(strain))
    }
}

/// The work of [`Batches::stiffness`].
struct Stiffness<'a, const N: usize, const Q: usize> {
    all: &'a Batches<N, Q>,
    u: &'a [Vector],
    predicted: Option<&'a VolumeStrain<Q>>,
    own: Vec<Nine>,
    pattern: &'a Pattern,
    blocks: &'a mut [Block],
}

impl<const N: usize, const Q: usize> WithSimd for Stiffness<'_, N, Q> {
    type Output = Option<()>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Option<()> {
        for (n, batch) in self.all.batches.iter().enumerate() {
            let first = n * LANES;
            batch.stiffness(self.u, self.predicted.map(|strain| &strain.0[n]), &mut self.own)?;
            for lane in 0..LANES.min(self.all.elements - first) {
                let places = self.pattern.places::<N>(first + lane);
                for (place, block) in places.iter().zip(&self.own) {
                    place.add(&block.map(|entry| entry.0[lane]), self.blocks);
                }
            }
        }
        Some(())
    }
}

/// grad of a field with these nodal values: row = component, column = axis.
#[inline(always)]
fn gradient<const N: usize>(values: &[Triple; N], gradients: &[Triple; N]) -> Nine {
    let mut sum = [Pack::ZERO; 9];
    for (value, g) in values.iter().zip(gradients) {
        for i in 0..3 {
            for k in 0..3 {
                sum[3 * i + k] += value[i] * g[k];
            }
        }
    }
    sum
}

impl<const N: usize, const Q: usize> Batch<N, Q> {
    #[inline(always)]
    fn gather(&self, u: &[Vector]) -> [Triple; N] {
        let mut own = [[Pack::ZERO; 3]; N];
        for (own, nodes) in own.iter_mut().zip(&self.nodes) {
            for lane in 0..LANES {
                let u = &u[nodes[lane] as usize];
                for k in 0..3 {
                    own[k].0[lane] = u[k];
                }
            }
        }
        own
    }

    /// The energy, its forces added; `None` when an element is turned inside out.
    #[inline(always)]
    fn evaluate(&self, u: &[Vector], forces: &mut [Vector]) -> Option<Pack> {
        let u = self.gather(u);
        let mut own = [[Pack::ZERO; 3]; N];
        let mut energy = Pack::ZERO;
        for (gradients, weight) in self.gradients.iter().zip(&self.weights) {
            let state = self.state(&u, gradients)?;
            energy += *weight * self.energy(&state);
            let stress = self.stress(&state, *weight);
            for (force, g) in own.iter_mut().zip(gradients) {
                for i in 0..3 {
                    force[i] +=
                        stress[3 * i] * g[0] + stress[3 * i + 1] * g[1] + stress[3 * i + 2] * g[2];
                }
            }
        }
        for (own, nodes) in own.iter().zip(&self.nodes) {
            for lane in 0..LANES {
                let force = &mut forces[nodes[lane] as usize];
                for k in 0..3 {
                    force[k] += own[k].0[lane];
                }
            }
        }
        Some(energy)
    }

    /// ln J after `step`, to first order; `None` when an element is turned inside out.
    #[inline(always)]
    fn predicted(&self, u: &[Vector], step: &[Vector]) -> Option<[Pack; Q]> {
        let (u, step) = (self.gather(u), self.gather(step));
        let mut strain = [Pack::ZERO; Q];
        for (strain, gradients) in strain.iter_mut().zip(&self.gradients) {
            let state = self.state(&u, gradients)?;
            let change = gradient(&step, gradients);
            *strain = state.ln_j;
            for i in 0..3 {
                for k in 0..3 {
                    *strain += state.inverse[3 * k + i] * change[3 * i + k];
                }
            }
        }
        Some(strain)
    }

    /// The blocks of the pairs (a, b ≤ a); `None` when an element is turned inside out.
    #[inline(always)]
    fn stiffness(
        &self,
        u: &[Vector],
        predicted: Option<&[Pack; Q]>,
        blocks: &mut [Nine],
    ) -> Option<()> {
        let u = self.gather(u);
        blocks.fill([Pack::ZERO; 9]);
        for (q, (gradients, weight)) in self.gradients.iter().zip(&self.weights).enumerate() {
            let state = self.state(&u, gradients)?;
            let c = predicted.map_or(state.c, |strain| self.lambda * strain[q] - self.mu);
            let (mu, c, lambda) = (*weight * self.mu, *weight * c, *weight * self.lambda);
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
        }
        Some(())
    }

    #[inline(always)]
    fn state(&self, u: &[Triple; N], gradients: &[Triple; N]) -> Option<State> {
        let h = gradient(u, gradients);
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
        let ln_j = swelling.ln_1p();
        Some(State { gradient: h, inverse, ln_j, c: self.lambda * ln_j - self.mu })
    }

    /// Ψ, kPa.
    #[inline(always)]
    fn energy(&self, state: &State) -> Pack {
        let h = &state.gradient;
        let trace = h[0] + h[4] + h[8];
        let mut squares = Pack::ZERO;
        h.iter().for_each(|v| squares += *v * *v);
        let (two, half) = (Pack::all(2.0), Pack::all(0.5));
        self.mu * (half * (two * trace + squares) - state.ln_j)
            + half * self.lambda * state.ln_j * state.ln_j
    }

    /// P times `weight`: μ F + c F^-T.
    #[inline(always)]
    fn stress(&self, state: &State, weight: Pack) -> Nine {
        let (mu, c) = (self.mu * weight, state.c * weight);
        let mut stress = state.gradient;
        for i in 0..3 {
            stress[4 * i] += Pack::all(1.0);
            for k in 0..3 {
                stress[3 * i + k] = stress[3 * i + k] * mu + state.inverse[3 * k + i] * c;
            }
        }
        stress
    }
}

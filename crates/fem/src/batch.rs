//! Energy, forces and stiffness of several elements at once: what a solver spends its time on.
//!
//! The same formulas as in [`crate::material`] and [`crate::model`], which stay the plain twin they
//! are tested against.

use crate::element::Elements;
use crate::material::{
    Fibres, Material, Nine, PackedFibres, PackedGradient, PackedMaterial, Stretching, Triple,
    by_law,
};
use crate::pattern::{Block, Pattern};
use pulp::{Arch, Simd, WithSimd};
use std::fmt::Debug;
use std::sync::Arc;
use supine_record::Law;
use supine_space::{LANES, Pack, Vector};

/// Several elements; the last ones of a mesh may stand for none, with volume 0.
#[derive(Clone, Debug)]
struct Batch<L, const N: usize, const Q: usize> {
    nodes: [[u32; LANES]; N],
    gradients: [[Triple; N]; Q],
    weights: [Pack; Q],
    material: PackedMaterial<L>,
    fibres: Option<Box<PackedFibres<Q>>>,
}

/// All elements of a body, whatever their law.
pub(crate) trait Kernel<const N: usize, const Q: usize>: Debug + Send + Sync {
    /// Elastic energy ∫ Ψ (mN mm) and internal nodal forces ∫ P grad N_a (mN), written to `forces`.
    ///
    /// `None` when an element is turned inside out, or stretched further than its law allows.
    fn evaluate(&self, u: &[Vector], forces: &mut [Vector]) -> Option<f64>;

    /// ln J after a `step` (mm) from `u`, to first order: ln J + F^-T : grad step.
    ///
    /// `None` when an element is turned inside out at `u`.
    fn predicted(&self, u: &[Vector], step: &[Vector]) -> Option<VolumeStrain<Q>>;

    /// Fills `blocks` with the stiffness, see [`crate::model::Model::stiffness`].
    ///
    /// `None` when an element is turned inside out.
    fn stiffness(
        &self,
        u: &[Vector],
        predicted: Option<&VolumeStrain<Q>>,
        pattern: &Pattern,
        blocks: &mut [Block],
    ) -> Option<()>;
}

/// The kernel of `elements` of `materials`, in their order, all of one law.
pub(crate) fn kernel<const N: usize, const Q: usize>(
    elements: &Elements<N, Q>,
    materials: &[Material],
    fibres: Option<&Fibres<Q>>,
) -> Arc<dyn Kernel<N, Q>> {
    let law = materials.first().map_or(Law::default(), Material::law);
    by_law!(law, Pack, L => Arc::new(Batches::<L, N, Q>::new(elements, materials, fibres)))
}

/// All elements of a body of the law `L`.
#[derive(Clone, Debug)]
struct Batches<L, const N: usize, const Q: usize> {
    elements: usize,
    batches: Vec<Batch<L, N, Q>>,
}

/// ln J at the quadrature points of all elements, as a step predicted it.
#[derive(Clone, Debug)]
pub(crate) struct VolumeStrain<const Q: usize>(Vec<[Pack; Q]>);

impl<L: Stretching<Pack>, const N: usize, const Q: usize> Batches<L, N, Q> {
    /// `elements` of `materials`, in their order.
    fn new(elements: &Elements<N, Q>, materials: &[Material], fibres: Option<&Fibres<Q>>) -> Self {
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
                material: PackedMaterial::new(own.map(|e| &materials[e])),
                fibres: fibres.map(|fibres| Box::new(fibres.pack(own))),
            }
        };
        Self { elements: count, batches: (0..count).step_by(LANES).map(batch).collect() }
    }
}

impl<L: Stretching<Pack>, const N: usize, const Q: usize> Kernel<N, Q> for Batches<L, N, Q> {
    fn evaluate(&self, u: &[Vector], forces: &mut [Vector]) -> Option<f64> {
        forces.fill(Vector::zeros());
        Arch::new().dispatch(Evaluate { batches: &self.batches, u, forces })
    }

    fn predicted(&self, u: &[Vector], step: &[Vector]) -> Option<VolumeStrain<Q>> {
        Arch::new().dispatch(Foresee { batches: &self.batches, u, step })
    }

    fn stiffness(
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

/// The work of [`Kernel::evaluate`].
struct Evaluate<'a, L, const N: usize, const Q: usize> {
    batches: &'a [Batch<L, N, Q>],
    u: &'a [Vector],
    forces: &'a mut [Vector],
}

impl<L: Stretching<Pack>, const N: usize, const Q: usize> WithSimd for Evaluate<'_, L, N, Q> {
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

/// The work of [`Kernel::predicted`].
struct Foresee<'a, L, const N: usize, const Q: usize> {
    batches: &'a [Batch<L, N, Q>],
    u: &'a [Vector],
    step: &'a [Vector],
}

impl<L: Stretching<Pack>, const N: usize, const Q: usize> WithSimd for Foresee<'_, L, N, Q> {
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

/// The work of [`Kernel::stiffness`].
struct Stiffness<'a, L, const N: usize, const Q: usize> {
    all: &'a Batches<L, N, Q>,
    u: &'a [Vector],
    predicted: Option<&'a VolumeStrain<Q>>,
    own: Vec<Nine>,
    pattern: &'a Pattern,
    blocks: &'a mut [Block],
}

impl<L: Stretching<Pack>, const N: usize, const Q: usize> WithSimd for Stiffness<'_, L, N, Q> {
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

impl<L: Stretching<Pack>, const N: usize, const Q: usize> Batch<L, N, Q> {
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
        for (q, (gradients, weight)) in self.gradients.iter().zip(&self.weights).enumerate() {
            let state = PackedGradient::new(gradient(&u, gradients))?;
            energy += *weight * self.material.energy(&state)?;
            let mut stress = self.material.stress(&state, *weight);
            if let Some(fibres) = &self.fibres {
                energy += fibres.add_stress(q, &state, *weight, &mut stress)?;
            }
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
            let state = PackedGradient::new(gradient(&u, gradients))?;
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
            let state = PackedGradient::new(gradient(&u, gradients))?;
            let ln_j = predicted.map_or(state.ln_j, |strain| strain[q]);
            self.material.add_tangent((&state, ln_j), *weight, gradients, blocks);
            if let Some(fibres) = &self.fibres {
                fibres.add_tangent(q, &state, *weight, (gradients, blocks));
            }
        }
        Some(())
    }
}

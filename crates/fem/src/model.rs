//! Energy, forces and stiffness of a meshed body.

use crate::batch::{Kernel, VolumeStrain, kernel};
use crate::element::{Elements, kept};
use crate::material::{Fibres, Gradient, Material};
use crate::pattern::{Block, Pattern, Storage, block, pairs};
use crate::sliding::Slide;
use crate::surfaces::Surfaces;
use std::sync::Arc;
use supine_space::{Matrix, Vector};

/// A body on its stress-free shape; copies share it.
#[derive(Clone, Debug)]
pub(crate) struct Model<const N: usize, const Q: usize> {
    /// Its elements.
    pub(crate) elements: Arc<Elements<N, Q>>,
    /// What each element is made of.
    pub(crate) materials: Arc<[Material]>,
    /// Fibres on its stress-free shape.
    pub(crate) fibres: Option<Arc<Fibres<Q>>>,
    /// What acts on its boundary.
    pub(crate) surfaces: Arc<Surfaces<N>>,
    kernel: Arc<dyn Kernel<N, Q>>,
    /// Nodes that slide on a rigid body.
    pub(crate) slide: Option<Slide>,
}

/// Volume ratio det F over all quadrature points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VolumeRatio {
    /// Smallest.
    pub(crate) min: f64,
    /// Largest.
    pub(crate) max: f64,
    /// The element with the smallest.
    pub(crate) worst: usize,
}

/// An element is turned inside out (det F ≤ 0 at a quadrature point).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Folded(pub(crate) usize);

impl<const N: usize, const Q: usize> Model<N, Q> {
    /// `elements` made of `materials`, and of `fibres` if there are any.
    pub(crate) fn new(
        elements: impl Into<Arc<Elements<N, Q>>>,
        materials: Vec<Material>,
        fibres: Option<Fibres<Q>>,
    ) -> Self {
        let elements = elements.into();
        let kernel = kernel(&elements, &materials, fibres.as_ref());
        let (materials, fibres) = (materials.into(), fibres.map(Arc::new));
        let surfaces = Arc::default();
        Self { elements, materials, fibres, surfaces, kernel, slide: None }
    }

    /// The body with what acts on its boundary.
    pub(crate) fn bounded(self, surfaces: Surfaces<N>) -> Self {
        Self { surfaces: Arc::new(surfaces), ..self }
    }

    /// The body without some of its elements.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        let fibres = self.fibres.as_ref().map(|fibres| fibres.only(keep));
        Self::new(self.elements.only(keep), kept(&self.materials, keep), fibres)
            .bounded(self.surfaces.only(keep))
    }

    /// The body with nodes that slide.
    pub(crate) fn sliding(&self, slide: Option<Slide>) -> Self {
        Self { slide, ..self.clone() }
    }

    fn deformation(&self, e: usize, q: usize, u: &[Vector]) -> Option<Gradient> {
        Gradient::new(self.elements.gradient(e, q, u))
    }

    fn points(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.elements.nodes.len()).flat_map(|e| (0..Q).map(move |q| (e, q)))
    }

    /// Elastic energy ∫ Ψ (mN mm) and internal nodal forces ∫ P grad N_a (mN) one element after the
    /// other.
    ///
    /// # Errors
    /// When an element is turned inside out.
    #[cfg(test)]
    pub(crate) fn plain(&self, u: &[Vector]) -> Result<(f64, Vec<Vector>), Folded> {
        let mut energy = 0.0;
        let mut forces = vec![Vector::zeros(); u.len()];
        for (e, q) in self.points() {
            let d = self.deformation(e, q, u).ok_or(Folded(e))?;
            let fibres = self.fibres.as_ref().map_or(0.0, |fibres| fibres.energy(e, q, &d));
            energy += self.elements.weights[e][q] * (self.materials[e].energy(&d) + fibres);
            self.add_stress(e, q, &self.stress(e, q, &d), &mut forces);
        }
        let boundary = self.surfaces.evaluate(&self.elements.nodes, u, &mut forces);
        Ok((energy + boundary, forces))
    }

    /// Elastic energy ∫ Ψ (mN mm) and internal nodal forces ∫ P grad N_a (mN), those of the
    /// boundary included.
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn evaluate(&self, u: &[Vector]) -> Option<(f64, Vec<Vector>)> {
        let mut forces = vec![Vector::zeros(); u.len()];
        let energy = self.kernel.evaluate(u, &mut forces)?;
        let boundary = self.surfaces.evaluate(&self.elements.nodes, u, &mut forces);
        Some((energy + boundary, forces))
    }

    /// Internal nodal forces that grow with the moduli of the tissue, mN.
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn forces_by_modulus(&self, u: &[Vector]) -> Option<Vec<Vector>> {
        let (_, mut forces) = self.evaluate(u)?;
        self.surfaces.leave_out_given(&self.elements.nodes, u, &mut forces);
        Some(forces)
    }

    /// ln J after a `step` (mm) from `u`, to first order.
    ///
    /// Newton's method for displacement and pressure as separate fields, the pressure condensed,
    /// differs from that for the displacement alone by this only: its stiffness has the pressure
    /// that the last step predicted. A long step that turns tissue also swells it, since it goes
    /// straight; the pressure of that swelling, many times that of the solution in nearly
    /// incompressible tissue, then stays out of the stiffness. See Magisano, Leonetti and Garcea,
    /// Comput. Methods Appl. Mech. Engrg. 313 (2017) 986.
    ///
    /// `None` when an element is turned inside out at `u`.
    pub(crate) fn predicted(&self, u: &[Vector], step: &[Vector]) -> Option<VolumeStrain<Q>> {
        self.kernel.predicted(u, step)
    }

    /// Fills `blocks` with the stiffness
    ///
    /// K_ab = Σ_q w [m (g_a · g_b) I − c h_b h_aᵀ + λ h_a h_bᵀ + k s_a s_bᵀ], g_a = grad N_a, h_a =
    /// F^-T g_a, s_a = F g_a − h_a ([`crate::material`]), and that of the boundary; with the
    /// `predicted` volume strain in place of ln J in c, if there is one; projected where nodes
    /// slide.
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn stiffness(
        &self,
        u: &[Vector],
        predicted: Option<&VolumeStrain<Q>>,
        pattern: &Pattern,
        blocks: &mut [Block],
    ) -> Option<()> {
        self.kernel.stiffness(u, predicted, pattern, blocks)?;
        self.surfaces.add_stiffness(&self.elements.nodes, u, pattern, blocks);
        if let Some(slide) = &self.slide {
            let forces = self.forces_at(&slide.sliding.around, u)?;
            pattern.constrain(&slide.planes(u, &forces)?, blocks);
        }
        Some(())
    }

    /// Internal nodal forces (mN) at nodes of which all elements are among `elements`; `None` when
    /// one of these is turned inside out.
    pub(crate) fn forces_at(&self, elements: &[u32], u: &[Vector]) -> Option<Vec<Vector>> {
        let mut forces = vec![Vector::zeros(); u.len()];
        for &e in elements {
            for q in 0..Q {
                let d = self.deformation(e as usize, q, u)?;
                let stress = self.stress(e as usize, q, &d);
                self.add_stress(e as usize, q, &stress, &mut forces);
            }
        }
        self.surfaces.evaluate(&self.elements.nodes, u, &mut forces);
        Some(forces)
    }

    /// Fills `blocks` with the stiffness whose material tangent has its eigenvalues raised to
    /// `floor` (a share of μ) at every quadrature point, which makes it positive definite; where
    /// nodes slide without the curvature of the surface, which may not be.
    ///
    /// `None` when an element is turned inside out.
    pub(crate) fn shifted_stiffness(
        &self,
        u: &[Vector],
        floor: f64,
        pattern: &Pattern,
        blocks: &mut [Block],
    ) -> Option<()> {
        blocks.fill([0.0; 9]);
        for e in 0..self.elements.nodes.len() {
            let material = &self.materials[e];
            let mut own = [[Matrix::zeros(); N]; N];
            for q in 0..Q {
                let d = self.deformation(e, q, u)?;
                let weight = self.elements.weights[e][q];
                let g = &self.elements.gradients[e][q];
                let tangent = material.tangent(&d, weight, g);
                let shifts = material.shift(&d, floor * material.shear_kpa());
                let fibres = self.fibres.as_ref().map(|f| f.tangent((e, q), &d, weight, g));
                for (a, b) in pairs(N, Storage::Lower) {
                    let block = &mut own[a][b];
                    tangent.add_to(block, a, b);
                    fibres.iter().for_each(|fibres| fibres.add_to(block, a, b));
                    for (shift, m) in &shifts {
                        *block += (m * g[a]) * (m * g[b] * (weight * shift)).transpose();
                    }
                }
            }
            for ((a, b), place) in pairs(N, Storage::Lower).zip(pattern.places::<N>(e)) {
                place.add(&block(&own[a][b]), blocks);
            }
        }
        self.surfaces.add_stiffness(&self.elements.nodes, u, pattern, blocks);
        if let Some(slide) = &self.slide {
            let mut planes = slide.planes(u, &vec![Vector::zeros(); u.len()])?;
            planes.iter_mut().for_each(|plane| plane.stiffness = Matrix::zeros());
            pattern.constrain(&planes, blocks);
        }
        Some(())
    }

    /// Change of the internal nodal forces (mN) when the displacement changes by `v` (mm) at nodes
    /// of `elements` alone: ∫ dP grad N_a, and what the boundary gives for `v`.
    ///
    /// `None` when one of these elements is turned inside out.
    pub(crate) fn slope(
        &self,
        elements: &[u32],
        u: &[Vector],
        v: &[Vector],
    ) -> Option<Vec<Vector>> {
        let mut forces = vec![Vector::zeros(); u.len()];
        for &e in elements {
            let e = e as usize;
            for q in 0..Q {
                let d = self.deformation(e, q, u)?;
                let df = self.elements.gradient(e, q, v);
                let mut stress = self.materials[e].stress_change(&d, &df);
                if let Some(fibres) = &self.fibres {
                    stress += fibres.stress_change(e, q, &d, &df);
                }
                self.add_stress(e, q, &stress, &mut forces);
            }
        }
        self.surfaces.add_slope(&self.elements.nodes, u, v, &mut forces);
        Some(forces)
    }

    /// P of the material and its fibres, kPa.
    fn stress(&self, e: usize, q: usize, d: &Gradient) -> Matrix {
        let stress = self.materials[e].stress(d);
        self.fibres.as_ref().map_or(stress, |fibres| stress + fibres.stress(e, q, d))
    }

    /// Adds the nodal forces w P grad N_a (mN) of a stress P (kPa) at a quadrature point.
    fn add_stress(&self, e: usize, q: usize, stress: &Matrix, forces: &mut [Vector]) {
        let stress = stress * self.elements.weights[e][q];
        for (node, g) in self.elements.nodes[e].iter().zip(&self.elements.gradients[e][q]) {
            forces[*node as usize] += stress * g;
        }
    }

    /// Range of det F.
    ///
    /// # Errors
    /// When an element is turned inside out.
    pub(crate) fn volume_ratio(&self, u: &[Vector]) -> Result<VolumeRatio, Folded> {
        let mut range = VolumeRatio { min: f64::INFINITY, max: 0.0, worst: 0 };
        for (e, q) in self.points() {
            let j = self.deformation(e, q, u).ok_or(Folded(e))?.j;
            if j < range.min {
                (range.min, range.worst) = (j, e);
            }
            range.max = range.max.max(j);
        }
        Ok(range)
    }
}

#[cfg(test)]
#[path = "model_tests.rs"]
mod tests;

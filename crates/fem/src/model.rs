//! Energy, forces and stiffness of a meshed body.

use crate::element::Elements;
use crate::material::{Deformation, NeoHookean};
use crate::pattern::Pattern;
use supine_space::{Matrix, Vector};

/// A body on its stress-free shape.
#[derive(Clone, Debug)]
pub(crate) struct Model<const N: usize, const Q: usize> {
    /// Its elements.
    pub(crate) elements: Elements<N, Q>,
    /// What each element is made of.
    pub(crate) materials: Vec<NeoHookean>,
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
    fn deformation(&self, e: usize, q: usize, u: &[Vector]) -> Option<Deformation> {
        Deformation::new(self.elements.gradient(e, q, u))
    }

    fn points(&self) -> impl Iterator<Item = (usize, usize)> {
        (0..self.elements.nodes.len()).flat_map(|e| (0..Q).map(move |q| (e, q)))
    }

    /// Elastic energy ∫ Ψ, mN mm; infinite where an element is turned inside out.
    pub(crate) fn energy(&self, u: &[Vector]) -> f64 {
        let mut energy = 0.0;
        for (e, q) in self.points() {
            let Some(d) = self.deformation(e, q, u) else { return f64::INFINITY };
            energy += self.elements.weights[e][q] * self.materials[e].energy(&d);
        }
        energy
    }

    /// Internal nodal forces ∫ P grad N_a, mN.
    ///
    /// # Errors
    /// When an element is turned inside out.
    pub(crate) fn forces(&self, u: &[Vector]) -> Result<Vec<Vector>, Folded> {
        let mut forces = vec![Vector::zeros(); u.len()];
        for (e, q) in self.points() {
            let d = self.deformation(e, q, u).ok_or(Folded(e))?;
            let stress = self.materials[e].stress(&d) * self.elements.weights[e][q];
            for (node, g) in self.elements.nodes[e].iter().zip(&self.elements.gradients[e][q]) {
                forces[*node as usize] += stress * g;
            }
        }
        Ok(forces)
    }

    /// Fills `values` with the stiffness ∂f/∂u, mN/mm, on the places of `pattern`.
    ///
    /// K_ab = Σ_q w_q [ μ (g_a · g_b) I − c h_b h_aᵀ + λ h_a h_bᵀ ], g_a = grad N_a,
    /// h_a = F^-T g_a, c = λ ln J − μ. With a `floor` (a share of μ) the eigenvalues of the material tangent
    /// are lifted to it at every quadrature point, which makes the stiffness positive definite.
    ///
    /// # Errors
    /// When an element is turned inside out.
    pub(crate) fn stiffness(
        &self,
        u: &[Vector],
        floor: Option<f64>,
        pattern: &Pattern,
        values: &mut [f64],
    ) -> Result<(), Folded> {
        values.fill(0.0);
        for e in 0..self.elements.nodes.len() {
            let material = &self.materials[e];
            let lambda = material.lambda;
            let mut blocks = [[Matrix::zeros(); N]; N];
            for q in 0..Q {
                let d = self.deformation(e, q, u).ok_or(Folded(e))?;
                let weight = self.elements.weights[e][q];
                let g = &self.elements.gradients[e][q];
                let h = g.map(|g| d.inverse_transpose * g);
                let (mu, c) = (weight * material.mu, weight * material.c(&d));
                let lifts =
                    floor.map_or_else(Vec::new, |floor| material.lift(&d, floor * material.mu));
                for (a, b) in pairs::<N>(pattern, e) {
                    let block = &mut blocks[a][b];
                    *block += h[a] * (h[b] * (weight * lambda)).transpose();
                    *block -= h[b] * (h[a] * c).transpose();
                    let own = mu * g[a].dot(&g[b]);
                    (0..3).for_each(|i| block[(i, i)] += own);
                    for (lift, m) in &lifts {
                        *block += (m * g[a]) * (m * g[b] * (weight * lift)).transpose();
                    }
                }
            }
            for (a, b) in pairs::<N>(pattern, e) {
                pattern.add(&self.elements.nodes[e], (e, a, b), &blocks[a][b], values);
            }
        }
        Ok(())
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

/// The node pairs (row, column) of an element whose blocks are stored.
pub(crate) fn pairs<const N: usize>(
    pattern: &Pattern,
    element: usize,
) -> impl Iterator<Item = (usize, usize)> {
    (0..N)
        .flat_map(|a| (0..N).map(move |b| (a, b)))
        .filter(move |&(a, b)| pattern.holds::<N>(element, a, b))
}

#[cfg(test)]
#[path = "model_tests.rs"]
mod tests;

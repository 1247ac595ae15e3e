//! Skin as a membrane on the tissue.
//!
//! Skin is thin and stiff against the tissue below: it resists being stretched, not being bent. It
//! is an incompressible neo-Hookean membrane of thickness h and small-strain modulus E, which is
//! stretched by λ in every direction in its plane where the tissue is free of stress. With ξ the
//! parent coordinates of a face, G and g its metrics ∂X/∂ξ · ∂X/∂ξ and ∂x/∂ξ · ∂x/∂ξ in the
//! stress-free and the present shape, the energy is
//!
//! ∫ h μ/2 [λ² tr(G⁻¹ g) + det G / (λ⁴ det g) − 3] dA(X), μ = E/3:
//!
//! W = μ/2 (λ₁² + λ₂² + (λ₁ λ₂)⁻² − 3), plane stress. Source: Green and Adkins, Large Elastic
//! Deformations, 1960, ch. 4. Its weight is that of the tissue in its place.
//!
//! Skin that is stretched in advance pulls at the tissue without any load. Where the CT shape is
//! taken for free of stress these pulls are taken off: they are among what keeps it in balance.

use crate::boundary::{Face, faces_on, renumbered};
use crate::element::parent_slopes;
use crate::foundation::TRIANGLE_RULE;
use crate::params::Membrane;
use crate::pattern::{Block, Pattern, block, pairs};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Matrix, Vector};

/// Slopes of a face's shape functions by its two parent coordinates; zero for nodes off it.
type Slopes<const N: usize> = [[f64; 2]; N];

/// Points of the rule for triangles.
const POINTS: usize = 6;

/// The skin of a body whose elements have `N` nodes.
#[derive(Clone, Debug)]
pub(crate) struct Skin<const N: usize> {
    /// h μ, mN/mm, and λ.
    tension: f64,
    stretch: f64,
    faces: Arc<[Face]>,
    /// The two tangents ∂X/∂ξ of each face at each point, mm.
    rest: Arc<[[Tangents; POINTS]]>,
    /// Nodal forces that are taken off, mN.
    borne: Option<Arc<[Vector]>>,
}

type Tangents = [Vector; 2];

/// Two tangents with their reciprocal ones.
struct Frame {
    tangents: Tangents,
    dual: Tangents,
    /// det of the metric.
    det: f64,
}

impl Frame {
    fn new(tangents: Tangents) -> Self {
        let [a, b] = &tangents;
        let (aa, ab, bb) = (a.norm_squared(), a.dot(b), b.norm_squared());
        let det = aa * bb - ab * ab;
        let dual = [(a * bb - b * ab) / det, (b * aa - a * ab) / det];
        Self { tangents, dual, det }
    }

    /// The surface gradient of a function with these slopes.
    fn gradient(&self, [s, t]: [f64; 2]) -> Vector {
        self.dual[0] * s + self.dual[1] * t
    }

    /// The map that takes the tangents of `from` to these.
    fn map_from(&self, from: &Self) -> Matrix {
        self.tangents[0] * from.dual[0].transpose() + self.tangents[1] * from.dual[1].transpose()
    }
}

/// A point of a face in both shapes.
struct Place<'a, const N: usize> {
    slopes: &'a Slopes<N>,
    rest: Frame,
    now: Frame,
    /// h μ dA, mN mm.
    weight: f64,
    /// det G / (λ⁴ det g).
    thinned: f64,
}

impl<const N: usize> Place<'_, N> {
    /// M_a in the stress-free and n_a in the present shape: the surface gradients of N_a.
    fn gradients(&self, a: usize) -> [Vector; 2] {
        [self.rest.gradient(self.slopes[a]), self.now.gradient(self.slopes[a])]
    }
}

impl<const N: usize> Skin<N> {
    /// The skin of `mesh` with nodes at `positions` (mm), free of stress but for its stretch.
    pub(crate) fn new(
        mesh: &TetMesh,
        nodes: &[[u32; N]],
        positions: &[Vector],
        membrane: &Membrane,
    ) -> Self {
        let faces: Arc<[Face]> = faces_on(mesh, BoundaryTag::Skin).into();
        let rest = tangents(&faces, nodes, positions).into();
        let tension = membrane.thickness_mm * membrane.young_kpa / 3.0;
        Self { tension, stretch: membrane.stretch, faces, rest, borne: None }
    }

    /// The same in balance as it is without a displacement.
    pub(crate) fn borne(self, nodes: &[[u32; N]], count: usize) -> Self {
        let (zero, mut forces) = (vec![Vector::zeros(); count], vec![Vector::zeros(); count]);
        self.evaluate(nodes, &zero, &mut forces);
        Self { borne: Some(forces.into()), ..self }
    }

    /// The same at those elements that are to be kept, which then are renumbered. What was taken
    /// off stays so: beside skin that is cut away, the rest draws back.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        let number = renumbered(keep);
        let both = self.faces.iter().zip(self.rest.iter()).filter(|(face, _)| keep[face.element]);
        let (faces, rest): (Vec<_>, Vec<_>) = both
            .map(|(face, rest)| (Face { element: number[face.element], ..*face }, *rest))
            .unzip();
        Self { faces: faces.into(), rest: rest.into(), ..self.clone() }
    }

    /// The same on another stress-free shape, with nothing taken off.
    pub(crate) fn at_rest(&self, nodes: &[[u32; N]], rest: &[Vector]) -> Self {
        let rest = tangents(&self.faces, nodes, rest).into();
        Self { rest, borne: None, ..self.clone() }
    }

    /// Energy, mN mm; adds the nodal forces f_a = Σ_q w S^{αβ} ∂_α N_a ∂_β x, mN, with S = λ² G⁻¹ −
    /// r g⁻¹, r = det G / (λ⁴ det g).
    pub(crate) fn evaluate(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) -> f64 {
        let mut energy = 0.0;
        self.each(nodes, u, |face, own, place| {
            let strain = place.now.map_from(&place.rest).norm_squared();
            let squared = self.stretch * self.stretch;
            energy += 0.5 * place.weight * (squared * strain + place.thinned - 3.0);
            for &a in own {
                forces[nodes[face.element][a] as usize] += self.force(place, a);
            }
        });
        if let Some(borne) = &self.borne {
            forces.iter_mut().zip(borne.iter()).for_each(|(force, borne)| *force -= borne);
            energy -= u.iter().zip(borne.iter()).map(|(u, borne)| u.dot(borne)).sum::<f64>();
        }
        energy
    }

    /// Adds ∂f/∂x, mN/mm:
    ///
    /// w {S_ab I + r [(n_a · n_b) T + n_b n_aᵀ + 2 n_a n_bᵀ]}, T the projection to the face.
    pub(crate) fn add_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        self.add(nodes, u, pattern, blocks, |place, a, b| self.change(place, a, b));
    }

    /// Adds ∂f/∂X at fixed x, mN/mm:
    ///
    /// w {s_a M_bᵀ − λ² [(M_a · M_b) F + F M_b M_aᵀ] − 2 r n_a M_bᵀ}, s_a the force over w and F =
    /// ∂x/∂X along the face.
    pub(crate) fn add_rest_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        let squared = self.stretch * self.stretch;
        self.add(nodes, u, pattern, blocks, |place, a, b| {
            let ([m_a, n_a], [m_b, _]) = (place.gradients(a), place.gradients(b));
            let map = place.now.map_from(&place.rest);
            let turned = map * m_a.dot(&m_b) + map * m_b * m_a.transpose();
            let thinned = n_a * (2.0 * place.thinned);
            self.force(place, a) * m_b.transpose()
                - (turned * squared + thinned * m_b.transpose()) * place.weight
        });
    }

    /// Adds the change of the nodal forces with `v`, mN.
    pub(crate) fn add_slope(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        v: &[Vector],
        forces: &mut [Vector],
    ) {
        self.each(nodes, u, |face, own, place| {
            let element = nodes[face.element];
            for &a in own {
                for &b in own {
                    forces[element[a] as usize] +=
                        self.change(place, a, b) * v[element[b] as usize];
                }
            }
        });
    }

    /// What a point gives to the force on node a: w S^{αβ} ∂_α N_a ∂_β x = w (λ² F M_a − r n_a).
    fn force(&self, place: &Place<'_, N>, a: usize) -> Vector {
        let [m_a, n_a] = place.gradients(a);
        let pulled = place.now.map_from(&place.rest) * m_a * (self.stretch * self.stretch);
        (pulled - n_a * place.thinned) * place.weight
    }

    /// What a point gives to ∂f_a/∂x_b.
    fn change(&self, place: &Place<'_, N>, a: usize, b: usize) -> Matrix {
        let ([m_a, n_a], [m_b, n_b]) = (place.gradients(a), place.gradients(b));
        let (squared, r) = (self.stretch * self.stretch, place.thinned);
        let along = n_a.dot(&n_b);
        let geometric = Matrix::identity() * (squared * m_a.dot(&m_b) - r * along);
        let plane = place.now.map_from(&place.now);
        let thinned = plane * along + n_b * n_a.transpose() + n_a * n_b.transpose() * 2.0;
        (geometric + thinned * r) * place.weight
    }

    /// Adds what `change` gives for each pair of nodes of each face, at each point.
    fn add(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
        change: impl Fn(&Place<'_, N>, usize, usize) -> Matrix,
    ) {
        self.each(nodes, u, |face, own, place| {
            let places = pattern.places::<N>(face.element);
            for ((a, b), to) in pairs(N, pattern.storage).zip(places) {
                if own.contains(&a) && own.contains(&b) {
                    to.add(&block(&change(place, a, b)), blocks);
                }
            }
        });
    }

    /// Calls `with` (face, its nodes among those of its element, place) for each point of each
    /// face.
    fn each(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        mut with: impl FnMut(&Face, &[usize], &Place<'_, N>),
    ) {
        for (face, rest) in self.faces.iter().zip(self.rest.iter()) {
            let own = face.nodes::<N>();
            for ((slopes, share), rest) in points::<N>(face.own).iter().zip(rest) {
                let moved = tangents_at(slopes, &nodes[face.element], u);
                let now = Frame::new([rest[0] + moved[0], rest[1] + moved[1]]);
                let rest = Frame::new(*rest);
                let weight = self.tension * share * 0.5 * rest.det.sqrt();
                let thinned = rest.det / (self.stretch.powi(4) * now.det);
                with(face, &own, &Place { slopes, rest, now, weight, thinned });
            }
        }
    }
}

/// The points of the rule on the face with these corners of an element: slopes of the shape
/// functions and share of the face.
fn points<const N: usize>(corners: [usize; 3]) -> [(Slopes<N>, f64); POINTS] {
    let axes = [Vector::zeros(), Vector::x(), Vector::y(), Vector::z()];
    let along = [1, 2].map(|k| axes[corners[k]] - axes[corners[0]]);
    std::array::from_fn(|q| {
        let (share, c) = TRIANGLE_RULE[q / 3];
        let mut l = [0.0; 4];
        for (k, corner) in corners.into_iter().enumerate() {
            l[corner] = if k == q % 3 { 1.0 - 2.0 * c } else { c };
        }
        (parent_slopes::<N>(l).map(|slope| along.map(|way| slope.dot(&way))), share)
    })
}

/// Σ v_a ∂N_a over the nodes of an element.
fn tangents_at<const N: usize>(slopes: &Slopes<N>, element: &[u32; N], v: &[Vector]) -> Tangents {
    let mut sum = [Vector::zeros(); 2];
    for (node, slope) in element.iter().zip(slopes) {
        for (sum, slope) in sum.iter_mut().zip(slope) {
            *sum += v[*node as usize] * *slope;
        }
    }
    sum
}

/// The tangents of each face at each point, nodes at `positions`.
fn tangents<const N: usize>(
    faces: &[Face],
    nodes: &[[u32; N]],
    positions: &[Vector],
) -> Vec<[Tangents; POINTS]> {
    let of = |face: &Face| {
        points::<N>(face.own)
            .map(|(slopes, _)| tangents_at(&slopes, &nodes[face.element], positions))
    };
    faces.iter().map(of).collect()
}

#[cfg(test)]
#[path = "skin_tests.rs"]
mod tests;

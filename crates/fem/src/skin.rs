//! Skin as a membrane on the tissue.
//!
//! Skin is thin and stiff against the tissue below: it resists being stretched, not being bent. It
//! is an incompressible neo-Hookean membrane of thickness h and small-strain modulus E, which is
//! stretched by λ in every direction in its plane where the tissue is free of stress. With ξ the
//! parent coordinates of a face and F the map from its tangents ∂X/∂ξ, free of stress, to the
//! present ones ∂x/∂ξ, the energy per area dA(X) is h μ W, μ = E/3, of the eigenvalues of C = λ² Fᵀ
//! F in the plane of the face (`tension_field.rs`). Its weight is that of the tissue in its place.
//!
//! Skin that is stretched in advance pulls at the tissue without any load. Where the CT shape is
//! taken for free of stress these pulls are taken off: they are among what keeps it in balance.

use crate::Membrane;
use crate::boundary::{Face, faces_on, nodes_on, renumbered};
use crate::element::parent_slopes;
use crate::foundation::TRIANGLE_RULE;
use crate::pattern::{Block, Pattern, block, pair_number};
use crate::tension_field::TensionField;
use nalgebra::{Matrix2, Matrix3x2, Vector2};
use std::sync::Arc;
use supine_mesh::{BoundaryTag, TET_FACES, TetMesh};
use supine_space::{Matrix, Vector};

/// Points of the rule for triangles.
const POINTS: usize = 6;
/// Nodes of a face, at most.
const NODES: usize = 6;

/// Slopes of the shape functions of a face's nodes by its two parent coordinates; zero where it has
/// fewer nodes.
type Slopes = [[f64; 2]; NODES];

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

    /// The map that takes these tangents to `others`.
    fn map_to(&self, others: &Tangents) -> Matrix {
        others[0] * self.dual[0].transpose() + others[1] * self.dual[1].transpose()
    }
}

/// A point of a face in both shapes. Vectors of two components are along the eigenvectors of C.
struct Place {
    /// M_a, the surface gradients of the N_a free of stress.
    gradients: [Vector2<f64>; NODES],
    /// The eigenvectors, unit vectors in the face free of stress, in columns.
    principal: Matrix3x2<f64>,
    /// Where F takes them, F = ∂x/∂X along the face.
    map: Matrix3x2<f64>,
    /// λ² of what the skin is stretched in advance.
    squared: f64,
    law: TensionField,
    /// h μ dA, mN mm.
    weight: f64,
}

impl Place {
    fn new(
        slopes: &Slopes,
        rest: Tangents,
        now: Tangents,
        [tension, stretch]: [f64; 2],
        share: f64,
    ) -> Self {
        let rest = Frame::new(rest);
        let (map, squared) = (rest.map_to(&now), stretch * stretch);
        let (principal, [a1, a2]) = principal(&rest, &map);
        let gradients = slopes.map(|slope| principal.tr_mul(&rest.gradient(slope)));
        let law = TensionField::new(squared * a1, squared * a2);
        let weight = tension * share * 0.5 * rest.det.sqrt();
        Self { gradients, principal, map: map * principal, squared, law, weight }
    }

    /// S M_a, S = λ² Σ sᵢ Nᵢ Nᵢᵀ the stress over h μ.
    fn pull(&self, a: usize) -> Vector2<f64> {
        let ([along, across], own) = (self.law.pulls, self.gradients[a]);
        Vector2::new(along * own.x, across * own.y) * self.squared
    }

    /// The force on node a over the weight: F S M_a.
    fn force(&self, a: usize) -> Vector {
        self.map * self.pull(a)
    }

    /// A_ab, which gives the change of S M_a as A_ab v where C changes by λ² (M_b vᵀ + v M_bᵀ).
    fn moduli(&self, a: usize, b: usize) -> Matrix2<f64> {
        let ([d11, d12, d22], g) = (self.law.slopes, self.law.shear);
        let [m, n] = [self.gradients[a], self.gradients[b]];
        let own = Matrix2::new(
            2.0 * d11 * m.x * n.x + g * m.y * n.y,
            2.0 * d12 * m.x * n.y + g * m.y * n.x,
            2.0 * d12 * m.y * n.x + g * m.x * n.y,
            2.0 * d22 * m.y * n.y + g * m.x * n.x,
        );
        own * (self.squared * self.squared)
    }

    /// ∂f_a/∂x_b, mN/mm: (M_a · S M_b) I + F A_ab Fᵀ, times the weight.
    fn change(&self, a: usize, b: usize) -> Matrix {
        let geometric = self.gradients[a].dot(&self.pull(b));
        let material = (self.map * self.moduli(a, b)) * self.map.transpose();
        (Matrix::identity() * geometric + material) * self.weight
    }

    /// ∂f_a/∂X_b at fixed x, mN/mm, with f_a the force over the weight, times the weight:
    ///
    /// f_a M_bᵀ − (M_a · S M_b) F − F S M_b M_aᵀ − F A_ab Fᵀ F:
    ///
    /// the area grows, F and M_a shrink, and so does C.
    fn rest_change(&self, a: usize, b: usize) -> Matrix {
        let (m_a, m_b) = (self.gradients[a], self.gradients[b]);
        let grown = self.force(a) * m_b.transpose() - self.force(b) * m_a.transpose();
        let turned = self.map * m_a.dot(&self.pull(b));
        let stretched = self.map * (self.moduli(a, b) * self.map.tr_mul(&self.map));
        (grown - turned - stretched) * self.principal.transpose() * self.weight
    }
}

/// The eigenvectors of Fᵀ F in the plane of the face and its eigenvalues, the larger first.
fn principal(rest: &Frame, map: &Matrix) -> (Matrix3x2<f64>, [f64; 2]) {
    let first = rest.tangents[0].normalize();
    let second = rest.dual[1].normalize();
    let [x, y] = [map * first, map * second];
    let (xx, xy, yy) = (x.norm_squared(), x.dot(&y), y.norm_squared());
    let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
    let directions = [first * cos + second * sin, second * cos - first * sin];
    // The difference by itself: that of the eigenvalues loses nothing to rounding.
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy).hypot(2.0 * xy));
    (Matrix3x2::from_columns(&directions), [middle + half, middle - half])
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

    /// Energy, mN mm; adds the nodal forces, mN.
    pub(crate) fn evaluate(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) -> f64 {
        let mut energy = 0.0;
        self.each(nodes, u, |face, own, places| {
            energy += places.iter().map(|place| place.weight * place.law.energy).sum::<f64>();
            for (a, &node) in own.iter().enumerate() {
                let force =
                    places.iter().map(|place| place.force(a) * place.weight).sum::<Vector>();
                forces[nodes[face.element][node] as usize] += force;
            }
        });
        if let Some(borne) = &self.borne {
            forces.iter_mut().zip(borne.iter()).for_each(|(force, borne)| *force -= borne);
            energy -= u.iter().zip(borne.iter()).map(|(u, borne)| u.dot(borne)).sum::<f64>();
        }
        energy
    }

    /// Adds ∂f/∂x, mN/mm.
    pub(crate) fn add_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        self.add(nodes, u, pattern, blocks, Place::change);
    }

    /// Adds ∂f/∂X at fixed x, mN/mm.
    pub(crate) fn add_rest_stiffness(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
    ) {
        self.add(nodes, u, pattern, blocks, Place::rest_change);
    }

    /// Adds the change of the nodal forces with `v`, mN.
    pub(crate) fn add_slope(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        v: &[Vector],
        forces: &mut [Vector],
    ) {
        self.each(nodes, u, |face, own, places| {
            let element = own.iter().map(|&node| nodes[face.element][node] as usize);
            for (a, to) in element.clone().enumerate() {
                for (b, with) in element.clone().enumerate() {
                    forces[to] += summed(places, (a, b), Place::change) * v[with];
                }
            }
        });
    }

    /// Adds what `change` gives for each pair of nodes of each face, at each point.
    fn add(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        pattern: &Pattern,
        blocks: &mut [Block],
        change: impl Fn(&Place, usize, usize) -> Matrix,
    ) {
        self.each(nodes, u, |face, own, places| {
            let to = pattern.places::<N>(face.element);
            for (a, &row) in own.iter().enumerate() {
                for (b, &column) in own.iter().enumerate() {
                    if let Some(pair) = pair_number(N, pattern.storage, (row, column)) {
                        to[pair].add(&block(&summed(places, (a, b), &change)), blocks);
                    }
                }
            }
        });
    }

    /// Calls `with` (face, its nodes among those of its element, its points) for each face.
    fn each(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        mut with: impl FnMut(&Face, &[usize], &[Place; POINTS]),
    ) {
        let sides = TET_FACES.map(Side::new::<N>);
        for (face, rest) in self.faces.iter().zip(self.rest.iter()) {
            let side = &sides[face.side];
            let places = std::array::from_fn(|q| {
                let ((slopes, share), rest) = (&side.points[q], rest[q]);
                let moved = side.tangents(slopes, &nodes[face.element], u);
                let now = [rest[0] + moved[0], rest[1] + moved[1]];
                Place::new(slopes, rest, now, [self.tension, self.stretch], *share)
            });
            with(face, &side.nodes, &places);
        }
    }
}

/// What `change` gives for a pair of nodes at all points.
fn summed(
    places: &[Place; POINTS],
    (a, b): (usize, usize),
    change: impl Fn(&Place, usize, usize) -> Matrix,
) -> Matrix {
    places.iter().map(|place| change(place, a, b)).sum()
}

/// What faces on the same side of their elements have in common.
struct Side {
    /// Nodes among those of an element, in rising order.
    nodes: Vec<usize>,
    /// The points of the rule: slopes and share of the face.
    points: [(Slopes, f64); POINTS],
}

impl Side {
    /// The face with these corners of elements with `N` nodes.
    fn new<const N: usize>(corners: [usize; 3]) -> Self {
        let axes = [Vector::zeros(), Vector::x(), Vector::y(), Vector::z()];
        let along = [1, 2].map(|k| axes[corners[k]] - axes[corners[0]]);
        let nodes = nodes_on::<N>(corners);
        let points = std::array::from_fn(|q| {
            let (share, c) = TRIANGLE_RULE[q / 3];
            let mut l = [0.0; 4];
            for (k, corner) in corners.into_iter().enumerate() {
                l[corner] = if k == q % 3 { 1.0 - 2.0 * c } else { c };
            }
            let all = parent_slopes::<N>(l);
            let mut slopes = [[0.0; 2]; NODES];
            for (slope, &node) in slopes.iter_mut().zip(&nodes) {
                *slope = along.map(|way| all[node].dot(&way));
            }
            (slopes, share)
        });
        Self { nodes, points }
    }

    /// Σ v_a ∂N_a over the nodes of the face of an element.
    fn tangents(&self, slopes: &Slopes, element: &[u32], v: &[Vector]) -> Tangents {
        let mut sum = [Vector::zeros(); 2];
        for (&node, slope) in self.nodes.iter().zip(slopes) {
            for (sum, slope) in sum.iter_mut().zip(slope) {
                *sum += v[element[node] as usize] * *slope;
            }
        }
        sum
    }
}

/// The tangents of each face at each point, nodes at `positions`.
fn tangents<const N: usize>(
    faces: &[Face],
    nodes: &[[u32; N]],
    positions: &[Vector],
) -> Vec<[Tangents; POINTS]> {
    let sides = TET_FACES.map(Side::new::<N>);
    let of = |face: &Face| {
        let side = &sides[face.side];
        let at =
            |(slopes, _): &(Slopes, f64)| side.tangents(slopes, &nodes[face.element], positions);
        side.points.each_ref().map(at)
    };
    faces.iter().map(of).collect()
}

#[cfg(test)]
#[path = "skin_tests.rs"]
mod tests;

//! Springs on the cut in place of the tissue beyond the region.
//!
//! The energy ½ ∫ k |u|² dA over the cut of the CT shape, with u the displacement from the
//! stress-free shape, adds the traction −k u (k in kPa/mm: a Winkler foundation). The area stays
//! that of the CT shape, so that the forces are linear in u whatever the rest state.
//!
//! Where no stiffness is given, k = π μ / 2h: beyond the cut a layer of thickness h goes on, glued
//! to the chest wall and free at the skin. What is sheared at its end dies away as sin(π n / 2h)
//! exp(−π s / 2h), the lowest solution of Laplace's equation with these two boundaries (n from wall
//! to skin, s along the layer), and bears the traction μ ∂u/∂s = −(π μ / 2h) u. The layer's own
//! weight is left out.

use crate::body::Body;
use crate::boundary::{Face, faces_on, renumbered};
use crate::element::shape;
use crate::material::Material;
use crate::pattern::{Block, Pattern, pairs};
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use supine_mesh::{BoundaryTag, Edges, Order, TetMesh};
use supine_space::{Point, Vector};

/// Weights and barycentric coordinates of a rule for triangles, exact to degree 4 (Dunavant 1985,
/// table II); the coordinates are (c, c, 1 − 2c) in each order.
pub(crate) const TRIANGLE_RULE: [(f64, f64); 2] = [
    (0.223_381_589_678_011, 0.445_948_490_915_965),
    (0.109_951_743_655_322, 0.091_576_213_509_771),
];

/// Springs of a body whose elements have `N` nodes.
#[derive(Clone, Debug)]
pub(crate) struct Foundation<const N: usize> {
    faces: Vec<SpringFace<N>>,
    /// Mean k over the cut, kPa/mm.
    pub(crate) mean_kpa_mm: f64,
    /// k was given: it does not grow with the moduli.
    given: bool,
}

/// Springs of one face of the cut.
#[derive(Clone, Debug)]
struct SpringFace<const N: usize> {
    element: usize,
    /// ∫ k N_a N_b dA, mN/mm; zero for nodes off the face.
    stiffness: [[f64; N]; N],
}

impl<const N: usize> Foundation<N> {
    /// Springs of stiffness `kpa_mm` everywhere, or of that which the layer beyond each face has.
    /// `materials` are those of the tetrahedra.
    pub(crate) fn new(mesh: &TetMesh, materials: &[Material], kpa_mm: Option<f64>) -> Self {
        let (mut faces, mut area, mut sum) = (Vec::new(), 0.0, 0.0);
        for (face, kpa_mm) in cut_springs_of(mesh, materials, kpa_mm) {
            let total = kpa_mm * face.area_mm2;
            area += face.area_mm2;
            sum += total;
            let stiffness = products::<N>(face.own(), total);
            faces.push(SpringFace { element: face.element, stiffness });
        }
        let mean_kpa_mm = if area > 0.0 { sum / area } else { 0.0 };
        Self { faces, mean_kpa_mm, given: kpa_mm.is_some() }
    }

    /// Springs on faces with ∫ k dA given for each, mN/mm.
    pub(crate) fn given(faces: impl Iterator<Item = (Face, f64)>) -> Self {
        let spring = |(face, total): (Face, f64)| SpringFace {
            element: face.element,
            stiffness: products::<N>(face.own(), total),
        };
        Self { faces: faces.map(spring).collect(), mean_kpa_mm: 0.0, given: true }
    }

    /// The springs at those elements that are to be kept, which then are renumbered.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        let number = renumbered(keep);
        let faces = self.faces.iter().filter(|face| keep[face.element]);
        let faces = faces.map(|face| SpringFace { element: number[face.element], ..face.clone() });
        Self { faces: faces.collect(), ..*self }
    }

    /// Energy ½ ∫ k |u|² dA, mN mm.
    pub(crate) fn energy(&self, nodes: &[[u32; N]], u: &[Vector]) -> f64 {
        let mut energy = 0.0;
        self.each(nodes, |a, b, k| energy += 0.5 * k * u[a].dot(&u[b]));
        energy
    }

    /// Adds `factor` times the nodal forces ∫ k N_a u dA, mN.
    pub(crate) fn add_forces(
        &self,
        nodes: &[[u32; N]],
        u: &[Vector],
        factor: f64,
        forces: &mut [Vector],
    ) {
        self.each(nodes, |a, b, k| forces[a] += u[b] * (factor * k));
    }

    /// Adds `factor` times the stiffness ∂f/∂u, mN/mm, to the blocks of `pattern`.
    pub(crate) fn add_stiffness(&self, factor: f64, pattern: &Pattern, blocks: &mut [Block]) {
        for face in &self.faces {
            let places = pattern.places::<N>(face.element);
            for ((a, b), place) in pairs(N, pattern.storage).zip(places) {
                let k = factor * face.stiffness[a][b];
                if k.abs() > 0.0 {
                    place.add(&[k, 0.0, 0.0, 0.0, k, 0.0, 0.0, 0.0, k], blocks);
                }
            }
        }
    }

    /// Takes off the nodal forces if they do not grow with the moduli, mN.
    pub(crate) fn leave_out_given(&self, nodes: &[[u32; N]], u: &[Vector], forces: &mut [Vector]) {
        if self.given {
            self.add_forces(nodes, u, -1.0, forces);
        }
    }

    /// Calls `with` (node, node, stiffness) for each pair of nodes of each face.
    fn each(&self, nodes: &[[u32; N]], mut with: impl FnMut(usize, usize, f64)) {
        for face in &self.faces {
            let element = &nodes[face.element];
            for (a, row) in element.iter().zip(&face.stiffness) {
                for (b, k) in element.iter().zip(row).filter(|(_, k)| k.abs() > 0.0) {
                    with(*a as usize, *b as usize, *k);
                }
            }
        }
    }
}

/// The faces of the cut with their stiffness, kPa/mm: the one that is given, or that of the layer
/// beyond.
fn cut_springs_of(mesh: &TetMesh, materials: &[Material], kpa_mm: Option<f64>) -> Vec<(Face, f64)> {
    let thickness = if kpa_mm.is_none() { cut_thickness(mesh) } else { BTreeMap::new() };
    let stiffness = |face: &Face| {
        let of_layer = || {
            let mean = face.points.iter().map(|p| thickness[p]).sum::<f64>() / 3.0;
            // Where wall and skin meet the layer is not thinner than the mesh can show.
            FRAC_PI_2 * materials[face.element].shear_kpa() / mean.max(face.area_mm2.sqrt())
        };
        kpa_mm.unwrap_or_else(of_layer)
    };
    let faces = faces_on(mesh, BoundaryTag::Cut).into_iter();
    faces.map(|face| (face, stiffness(&face))).collect()
}

/// A linear spring between the same direction of two nodes, in each direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Its ends: points of the mesh, then for quadratic elements edges in the order of [`Edges`];
    /// none for the ground.
    pub nodes: (u32, Option<u32>),
    /// Stiffness, mN/mm; between two nodes it is negative.
    pub stiffness: f64,
}

/// The springs of a body's cut as springs between nodes, for other solvers: their stiffness matrix
/// is ∫ k N_a N_b dA.
///
/// A matrix K of springs is that of grounded ones with the sums of its rows and of ones between
/// nodes a and b with -K_ab.
pub fn nodal_springs(body: &Body, order: Order, kpa_mm: Option<f64>) -> Vec<Spring> {
    let (mesh, materials) = (&body.mesh, body.materials(1.0));
    match order {
        Order::Linear => {
            springs_of(&Foundation::<4>::new(mesh, &materials, kpa_mm), |t| mesh.tets()[t])
        }
        Order::Quadratic => {
            let (edges, corners) = (Edges::new(mesh), mesh.points().len() as u32);
            springs_of(&Foundation::<10>::new(mesh, &materials, kpa_mm), |t| {
                let ([a, b, c, d], sides) = (mesh.tets()[t], edges.of_tets()[t]);
                let [e, f, g, h, i, j] = sides.map(|side| corners + side);
                [a, b, c, d, e, f, g, h, i, j]
            })
        }
    }
}

fn springs_of<const N: usize>(
    foundation: &Foundation<N>,
    nodes: impl Fn(usize) -> [u32; N],
) -> Vec<Spring> {
    let (mut grounded, mut between) =
        (BTreeMap::<u32, f64>::new(), BTreeMap::<[u32; 2], f64>::new());
    for face in &foundation.faces {
        let own = nodes(face.element);
        for (a, row) in own.iter().zip(&face.stiffness) {
            for (b, k) in own.iter().zip(row).filter(|(_, k)| k.abs() > 0.0) {
                *grounded.entry(*a).or_default() += k;
                if a < b {
                    *between.entry([*a, *b]).or_default() -= k;
                }
            }
        }
    }
    let grounded =
        grounded.into_iter().map(|(a, stiffness)| Spring { nodes: (a, None), stiffness });
    let between = between.into_iter();
    let between = between.map(|([a, b], stiffness)| Spring { nodes: (a, Some(b)), stiffness });
    grounded.chain(between).collect()
}

/// `total` times the mean of N_a N_b over the face with these corners of a tetrahedron.
fn products<const N: usize>(corners: [usize; 3], total: f64) -> [[f64; N]; N] {
    let mut sum = [[0.0; N]; N];
    for (weight, c) in TRIANGLE_RULE {
        for odd in 0..3 {
            let mut l = [0.0; 4];
            for (k, corner) in corners.into_iter().enumerate() {
                l[corner] = if k == odd { 1.0 - 2.0 * c } else { c };
            }
            let n = shape::<N>(l);
            for (row, a) in sum.iter_mut().zip(n) {
                row.iter_mut().zip(n).for_each(|(s, b)| *s += total * weight * a * b);
            }
        }
    }
    sum
}

/// Thickness of the tissue at each point of the cut, mm: the way to the nearest point of the chest
/// wall and that to the nearest point of the skin. Infinite where the mesh has no wall or no skin.
fn cut_thickness(mesh: &TetMesh) -> BTreeMap<u32, f64> {
    let at = |p: u32| mesh.points()[p as usize];
    let surfaces = [BoundaryTag::ChestWall, BoundaryTag::Skin]
        .map(|tag| mesh.points_on(tag).into_iter().map(at).collect::<Vec<Point>>());
    let way = |from: Point, to: &[Point]| {
        to.iter().map(|p| (p - from).norm_squared()).fold(f64::INFINITY, f64::min).sqrt()
    };
    let thickness = |p: u32| surfaces.each_ref().map(|surface| way(at(p), surface)).iter().sum();
    mesh.points_on(BoundaryTag::Cut).into_iter().map(|p| (p, thickness(p))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_products_of_a_face_are_those_of_the_textbook() {
        let linear = products::<4>([0, 2, 3], 12.0);
        assert!((linear[0][0] - 2.0).abs() < 1e-12 && (linear[0][2] - 1.0).abs() < 1e-12);
        assert!(linear[1].iter().all(|k| *k == 0.0));
        // Six-node triangle of area 180: 6, −1 at corners, −4 to the opposite mid-side, 32 and 16
        // between mid-sides. Mid-sides of the face 0 1 2: 4 (0-1), 5 (1-2), 6 (0-2).
        let quadratic = products::<10>([0, 1, 2], 180.0);
        let want =
            [(0, 0, 6.0), (0, 1, -1.0), (0, 4, 0.0), (0, 5, -4.0), (4, 4, 32.0), (4, 6, 16.0)];
        for (a, b, k) in want {
            assert!((quadratic[a][b] - k).abs() < 1e-10, "{a} {b}: {}", quadratic[a][b]);
        }
        assert!((quadratic.iter().flatten().sum::<f64>() - 180.0).abs() < 1e-10);
    }
}

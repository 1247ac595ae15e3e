//! Tetrahedral elements with four nodes (linear) or ten (quadratic).
//!
//! `N` is the number of nodes, `Q` the number of quadrature points: 4 and 1, or 10 and 4. The
//! geometry is isoparametric: a straight tetrahedron is the case whose mid-side nodes are
//! midpoints, a stress-free shape is curved.

use crate::material::cofactor;
use supine_mesh::{Edges, TET_EDGES, TetMesh};
use supine_space::{Matrix, Vector};

/// Shape functions N_a at barycentric coordinates `l`.
///
/// Linear: l_a. Quadratic: l_a (2 l_a − 1) at corners, 4 l_a l_b at mid-edges.
pub(crate) fn shape<const N: usize>(l: [f64; 4]) -> [f64; N] {
    std::array::from_fn(|a| {
        if N == 4 {
            l[a]
        } else if a < 4 {
            l[a] * (2.0 * l[a] - 1.0)
        } else {
            let [i, k] = TET_EDGES[a - 4];
            4.0 * l[i] * l[k]
        }
    })
}

/// Slopes of the shape functions in the parent coordinates (l₁, l₂, l₃), l₀ = 1 − l₁ − l₂ − l₃.
pub(crate) fn parent_slopes<const N: usize>(l: [f64; 4]) -> [Vector; N] {
    let of_l = [Vector::new(-1.0, -1.0, -1.0), Vector::x(), Vector::y(), Vector::z()];
    std::array::from_fn(|a| {
        if N == 4 {
            of_l[a]
        } else if a < 4 {
            of_l[a] * (4.0 * l[a] - 1.0)
        } else {
            let [i, k] = TET_EDGES[a - 4];
            (of_l[k] * l[i] + of_l[i] * l[k]) * 4.0
        }
    })
}

/// Barycentric coordinates of the quadrature points; each has the same share of the volume.
///
/// One point: exact to degree 1. Four points: degree 2 (Hammer, Marlowe and Stroud 1956).
pub(crate) fn quadrature<const Q: usize>() -> [[f64; 4]; Q] {
    std::array::from_fn(|q| {
        if Q == 1 {
            [0.25; 4]
        } else {
            let near = (5.0 + 3.0 * 5f64.sqrt()) / 20.0;
            let mut l = [(5.0 - 5f64.sqrt()) / 20.0; 4];
            l[q] = near;
            l
        }
    })
}

/// The ten nodes of a tetrahedron in barycentric coordinates (the first four are the corners).
pub(crate) fn node_coordinates<const N: usize>() -> [[f64; 4]; N] {
    std::array::from_fn(|a| {
        let mut l = [0.0; 4];
        if a < 4 {
            l[a] = 1.0;
        } else {
            TET_EDGES[a - 4].into_iter().for_each(|k| l[k] = 0.5);
        }
        l
    })
}

/// Nodes of each element: the corners, then (N = 10) the mid-edges.
pub(crate) fn element_nodes<const N: usize>(mesh: &TetMesh, edges: &Edges) -> Vec<[u32; N]> {
    let points = mesh.points().len() as u32;
    let both = mesh.tets().iter().zip(edges.of_tets());
    both.map(|(tet, edges)| {
        std::array::from_fn(|a| if a < 4 { tet[a] } else { points + edges[a - 4] })
    })
    .collect()
}

/// Elements on a given shape, with what integration over them needs.
#[derive(Clone, Debug)]
pub(crate) struct Elements<const N: usize, const Q: usize> {
    /// Nodes of each element.
    pub(crate) nodes: Vec<[u32; N]>,
    /// Gradients of the shape functions at each quadrature point, 1/mm.
    pub(crate) gradients: Vec<[[Vector; N]; Q]>,
    /// Volume of each quadrature point, mm³.
    pub(crate) weights: Vec<[f64; Q]>,
    /// Shape functions at the quadrature points.
    pub(crate) values: [[f64; N]; Q],
}

impl<const N: usize, const Q: usize> Elements<N, Q> {
    /// Elements on the shape with nodes at `positions` (mm).
    ///
    /// # Errors
    /// The first element whose map from the parent is not positive at a quadrature point.
    pub(crate) fn new(positions: &[Vector], nodes: Vec<[u32; N]>) -> Result<Self, usize> {
        let points = quadrature::<Q>();
        let slopes = points.map(parent_slopes::<N>);
        let (mut gradients, mut weights) = (Vec::new(), Vec::new());
        for (e, element) in nodes.iter().enumerate() {
            let mut of_element = [[Vector::zeros(); N]; Q];
            let mut volume = [0.0; Q];
            for q in 0..Q {
                let map = parent_map(positions, element, &slopes[q]);
                let det = map.determinant();
                if !(det > 0.0 && det.is_finite()) {
                    return Err(e);
                }
                let inverse_transpose = cofactor(&map) / det;
                volume[q] = det / (6.0 * Q as f64);
                of_element[q] = slopes[q].map(|s| inverse_transpose * s);
            }
            gradients.push(of_element);
            weights.push(volume);
        }
        Ok(Self { nodes, gradients, weights, values: points.map(shape::<N>) })
    }

    /// Those of the elements that are to be kept.
    pub(crate) fn only(&self, keep: &[bool]) -> Self {
        Self {
            nodes: kept(&self.nodes, keep),
            gradients: kept(&self.gradients, keep),
            weights: kept(&self.weights, keep),
            values: self.values,
        }
    }

    /// Nodal forces (mN) of a dead load `force` (kPa/mm) per volume of the shape, on `nodes` nodes.
    ///
    /// f_a = Σ_q w_q N_a force.
    pub(crate) fn load(&self, nodes: usize, force: Vector) -> Vec<Vector> {
        let mut load = vec![Vector::zeros(); nodes];
        for (element, weights) in self.nodes.iter().zip(&self.weights) {
            for (weight, values) in weights.iter().zip(&self.values) {
                for (node, value) in element.iter().zip(values) {
                    load[*node as usize] += force * (weight * value);
                }
            }
        }
        load
    }

    /// grad u at a quadrature point: Σ u_a (grad N_a)ᵀ.
    pub(crate) fn gradient(&self, element: usize, q: usize, u: &[Vector]) -> Matrix {
        let gradients = &self.gradients[element][q];
        let mut sum = Matrix::zeros();
        for (node, g) in self.nodes[element].iter().zip(gradients) {
            sum += u[*node as usize] * g.transpose();
        }
        sum
    }
}

/// What is to be kept of some values.
pub(crate) fn kept<T: Clone>(values: &[T], keep: &[bool]) -> Vec<T> {
    values.iter().zip(keep).filter(|(_, keep)| **keep).map(|(value, _)| value.clone()).collect()
}

/// Slopes of the position in the parent coordinates: columns ∂x/∂l.
pub(crate) fn parent_map<const N: usize>(
    positions: &[Vector],
    element: &[u32; N],
    slopes: &[Vector; N],
) -> Matrix {
    let mut map = Matrix::zeros();
    for (node, s) in element.iter().zip(slopes) {
        map += positions[*node as usize] * s.transpose();
    }
    map
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_shapes<const N: usize>() {
        let nodes = node_coordinates::<N>();
        for (b, l) in nodes.iter().enumerate() {
            for (a, value) in shape::<N>(*l).into_iter().enumerate() {
                assert_eq!(value, if a == b { 1.0 } else { 0.0 }, "N_{a} at node {b}");
            }
        }
        let l = [0.1, 0.2, 0.3, 0.4];
        assert!((shape::<N>(l).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let step = 1e-6;
        for k in 0..3 {
            let moved = |t: f64| {
                let mut l = l;
                l[0] -= t;
                l[k + 1] += t;
                shape::<N>(l)
            };
            let (up, down) = (moved(step), moved(-step));
            for (a, slope) in parent_slopes::<N>(l).iter().enumerate() {
                assert!(((up[a] - down[a]) / (2.0 * step) - slope[k]).abs() < 1e-9, "{a} {k}");
            }
        }
    }

    #[test]
    fn shape_functions_are_one_at_their_own_node_and_slopes_fit() {
        check_shapes::<4>();
        check_shapes::<10>();
    }

    #[test]
    fn quadrature_is_exact_to_its_degree() {
        // ∫ l₀ l₁ over the tetrahedron = V / 20, ∫ l₀² = V / 10.
        let q = quadrature::<4>();
        let mean = |f: &dyn Fn([f64; 4]) -> f64| q.iter().map(|l| f(*l)).sum::<f64>() / 4.0;
        assert!((mean(&|l| l[0] * l[1]) - 0.05).abs() < 1e-15);
        assert!((mean(&|l| l[0] * l[0]) - 0.1).abs() < 1e-15);
    }
}

//! Bodies whose quadratic elements are curved in the CT.
//!
//! Nodes lie off the points and edge middles of the mesh, whose own elements are straight; the
//! elements are isoparametric (`element`). What is found at the nodes is handed on where the mesh
//! has them: the curved elements' field at the places of straight elements.

use crate::element::{element_nodes, node_coordinates, parent_map, parent_slopes, shape};
use crate::{Body, Error, Job};
use supine_mesh::Order;
use supine_space::Vector;

/// Steps towards the parent coordinates of a place; three or four are usual.
const STEPS: usize = 20;
/// They are found when a step is this small, in barycentric units.
const FOUND: f64 = 1e-13;

impl Body {
    /// Checks that the curved shape is one of this mesh.
    ///
    /// # Errors
    /// [`Error::Displacement`] when it is one of another mesh, [`Error::Curved`] when it is not
    /// quadratic.
    pub(crate) fn check_curved(&self) -> Result<(), Error> {
        let Some(offsets) = &self.curved else { return Ok(()) };
        offsets.check(&self.mesh)?;
        if offsets.order() == Order::Quadratic { Ok(()) } else { Err(Error::Curved) }
    }
}

impl Job<'_> {
    /// How far each node lies off its place in the mesh of straight elements, mm; `None` when none
    /// does.
    pub(crate) fn offsets<const N: usize>(&self) -> Option<&[Vector]> {
        self.body.curved.as_ref().filter(|_| N == 10).map(|offsets| offsets.values())
    }

    /// Where the places that the nodes have in the mesh of straight elements lie in the curved
    /// elements with nodes at `positions`.
    pub(crate) fn straightening<const N: usize>(&self, positions: &[Vector]) -> Straightening<N> {
        let Some(offsets) = self.offsets::<N>() else {
            return Straightening { places: Vec::new() };
        };
        // Of each node the best coordinates so far and how far inside they are.
        let mut best: Vec<Option<(f64, NodeShares<N>)>> = vec![None; positions.len()];
        for element in element_nodes::<N>(&self.body.mesh, self.edges) {
            for (node, start) in element.iter().zip(node_coordinates::<N>()) {
                let n = *node as usize;
                if offsets[n] == Vector::zeros() {
                    continue;
                }
                let place = positions[n] - offsets[n];
                let Some(l) = parent_place(positions, &element, start, place) else { continue };
                let inside = l.iter().copied().fold(f64::INFINITY, f64::min);
                if best[n].is_none_or(|(other, _)| inside > other) {
                    best[n] =
                        Some((inside, NodeShares { node: *node, element, shares: shape::<N>(l) }));
                }
            }
        }
        Straightening { places: best.into_iter().flatten().map(|(_, place)| place).collect() }
    }
}

/// The place of a node in the mesh of straight elements: shares of the nodes of a curved element.
#[derive(Clone, Copy, Debug)]
struct NodeShares<const N: usize> {
    node: u32,
    element: [u32; N],
    shares: [f64; N],
}

/// Hands fields of curved elements on to the nodes of the mesh of straight elements.
#[derive(Clone, Debug)]
pub(crate) struct Straightening<const N: usize> {
    places: Vec<NodeShares<N>>,
}

impl<const N: usize> Straightening<N> {
    /// The field with these values at the nodes of the curved elements at the nodes' places in the
    /// mesh of straight elements.
    ///
    /// A place outside all curved elements of its node takes the field of the one it lies least
    /// outside of, carried on.
    pub(crate) fn of(&self, values: &[Vector]) -> Vec<Vector> {
        let mut straight = values.to_vec();
        for NodeShares { node, element, shares } in &self.places {
            let nodes = element.iter().zip(shares);
            straight[*node as usize] = nodes.map(|(n, share)| values[*n as usize] * *share).sum();
        }
        straight
    }
}

/// Barycentric coordinates of a place in a curved element, by Newton's method from `start`; `None`
/// when they are not found.
fn parent_place<const N: usize>(
    positions: &[Vector],
    element: &[u32; N],
    start: [f64; 4],
    place: Vector,
) -> Option<[f64; 4]> {
    let mut l = start;
    for _ in 0..STEPS {
        let nodes = element.iter().zip(shape::<N>(l));
        let here: Vector = nodes.map(|(node, share)| positions[*node as usize] * share).sum();
        let map = parent_map(positions, element, &parent_slopes::<N>(l));
        let step = map.try_inverse()? * (place - here);
        for k in 0..3 {
            l[k + 1] += step[k];
        }
        l[0] = 1.0 - l[1] - l[2] - l[3];
        if step.amax() < FOUND {
            return Some(l);
        }
    }
    None
}

#[cfg(test)]
#[path = "curved_tests.rs"]
mod tests;

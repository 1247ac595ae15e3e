//! Bodies whose quadratic elements are curved in the CT.
//!
//! Nodes lie off the points and edge middles of the straight-sided mesh; the elements are isoparametric
//! (`element`). What is found at the nodes is handed on where the mesh has them: the curved elements' field
//! at the straight places.

use crate::element::{element_nodes, node_coordinates, parent_map, parent_slopes, shape};
use crate::{Body, Error, Job};
use supine_mesh::Order;
use supine_space::Vector;

/// Steps towards the parent coordinates of a place; three or four are usual.
const STEPS: usize = 20;
/// They are found when a step is this small, in barycentric units.
const FOUND: f64 = 1e-13;

impl Body<'_> {
    /// Checks that the curved shape is one of this mesh.
    ///
    /// # Errors
    /// [`Error::Displacement`] when it has another number of nodes, [`Error::Curved`] when it is not
    /// quadratic.
    pub(crate) fn check_curved(&self, edges: &supine_mesh::Edges) -> Result<(), Error> {
        let Some(offsets) = self.curved else { return Ok(()) };
        offsets.check(self.mesh, edges)?;
        if offsets.order() == Order::Quadratic { Ok(()) } else { Err(Error::Curved) }
    }
}

impl Job<'_> {
    /// How far each node lies off its place in the straight-sided mesh, mm; `None` when none does.
    pub(crate) fn offsets<const N: usize>(&self) -> Option<&[Vector]> {
        self.body.curved.filter(|_| N == 10).map(|offsets| offsets.values())
    }

    /// The field with these values at the nodes of the curved elements at the places that the nodes have
    /// in the straight-sided mesh; `positions` are those of the curved shape.
    ///
    /// A place outside all curved elements of its node takes the field of the one it lies least outside of,
    /// carried on.
    pub(crate) fn straightened<const N: usize>(
        &self,
        positions: &[Vector],
        values: Vec<Vector>,
    ) -> Vec<Vector> {
        let Some(offsets) = self.offsets::<N>() else { return values };
        let elements = element_nodes::<N>(self.body.mesh, self.edges);
        // Of each node the best barycentric coordinates so far, how far inside, and the element.
        let mut best: Vec<Option<(f64, [f64; 4], usize)>> = vec![None; positions.len()];
        for (e, element) in elements.iter().enumerate() {
            for (node, start) in element.iter().zip(node_coordinates::<N>()) {
                let n = *node as usize;
                if offsets[n] == Vector::zeros() {
                    continue;
                }
                let place = positions[n] - offsets[n];
                let Some(l) = parent_place(positions, element, (start, place)) else { continue };
                let inside = l.iter().copied().fold(f64::INFINITY, f64::min);
                if best[n].is_none_or(|(other, ..)| inside > other) {
                    best[n] = Some((inside, l, e));
                }
            }
        }
        let at = |(found, value): (Option<(f64, [f64; 4], usize)>, &Vector)| match found {
            Some((_, l, e)) => {
                let nodes = elements[e].iter().zip(shape::<N>(l));
                nodes.map(|(node, share)| values[*node as usize] * share).sum()
            }
            None => *value,
        };
        best.into_iter().zip(&values).map(at).collect()
    }
}

/// Barycentric coordinates of a place in a curved element, by Newton's method from `start`; `None` when
/// they are not found.
fn parent_place<const N: usize>(
    positions: &[Vector],
    element: &[u32; N],
    (start, place): ([f64; 4], Vector),
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

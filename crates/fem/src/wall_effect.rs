//! What the place of the chest wall does to the displacement at one place.
//!
//! The adjoint of `goal` tells it, K(u) z = ∂J/∂u. Where the wall lies δ farther out along its
//! normal n, into the tissue, the displacement is zero there instead, so that at the old place it
//! changes by −δ ∂u/∂n (the shape derivative of a held boundary; Sokolowski and Zolesio 1992,
//! section 3.1). With r = K z the reactions of the adjoint at the held nodes,
//!
//! dJ = Σ_b r_b · (∂u/∂n)_b δ_b.

use crate::Job;
use crate::model::Model;
use crate::recovery::recovered;
use supine_mesh::{BoundaryTag, Edges, TetMesh};
use supine_space::{Point, Vector};

/// Longest step of the differences that give the reactions of the adjoint, mm: rounding and
/// curvature are both far below a thousandth there.
const DIFFERENCE_MM: f64 = 1e-3;

/// A node of the chest wall, and what its place does to the displacement of a goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WallNode {
    /// Its place in the CT, LPS, mm.
    pub place: Point,
    /// Change of the goal's displacement, mm, per mm by which the wall around this node lies
    /// farther out, into the tissue. That of a part of the wall is the sum over its nodes.
    pub change: Vector,
}

impl Job<'_> {
    /// What each node of the chest wall does to the goal; `None` when the solution is at the edge
    /// of folding.
    pub(crate) fn wall<const N: usize, const Q: usize>(
        &self,
        model: &Model<N, Q>,
        positions: &[Vector],
        u: &[Vector],
        adjoints: &[Vec<Vector>; 3],
    ) -> Option<Vec<WallNode>> {
        let normals = wall_normals::<N>(&self.body.mesh, self.edges, positions.len());
        let gradients = recovered(positions, &model.elements.nodes, &self.body.mesh, u);
        let reactions = adjoints.each_ref().map(|z| derivative(model, u, z));
        let [Some(x), Some(y), Some(z)] = reactions else { return None };
        let at = |node: usize| match node.checked_sub(self.body.mesh.points().len()) {
            None => gradients[node],
            Some(edge) => {
                let [a, b] = self.edges.ends()[edge].map(|p| gradients[p as usize]);
                (a + b) / 2.0
            }
        };
        let change = |(node, normal): (usize, &Vector)| {
            let slope = at(node) * normal.try_normalize(0.0)?;
            let change = Vector::new(x[node].dot(&slope), y[node].dot(&slope), z[node].dot(&slope));
            Some(WallNode { place: positions[node].into(), change })
        };
        Some(normals.iter().enumerate().filter_map(change).collect())
    }
}

/// K(u) `direction` at all nodes, held ones included, mN: the derivative of the internal forces, by
/// central differences. `None` when an element is turned inside out there.
fn derivative<const N: usize, const Q: usize>(
    model: &Model<N, Q>,
    u: &[Vector],
    direction: &[Vector],
) -> Option<Vec<Vector>> {
    let longest = direction.iter().map(Vector::norm).fold(0.0, f64::max);
    if longest == 0.0 {
        return Some(vec![Vector::zeros(); u.len()]);
    }
    let step = DIFFERENCE_MM / longest;
    let at = |step: f64| {
        let moved: Vec<Vector> = u.iter().zip(direction).map(|(u, d)| u + d * step).collect();
        model.evaluate(&moved).map(|(_, forces)| forces)
    };
    let (ahead, behind) = (at(step)?, at(-step)?);
    Some(ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * step)).collect())
}

/// Normals of the chest wall at its nodes, into the tissue, of no particular length; zero at all
/// other nodes.
fn wall_normals<const N: usize>(mesh: &TetMesh, edges: &Edges, nodes: usize) -> Vec<Vector> {
    let mut normals = vec![Vector::zeros(); nodes];
    for face in mesh.boundary().iter().filter(|face| face.tag == BoundaryTag::ChestWall) {
        let [a, b, c] = face.points.map(|p| mesh.points()[p as usize]);
        // Boundary faces look outwards: the wall's normal into the tissue is the other one.
        let inward = (c - a).cross(&(b - a));
        let [a, b, c] = face.points;
        face.points.into_iter().for_each(|p| normals[p as usize] += inward);
        if N == 10 {
            for (a, b) in [(a, b), (b, c), (a, c)] {
                if let Some(edge) = edges.between(a, b) {
                    normals[mesh.points().len() + edge as usize] += inward;
                }
            }
        }
    }
    normals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Body;
    use crate::goal::goal_errors;
    use crate::goal::tests::{SIDE_MM, cube, goal, load, mean, solver, tissue};
    use std::sync::Arc;
    use supine_mesh::Order;
    use supine_space::Progress;

    /// The block whose wall lies `rise` mm higher: its tissue is squeezed into what remains above.
    fn risen(mesh: &TetMesh, rise: f64) -> Arc<TetMesh> {
        let lift = |p: &Point| Point::new(p.x, p.y, p.z + rise * (1.0 - p.z / SIDE_MM));
        let points = mesh.points().iter().map(lift).collect();
        TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec()).unwrap().into()
    }

    #[test]
    fn a_wall_that_lies_farther_out_takes_off_what_the_adjoint_says() {
        let mesh = cube(6);
        for order in [Order::Linear, Order::Quadratic] {
            let body = Body::new(mesh.clone(), tissue());
            let found = goal_errors(&body, &load(), &solver(order), &goal(), Progress::none());
            let found = found.unwrap();
            assert!((found.displacement - mean(&mesh, order)).norm() < 1e-6);
            let said: Vector = found.wall.iter().map(|node| node.change).sum();
            let [low, high] = [-0.5, 0.5].map(|rise| mean(&risen(&mesh, rise), order));
            let measured = high - low;
            assert!(measured.norm() > 0.02 * found.displacement.norm(), "{measured:?}");
            let share = if order == Order::Linear { 0.25 } else { 0.1 };
            assert!(
                (said - measured).norm() < share * measured.norm(),
                "{order:?} {said:?} {measured:?}"
            );
            assert!(found.wall.iter().all(|node| node.place.z == 0.0));
        }
    }
}

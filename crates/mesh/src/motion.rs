//! The displacement of any point, and its derivative.

use crate::embedding::slopes_in_plane;
use crate::{Beside, BoundaryTag, Displacement, DisplacementError, Embedding, Order, Place};
use rayon::prelude::*;
use std::sync::Arc;
use supine_space::{Matrix, Vector};

/// How what lies outside the skin moves with it.
///
/// Up to `rigid_mm` from the skin all of it, as a layer of constant thickness; from there the
/// motion falls smoothly to nothing at `reach_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surround {
    /// Distance from the skin up to which the motion is whole, mm.
    pub rigid_mm: f64,
    /// Distance from which there is none, mm; above `rigid_mm`.
    pub reach_mm: f64,
}

impl Default for Surround {
    /// 10 mm, then 40 mm of decay.
    ///
    /// Points of a surface scan lie within a few millimetres of the CT's skin once it is
    /// registered, and breathing, cloth or a bad edge take that to some 10 mm: all these must move
    /// as the skin does. The decay is there so that the field ends without a step; its slope is at
    /// most 1.5 |u| / 40 mm, so that it does not fold for motions of the skin up to 27 mm, more
    /// than a tilted table gives.
    fn default() -> Self {
        Self { rigid_mm: 10.0, reach_mm: 50.0 }
    }
}

impl Surround {
    /// Share of the motion at a distance (mm) from the skin, and its slope (1/mm): 1 − t² (3 − 2 t)
    /// with t = (d − rigid) / (reach − rigid) held in 0..=1.
    fn share(&self, distance_mm: f64) -> (f64, f64) {
        let width = self.reach_mm - self.rigid_mm;
        let t = (distance_mm - self.rigid_mm) / width;
        if t.is_nan() || t <= 0.0 {
            return (1.0, 0.0);
        }
        if t >= 1.0 {
            return (0.0, 0.0);
        }
        (1.0 - t * t * (3.0 - 2.0 * t), -6.0 * t * (1.0 - t) / width)
    }
}

/// A displacement known at any point round a mesh, mm (LPS, from the CT shape).
///
/// | place | displacement |
/// |---|---|
/// | in a tetrahedron | Σ N_a u_a, the shape functions |
/// | beside the skin, foot c, offset w | s(\|w\|) (u(c) + (A(c) − I) w) |
/// | behind the chest wall | 0: it is one rigid body, and held |
/// | beyond the cut | none: the mesh knows nothing of it |
///
/// Outside the skin the offset turns with the skin, so that distances from it and directions along
/// its normal are kept (the assumption of thin shells by Kirchhoff and Love): A takes tangents of
/// the skin to those of the deformed skin and its normal to the normal there. It is the mean of the
/// skin faces round each point, weighted by area, linear between; I where the skin meets the chest
/// wall. s is that of [`Surround`]. The value is continuous from the inside to the reach and
/// beyond, the derivative along the normal jumps at the skin (air does not stretch as tissue does),
/// and both jump where two feet are equally near.
#[derive(Debug)]
pub struct Motion {
    embedding: Arc<Embedding>,
    displacement: Displacement,
    surround: Surround,
    /// A − I at the points of the mesh; zero away from the skin.
    turns: Vec<Matrix>,
}

impl Motion {
    /// A displacement of the mesh of `embedding`.
    ///
    /// # Errors
    /// When the displacement is not one of that mesh.
    pub fn new(
        embedding: Arc<Embedding>,
        displacement: Displacement,
        surround: Surround,
    ) -> Result<Self, DisplacementError> {
        displacement.check(embedding.mesh())?;
        let turns = turns(&embedding, &displacement);
        Ok(Self { embedding, displacement, surround, turns })
    }

    /// Displacement at a place, mm; `None` beyond the cut.
    pub fn at(&self, place: &Place) -> Option<Vector> {
        match place {
            Place::Inside(l) => {
                let (mesh, edges) = (self.embedding.mesh(), self.embedding.edges());
                Some(self.displacement.at(mesh, edges, l.tet, l.weights))
            }
            Place::Beside(beside) => {
                Some(self.whole(beside) * self.surround.share(beside.distance_mm()).0)
            }
            Place::Wall => Some(Vector::zeros()),
            Place::Beyond => None,
        }
    }

    /// Displacements at many places, in parallel.
    pub fn all(&self, places: &[Place]) -> Vec<Option<Vector>> {
        places.par_iter().map(|p| self.at(p)).collect()
    }

    /// Derivative of the displacement at a place, without unit: row = component of the
    /// displacement, column = axis of the CT. `None` beyond the cut.
    ///
    /// The deformation gradient F is this plus the identity. It is the derivative of [`Self::at`]
    /// within a tetrahedron, or within the region of one face, edge or corner of the skin.
    pub fn gradient(&self, place: &Place) -> Option<Matrix> {
        match place {
            Place::Inside(l) => {
                let (mesh, edges) = (self.embedding.mesh(), self.embedding.edges());
                Some(self.displacement.gradient(mesh, edges, l.tet, l.weights))
            }
            Place::Beside(beside) => Some(self.gradient_beside(beside)),
            Place::Wall => Some(Matrix::zeros()),
            Place::Beyond => None,
        }
    }

    /// u(c) + (A(c) − I) w.
    fn whole(&self, beside: &Beside) -> Vector {
        let corners = self.embedding.mesh().boundary()[beside.face].points;
        let turns = corners.iter().zip(beside.weights);
        let turned: Vector = turns.map(|(&c, l)| self.turns[c as usize] * beside.offset * l).sum();
        on_face(&self.embedding, &self.displacement, beside.face, beside.weights) + turned
    }

    /// s' v ŵᵀ + s [Σ ∂u/∂l_a b_aᵀ + Σ (A_a − I) w b_aᵀ + (A − I)(I − ∂c)], v the motion without
    /// decay, b_a the slopes of the foot's weights l_a, ∂c those of the foot.
    fn gradient_beside(&self, beside: &Beside) -> Matrix {
        let Beside { face, weights, offset, slopes } = beside;
        let mesh = self.embedding.mesh();
        let (share, slope) = self.surround.share(offset.norm());
        let along = slopes_on_face(&self.embedding, &self.displacement, *face, *weights);
        let still = Matrix::identity() - beside.foot_slopes(mesh);
        let mut sum = Matrix::zeros();
        for (a, &corner) in mesh.boundary()[*face].points.iter().enumerate() {
            let turn = self.turns[corner as usize];
            sum += (along[a] + turn * offset) * slopes[a].transpose() + turn * still * weights[a];
        }
        let away = offset.try_normalize(0.0).unwrap_or_else(Vector::zeros);
        sum * share + self.whole(beside) * away.transpose() * slope
    }
}

/// Nodal displacements of a face: its corners, then (quadratic) the middles of its edges 01, 12
/// and 20.
fn nodal(
    embedding: &Embedding,
    displacement: &Displacement,
    face: usize,
) -> ([Vector; 3], Option<[Vector; 3]>) {
    let (mesh, values) = (embedding.mesh(), displacement.values());
    let corners = mesh.boundary()[face].points;
    let middles = (displacement.order() == Order::Quadratic).then(|| {
        [(0, 1), (1, 2), (2, 0)].map(|(a, b)| {
            let edge = embedding.edges().between(corners[a], corners[b]);
            edge.map_or_else(Vector::zeros, |e| values[mesh.points().len() + e as usize])
        })
    });
    (corners.map(|c| values[c as usize]), middles)
}

/// Displacement on a face at barycentric coordinates `l`: Σ l_a u_a, or for quadratic order
/// Σ l_a (2 l_a − 1) u_a + Σ 4 l_a l_b u_ab.
fn on_face(embedding: &Embedding, displacement: &Displacement, face: usize, l: [f64; 3]) -> Vector {
    let (corners, middles) = nodal(embedding, displacement, face);
    let Some([ab, bc, ca]) = middles else { return (0..3).map(|a| corners[a] * l[a]).sum() };
    let corners: Vector = (0..3).map(|a| corners[a] * (l[a] * (2.0 * l[a] - 1.0))).sum();
    corners + (ab * (l[0] * l[1]) + bc * (l[1] * l[2]) + ca * (l[2] * l[0])) * 4.0
}

/// Slopes of [`on_face`] in each of the three barycentric coordinates, taken as independent.
fn slopes_on_face(
    embedding: &Embedding,
    displacement: &Displacement,
    face: usize,
    l: [f64; 3],
) -> [Vector; 3] {
    let (corners, middles) = nodal(embedding, displacement, face);
    let Some([ab, bc, ca]) = middles else { return corners };
    [
        corners[0] * (4.0 * l[0] - 1.0) + (ab * l[1] + ca * l[2]) * 4.0,
        corners[1] * (4.0 * l[1] - 1.0) + (ab * l[0] + bc * l[2]) * 4.0,
        corners[2] * (4.0 * l[2] - 1.0) + (bc * l[1] + ca * l[0]) * 4.0,
    ]
}

/// A − I at the points of the skin, zero elsewhere and on the chest wall.
///
/// Of one face: A = T + n' nᵀ with T the map of its tangents and n, n' its unit normals before and
/// after. A face that is deformed to a line at a corner has no normal there and does not count.
fn turns(embedding: &Embedding, displacement: &Displacement) -> Vec<Matrix> {
    let mesh = embedding.mesh();
    let mut sums = vec![(Matrix::zeros(), 0.0); mesh.points().len()];
    let skin = mesh.boundary().iter().enumerate().filter(|(_, f)| f.tag == BoundaryTag::Skin);
    for (face, boundary) in skin {
        let corners = boundary.points.map(|p| mesh.points()[p as usize]);
        let (first, second) = (corners[1] - corners[0], corners[2] - corners[0]);
        let normal = first.cross(&second);
        let area = normal.norm();
        let slopes = slopes_in_plane(&corners);
        for (a, &point) in boundary.points.iter().enumerate() {
            let l = [0, 1, 2].map(|c| if c == a { 1.0 } else { 0.0 });
            let along = slopes_on_face(embedding, displacement, face, l);
            let stretch: Matrix = along.iter().zip(&slopes).map(|(u, b)| u * b.transpose()).sum();
            let after = (first + stretch * first).cross(&(second + stretch * second));
            if let Some(after) = after.try_normalize(1e-9 * area) {
                let n = normal / area;
                let (sum, weight) = &mut sums[point as usize];
                *sum += (stretch + (after - n) * n.transpose()) * area;
                *weight += area;
            }
        }
    }
    let held = embedding.held();
    let mean = |((sum, weight), held): ((Matrix, f64), bool)| {
        if held || weight == 0.0 { Matrix::zeros() } else { sum / weight }
    };
    sums.into_iter().zip(held).map(mean).collect()
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;

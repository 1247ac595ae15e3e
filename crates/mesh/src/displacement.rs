//! Displacement of a mesh.

use crate::{Edges, MeshId, TetMesh};
use std::sync::Arc;
use supine_space::{Failure, Matrix, Vector};

/// Polynomial order of the displacement within a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// One vector per point.
    Linear,
    /// One vector per point, then one per edge (mid-side node).
    Quadratic,
}

impl Order {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Linear, Self::Quadratic];

    /// Name in case files, on the command line, in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
        }
    }

    /// 1 or 2.
    pub fn number(self) -> u8 {
        match self {
            Self::Linear => 1,
            Self::Quadratic => 2,
        }
    }
}

/// Displacement of the nodes of a mesh, always from the CT shape, mm.
///
/// Nodes are the points of the mesh, and for quadratic order also the midpoints of its edges in the
/// order of [`Edges`]. The elements of the mesh itself (the CT shape) are straight. Copies share
/// the vectors.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacement {
    mesh: MeshId,
    order: Order,
    values: Arc<[Vector]>,
}

/// Why a displacement cannot be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DisplacementError {
    /// The number of vectors fits neither order.
    #[error(
        "{values} displacement vectors fit neither {points} points (linear) nor {points} points \
         and {edges} edges (quadratic)"
    )]
    Count {
        /// Vectors given.
        values: usize,
        /// Points of the mesh.
        points: usize,
        /// Edges of the mesh.
        edges: usize,
    },
    /// A vector is not finite.
    #[error("displacement vector {0} is not finite")]
    NotFinite(usize),
    /// It was made for another mesh.
    #[error(
        "the {values} displacement vectors belong to another mesh than this one of {points} points"
    )]
    OtherMesh {
        /// Vectors of the displacement.
        values: usize,
        /// Points of the mesh that it was to belong to.
        points: usize,
    },
}

impl DisplacementError {
    /// What kind of failure this is.
    pub fn kind(&self) -> Failure {
        match self {
            Self::Count { .. } | Self::NotFinite(_) | Self::OtherMesh { .. } => Failure::Input,
        }
    }
}

impl Displacement {
    /// A displacement of `mesh` from one vector (mm) per point, or per point and edge.
    ///
    /// # Errors
    /// When the number of vectors fits neither order or a vector is not finite.
    pub fn new(
        mesh: &TetMesh,
        edges: &Edges,
        values: Vec<Vector>,
    ) -> Result<Self, DisplacementError> {
        let order = order_of(mesh, edges, values.len())?;
        match values.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            Some(n) => Err(DisplacementError::NotFinite(n)),
            None => Ok(Self { mesh: mesh.id(), order, values: values.into() }),
        }
    }

    /// Checks that this is a displacement of `mesh`.
    ///
    /// # Errors
    /// [`DisplacementError::OtherMesh`] when it was made for one with other points or tetrahedra.
    pub fn check(&self, mesh: &TetMesh) -> Result<(), DisplacementError> {
        if self.mesh == mesh.id() {
            return Ok(());
        }
        let (values, points) = (self.values.len(), mesh.points().len());
        Err(DisplacementError::OtherMesh { values, points })
    }

    /// No displacement.
    pub fn zero(mesh: &TetMesh) -> Self {
        let values = vec![Vector::zeros(); mesh.points().len()].into();
        Self { mesh: mesh.id(), order: Order::Linear, values }
    }

    /// Order within a tetrahedron.
    pub fn order(&self) -> Order {
        self.order
    }

    /// Vectors of the nodes, mm: points, then (quadratic) edges.
    pub fn values(&self) -> &[Vector] {
        &self.values
    }

    /// Displacement within tetrahedron `tet` at barycentric coordinates `l`, mm.
    ///
    /// Linear: Σ l_a u_a. Quadratic: Σ l_a (2 l_a - 1) u_a + Σ 4 l_a l_b u_ab.
    pub fn at(&self, mesh: &TetMesh, edges: &Edges, tet: usize, l: [f64; 4]) -> Vector {
        let corner = mesh.tets()[tet].map(|p| self.values[p as usize]);
        match self.order {
            Order::Linear => (0..4).map(|a| corner[a] * l[a]).sum(),
            Order::Quadratic => {
                let n = mesh.points().len();
                let corners: Vector = (0..4).map(|a| corner[a] * (l[a] * (2.0 * l[a] - 1.0))).sum();
                let middles: Vector = crate::TET_EDGES
                    .iter()
                    .zip(edges.of_tets()[tet])
                    .map(|([a, b], e)| self.values[n + e as usize] * (4.0 * l[*a] * l[*b]))
                    .sum();
                corners + middles
            }
        }
    }

    /// Derivative of the displacement within tetrahedron `tet` at barycentric coordinates `l`,
    /// without unit: row = component of the displacement, column = axis of the CT.
    ///
    /// Σ u_n (grad N_n)ᵀ with the N of [`Self::at`].
    pub fn gradient(&self, mesh: &TetMesh, edges: &Edges, tet: usize, l: [f64; 4]) -> Matrix {
        let slopes = mesh.slopes(tet);
        let corner = mesh.tets()[tet].map(|p| self.values[p as usize]);
        if self.order == Order::Linear {
            return (0..4).map(|a| corner[a] * slopes[a].transpose()).sum();
        }
        let n = mesh.points().len();
        let corners: Matrix =
            (0..4).map(|a| corner[a] * slopes[a].transpose() * (4.0 * l[a] - 1.0)).sum();
        let middles = crate::TET_EDGES.iter().zip(edges.of_tets()[tet]).map(|(&[a, b], e)| {
            let slope = slopes[b] * l[a] + slopes[a] * l[b];
            self.values[n + e as usize] * slope.transpose() * 4.0
        });
        corners + middles.sum::<Matrix>()
    }

    /// Largest norm, mm.
    pub fn max_norm(&self) -> f64 {
        self.values.iter().map(|v| v.norm()).fold(0.0, f64::max)
    }
}

/// The order whose nodes number `values`.
fn order_of(mesh: &TetMesh, edges: &Edges, values: usize) -> Result<Order, DisplacementError> {
    let (points, edges) = (mesh.points().len(), edges.ends().len());
    match values {
        n if n == points => Ok(Order::Linear),
        n if n == points + edges => Ok(Order::Quadratic),
        values => Err(DisplacementError::Count { values, points, edges }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet_mesh::tests::cube;

    #[test]
    fn a_quadratic_field_is_reproduced() {
        let mesh = cube();
        let edges = Edges::new(&mesh);
        let field = |p: Vector| Vector::new(p.x * p.y, p.z * p.z - p.x, 0.5 * p.y);
        let mut values: Vec<Vector> = mesh.points().iter().map(|p| field(p.coords)).collect();
        values.extend(edges.ends().iter().map(|e| {
            let [a, b] = e.map(|p| mesh.points()[p as usize].coords);
            field((a + b) / 2.0)
        }));
        let u = Displacement::new(&mesh, &edges, values).unwrap();
        let l = [0.1, 0.2, 0.3, 0.4];
        for tet in 0..mesh.tets().len() {
            let p: Vector = mesh.corners(tet).iter().zip(l).map(|(c, l)| c.coords * l).sum();
            assert!((u.at(&mesh, &edges, tet, l) - field(p)).norm() < 1e-14, "tet {tet}");
        }
    }

    #[test]
    fn a_wrong_count_is_refused() {
        let mesh = cube();
        let edges = Edges::new(&mesh);
        let five = vec![Vector::zeros(); 5];
        assert!(Displacement::new(&mesh, &edges, five).is_err());
    }
}

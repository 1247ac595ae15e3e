//! A mesh and its displacement, which belong together.

use crate::{Displacement, DisplacementError, TetMesh};
use std::sync::Arc;

/// A mesh in its CT shape with a displacement of it: LPS, mm. Copies share both.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformation {
    mesh: Arc<TetMesh>,
    displacement: Displacement,
}

impl Deformation {
    /// A mesh and a displacement that was made for it.
    ///
    /// # Errors
    /// [`DisplacementError::OtherMesh`] when it was made for a mesh with other points or
    /// tetrahedra.
    pub fn new(mesh: Arc<TetMesh>, displacement: Displacement) -> Result<Self, DisplacementError> {
        displacement.check(&mesh)?;
        Ok(Self { mesh, displacement })
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TetMesh> {
        &self.mesh
    }

    /// Its displacement.
    pub fn displacement(&self) -> &Displacement {
        &self.displacement
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tet_mesh::tests::cube;

    #[test]
    fn a_displacement_of_another_mesh_is_refused() {
        let (mesh, same) = (Arc::new(cube()), cube());
        assert!(Deformation::new(mesh.clone(), Displacement::zero(&same)).is_ok());
        let points = same.points().iter().map(|p| p * 1.5).collect();
        let other = TetMesh::new(points, same.tets().to_vec(), same.boundary().to_vec()).unwrap();
        let refused = Deformation::new(mesh, Displacement::zero(&other)).unwrap_err();
        assert!(matches!(refused, DisplacementError::OtherMesh { values: 8, points: 8 }));
    }
}

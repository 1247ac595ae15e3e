//! Tetrahedral meshes with tagged boundary, displacements at any point, quality and point location.
//!
//! Knows no voxels, no material and no file.
//!
//! # Example
//!
//! ```
//! use supine_mesh::{BoundaryFace, BoundaryTag, MeshError, TET_FACES, TetMesh};
//! use supine_space::Point;
//!
//! # fn main() -> Result<(), MeshError> {
//! let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]];
//! let face = |f: usize, tag| BoundaryFace { points: TET_FACES[f].map(|p| p as u32), tag };
//! let skin = [0, 1, 2].map(|f| face(f, BoundaryTag::Skin));
//! let wall = face(3, BoundaryTag::ChestWall);
//! let boundary = [&skin[..], &[wall]].concat();
//! let mesh = TetMesh::new(corners.map(Point::from).to_vec(), vec![[0, 1, 2, 3]], boundary)?;
//! assert_eq!(mesh.points_on(BoundaryTag::ChestWall), [0, 1, 2]);
//! # Ok(())
//! # }
//! ```

mod deformation;
mod displacement;
mod edges;
mod embedding;
mod locate;
mod merge;
mod motion;
mod point_tree;
mod quality;
mod scan;
mod scan_distances;
mod section;
mod split;
mod surface_distance;
mod tet_mesh;
mod transfer;
mod tri_surface;

pub use deformation::Deformation;
pub use displacement::{Displacement, DisplacementError, Order};
pub use edges::{Edges, TET_EDGES};
pub use embedding::{Beside, Embedding, Place};
pub use locate::{Located, Locator};
pub use motion::{Motion, Surround};
pub use point_tree::PointTree;
pub use quality::{
    DIHEDRAL_CLASS_DEG, Quality, RADIUS_RATIO_CLASS, Spread, TetQuality, quality, spread,
    tet_quality,
};
pub use scan::{NormalSource, Scan, ScanError, ScanInfo, representatives};
pub use scan_distances::{ScanDistances, SurfaceDistances};
pub use section::{Below, FaceCut, Faces, below, cut_triangle, det_f};
pub use split::Split;
pub use surface_distance::SurfaceDistance;
pub use tet_mesh::{BoundaryFace, BoundaryTag, MeshError, MeshId, TET_FACES, TetMesh};
pub use transfer::transfer;
pub use tri_surface::{SurfaceError, TriSurface};

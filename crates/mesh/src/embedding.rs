//! Where points lie relative to a mesh: inside it, beside its skin, or where it says nothing.

use crate::{BoundaryTag, Edges, Located, Locator, TetMesh};
use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};
use rayon::prelude::*;
use std::sync::Arc;
use supine_space::{Matrix, Point, Vector};

/// Where a point lies relative to a mesh in its CT shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// In a tetrahedron, its faces included.
    Inside(Located),
    /// Outside, with the skin as the nearest part of the boundary.
    Beside(Beside),
    /// Outside, with the chest wall as the nearest part of the boundary: in or behind the rigid
    /// body.
    Wall,
    /// Outside, with the cut or its rim as the nearest part of the boundary: tissue and air of
    /// which the mesh knows nothing. Points that are not finite lie here too.
    Beyond,
}

/// The foot of a point on the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beside {
    /// The face, as an index into [`TetMesh::boundary`].
    pub face: usize,
    /// Barycentric coordinates of the foot, one per corner of the face, summing to 1.
    pub weights: [f64; 3],
    /// From the foot to the point, mm.
    pub offset: Vector,
    /// Slopes of `weights` when the point moves, 1/mm: in the plane of the face, along the edge
    /// that the foot stays on, or 0 at a corner that it stays on.
    pub(crate) slopes: [Vector; 3],
}

impl Beside {
    /// Distance from the skin, mm.
    pub fn distance_mm(&self) -> f64 {
        self.offset.norm()
    }
}

/// A mesh in its CT shape, prepared to tell where points lie.
///
/// Places depend on the shape alone, so those of many points serve for one displacement after
/// another ([`crate::Motion`]).
pub struct Embedding {
    mesh: Arc<TetMesh>,
    edges: Edges,
    locator: Locator,
    /// `None` only without a boundary, which no mesh is.
    boundary: Option<TriMesh>,
    /// Edges of the cut and the chest wall, lower point first, sorted.
    cut: Vec<[u32; 2]>,
    wall: Vec<[u32; 2]>,
}

impl std::fmt::Debug for Embedding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Embedding({:?})", self.locator)
    }
}

impl Embedding {
    /// Prepares the search in `mesh`.
    pub fn new(mesh: Arc<TetMesh>) -> Self {
        let points = mesh.points().iter().map(|p| Vec3::new(p.x, p.y, p.z)).collect();
        let faces = mesh.boundary().iter().map(|f| f.points).collect();
        let rim = |tag| {
            let faces = mesh.boundary().iter().filter(|f| f.tag == tag);
            let mut rim: Vec<[u32; 2]> = faces.flat_map(|f| edges_of(f.points)).collect();
            rim.sort_unstable();
            rim.dedup();
            rim
        };
        Self {
            edges: Edges::new(&mesh),
            locator: Locator::new(mesh.clone()),
            boundary: TriMesh::new(points, faces).ok(),
            cut: rim(BoundaryTag::Cut),
            wall: rim(BoundaryTag::ChestWall),
            mesh,
        }
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<TetMesh> {
        &self.mesh
    }

    /// Its edges.
    pub fn edges(&self) -> &Edges {
        &self.edges
    }

    /// Where a point (LPS, mm) lies.
    ///
    /// What is nearest on a rim belongs to the cut before the chest wall, and to either before the
    /// skin.
    pub fn place(&self, p: &Point) -> Place {
        if !p.iter().all(|c| c.is_finite()) {
            return Place::Beyond;
        }
        if let Some(found) = self.locator.locate(p) {
            return Place::Inside(found);
        }
        let at = Vec3::new(p.x, p.y, p.z);
        let Some(boundary) = &self.boundary else { return Place::Beyond };
        let (nearest, (face, location)) = boundary.project_local_point_and_get_location(at, false);
        let face = face as usize;
        let corners = self.mesh.boundary()[face].points;
        let (tag, weights, slopes) = match location {
            TrianglePointLocation::OnVertex(v) => {
                let v = v as usize;
                let on = |rim: &[[u32; 2]]| rim.iter().any(|e| e.contains(&corners[v]));
                (self.rim(face, on), unit(v), [Vector::zeros(); 3])
            }
            TrianglePointLocation::OnEdge(edge, [first, second]) => {
                let (a, b) = PARRY_EDGES[edge as usize % 3];
                let key = [corners[a].min(corners[b]), corners[a].max(corners[b])];
                let mut weights = [0.0; 3];
                (weights[a], weights[b]) = (first, second);
                let [p, q] = [a, b].map(|c| self.mesh.points()[corners[c] as usize]);
                let along = (q - p) / (q - p).norm_squared();
                let mut slopes = [Vector::zeros(); 3];
                (slopes[a], slopes[b]) = (-along, along);
                let on = |rim: &[[u32; 2]]| rim.binary_search(&key).is_ok();
                (self.rim(face, on), weights, slopes)
            }
            TrianglePointLocation::OnFace(_, weights) => {
                let corners = corners.map(|c| self.mesh.points()[c as usize]);
                (self.mesh.boundary()[face].tag, weights, slopes_in_plane(&corners))
            }
            // Only for solids, which a surface is not.
            TrianglePointLocation::OnSolid => return Place::Beyond,
        };
        match tag {
            BoundaryTag::Cut => Place::Beyond,
            BoundaryTag::ChestWall => Place::Wall,
            BoundaryTag::Skin => {
                let away = at - nearest.point;
                let offset = Vector::new(away.x, away.y, away.z);
                Place::Beside(Beside { face, weights, offset, slopes })
            }
        }
    }

    /// Where many points lie, in parallel.
    pub fn places(&self, points: &[Point]) -> Vec<Place> {
        points.par_iter().map(|p| self.place(p)).collect()
    }

    /// What a corner or edge belongs to: a rim it lies on, or else its face.
    fn rim(&self, face: usize, on: impl Fn(&[[u32; 2]]) -> bool) -> BoundaryTag {
        if on(&self.cut) {
            BoundaryTag::Cut
        } else if on(&self.wall) {
            BoundaryTag::ChestWall
        } else {
            self.mesh.boundary()[face].tag
        }
    }

    /// Whether each point of the mesh lies on the chest wall.
    pub(crate) fn held(&self) -> Vec<bool> {
        let mut held = vec![false; self.mesh.points().len()];
        self.wall.iter().flatten().for_each(|&p| held[p as usize] = true);
        held
    }
}

/// Corners of the edges of a triangle as parry numbers them in point locations.
const PARRY_EDGES: [(usize, usize); 3] = [(0, 1), (1, 2), (0, 2)];

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [(a, b), (b, c), (c, a)].map(|(p, q)| [p.min(q), p.max(q)])
}

fn unit(corner: usize) -> [f64; 3] {
    [0, 1, 2].map(|c| if c == corner { 1.0 } else { 0.0 })
}

/// Gradients of the barycentric coordinates of a triangle in its plane, 1/mm.
pub(crate) fn slopes_in_plane([a, b, c]: &[Point; 3]) -> [Vector; 3] {
    let normal = (b - a).cross(&(c - a));
    let scaled = normal / normal.norm_squared();
    [scaled.cross(&(c - b)), scaled.cross(&(a - c)), scaled.cross(&(b - a))]
}

impl Beside {
    /// Slopes of the foot when the point moves: row = foot, column = point.
    pub(crate) fn foot_slopes(&self, mesh: &TetMesh) -> Matrix {
        let corners = mesh.boundary()[self.face].points;
        let corners = corners.iter().zip(self.slopes);
        corners.map(|(&c, b)| mesh.points()[c as usize].coords * b.transpose()).sum()
    }
}

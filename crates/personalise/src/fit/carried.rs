//! The skin of a CT, carried by a mesh.

use rayon::prelude::*;
use std::sync::Arc;
use supine_mesh::{
    BoundaryTag, Displacement, Edges, Embedding, Located, Locator, Place, PointTree, TetMesh,
};
use supine_register::Skin;
use supine_space::{Point, Sphere, Vector};

/// A point of the skin this near to the mesh moves as the mesh does there, mm: the mesh's faces cut
/// corners.
const ON_MESH_MM: f64 = 2.5;
/// Nearer than this to the cut the skin is the breast's edge, mm.
const EDGE_MM: f64 = 12.0;
/// The torso beside the mesh counts so much: it is not rigid (see [`crate::fit`]), but fixes the
/// pose.
const TORSO: f64 = 0.3;
/// The skin behind this share of the body's depth lies on a table or in the axilla.
pub const BACK_SHARE: f64 = 0.72;

/// What a point of the skin is to the fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Carried by the mesh.
    Breast,
    /// Carried by the mesh, near the cut.
    Edge,
    /// Beside the mesh: does not move.
    Torso,
    /// Moves and is not modelled: the other breast, the back.
    Unknown,
}

/// The skin of a CT with where each point lies in a mesh.
#[derive(Debug)]
pub struct Carried {
    pub(crate) points: Vec<Point>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) parts: Vec<Part>,
    pub(crate) weights: Vec<f64>,
    /// Points that the mesh carries, and where they lie in it.
    moved: Vec<(u32, Located)>,
    mesh: Arc<TetMesh>,
    edges: Edges,
}

impl Carried {
    /// The skin with respect to a mesh in its CT shape; `other` is the sphere of the other breast,
    /// which moves too.
    pub fn new(skin: &Skin, mesh: &Arc<TetMesh>, other: Option<&Sphere>) -> Self {
        let places = places(skin.points(), mesh);
        let rim = PointTree::new(&rim(mesh));
        let back = back_mm(skin.points());
        let part = |n: usize| {
            let point = &skin.points()[n];
            match places[n] {
                Some(_) if rim.nearest(point, EDGE_MM).is_some() => Part::Edge,
                Some(_) => Part::Breast,
                None if point.y > back => Part::Unknown,
                None if other.is_some_and(|sphere| sphere.contains(point)) => Part::Unknown,
                None => Part::Torso,
            }
        };
        let parts: Vec<Part> = (0..places.len()).map(part).collect();
        let moved = places.into_iter().enumerate();
        Self {
            points: skin.points().to_vec(),
            triangles: skin.triangles().to_vec(),
            weights: parts.iter().map(|part| part.weight()).collect(),
            parts,
            moved: moved.filter_map(|(n, place)| Some((n as u32, place?))).collect(),
            mesh: Arc::clone(mesh),
            edges: Edges::new(mesh),
        }
    }

    /// What each point is.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// A displacement of the mesh at the points that it carries, mm.
    pub(crate) fn carry(&self, displacement: &Displacement) -> Vec<Vector> {
        let at =
            |(_, l): &(u32, Located)| displacement.at(&self.mesh, &self.edges, l.tet, l.weights);
        self.moved.par_iter().map(at).collect()
    }

    /// All points, those that are carried displaced, LPS, mm.
    pub(crate) fn displaced(&self, by: &[Vector]) -> Vec<Point> {
        let mut points = self.points.clone();
        self.moved.iter().zip(by).for_each(|((n, _), u)| points[*n as usize] += u);
        points
    }

    /// Values at the carried points as values at all, 0 elsewhere.
    pub(crate) fn spread(&self, values: &[Vector]) -> Vec<Vector> {
        let mut all = vec![Vector::zeros(); self.points.len()];
        self.moved.iter().zip(values).for_each(|((n, _), v)| all[*n as usize] = *v);
        all
    }
}

impl Part {
    fn weight(self) -> f64 {
        match self {
            Self::Breast | Self::Edge => 1.0,
            Self::Torso => TORSO,
            Self::Unknown => 0.0,
        }
    }
}

/// Where the points on a mesh's skin lie in it: those beside it at their foot.
fn places(points: &[Point], mesh: &Arc<TetMesh>) -> Vec<Option<Located>> {
    let (low, high) = mesh.bounds();
    let margin = Vector::repeat(ON_MESH_MM);
    let (low, high) = (low - margin, high + margin);
    let embedding = Embedding::new(Arc::clone(mesh));
    let locator = Locator::new(Arc::clone(mesh));
    let place = |p: &Point| {
        if (0..3).any(|a| p[a] < low[a] || p[a] > high[a]) {
            return None;
        }
        match embedding.place(p) {
            Place::Inside(found) => Some(found),
            Place::Beside(beside) if beside.distance_mm() <= ON_MESH_MM => {
                Some(locator.nearest(&(p - beside.offset)))
            }
            _ => None,
        }
    };
    points.par_iter().map(place).collect()
}

/// Points of the skin on the cut.
fn rim(mesh: &TetMesh) -> Vec<Point> {
    let cut = mesh.points_on(BoundaryTag::Cut);
    let skin = mesh.points_on(BoundaryTag::Skin);
    let on = cut.iter().filter(|p| skin.binary_search(p).is_ok());
    on.map(|&p| mesh.points()[p as usize]).collect()
}

/// Posterior of this the skin is the back, mm.
fn back_mm(points: &[Point]) -> f64 {
    let y = points.iter().map(|p| p.y);
    let (low, high) = y.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
    low + BACK_SHARE * (high - low)
}

//! The boundary of a given mesh as surfaces to follow.

use crate::boundary::{Boundary, CUT, SKIN, WALL};
use crate::complex::{Class, Complex};
use crate::fields::REACH_MM;
use crate::frame::Frame;
use crate::refinement::Refinement;
use parry3d_f64::math::Vec3;
use parry3d_f64::query::{PointQuery, PointQueryWithLocation};
use parry3d_f64::shape::{Polyline, TriMesh};
use rayon::prelude::*;
use std::collections::BTreeMap;
use supine_space::{Grid, GridError, Matrix, Point, Vector};
use supine_volume::{Volume, sample_trilinear_at};

/// Samples along the longest side of the mesh at which sizes are known.
const SAMPLES: f64 = 44.0;
/// A level where there is no surface of that tag, mm.
const FAR_MM: f64 = 1e3;

/// The tagged faces of a mesh, the rims where two tags meet and the corners where three do.
#[derive(Debug)]
pub(crate) struct Faces {
    /// The faces of each tag.
    patches: [Option<Patch>; 3],
    /// The edges between two tags, by the class of both.
    rims: BTreeMap<Class, Polyline>,
    corners: Vec<Vector>,
    /// Made last, from the rest.
    sizes: Option<Sizes>,
    /// Where it is to be finer, and the frame in which it knows places.
    finer: Option<(Refinement, Frame)>,
}

/// What sizes depend on, mm, on a coarse grid.
#[derive(Debug)]
struct Sizes {
    depth: Volume<f32>,
    /// Distance to the rims.
    rim: Volume<f32>,
    thickness: Volume<f32>,
}

/// The faces of one tag.
struct Patch {
    surface: TriMesh,
    /// Unit normals outwards.
    normals: Vec<Vector>,
}

impl std::fmt::Debug for Patch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Patch({} faces)", self.normals.len())
    }
}

fn vec3(p: &Vector) -> Vec3 {
    Vec3::new(p.x, p.y, p.z)
}

fn vector(p: Vec3) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

impl Faces {
    /// The boundary of `mesh`, whose vertices know their class.
    pub(crate) fn new(mesh: &Complex) -> Result<Self, GridError> {
        let points: Vec<Vec3> = mesh.points.iter().map(vec3).collect();
        let patch = |field: usize| Patch::new(mesh, &points, field as u8 + 1);
        let patches = [SKIN, WALL, CUT].map(patch);
        let mut edges: BTreeMap<Class, Vec<[u32; 2]>> = BTreeMap::new();
        for [a, b] in mesh.edges() {
            let both = mesh.class[a as usize] & mesh.class[b as usize];
            if both.count_ones() < 2 {
                continue;
            }
            let (class, faces) = mesh.edge_class(&mesh.ring(a, b), a, b);
            if faces == 2 && class.count_ones() == 2 {
                edges.entry(class).or_default().push([a, b]);
            }
        }
        let rim = |(class, edges): (Class, Vec<[u32; 2]>)| {
            (class, Polyline::new(points.clone(), Some(edges)))
        };
        let corners = (0..points.len()).filter(|&v| mesh.class[v].count_ones() == 3);
        let mut faces = Self {
            patches,
            rims: edges.into_iter().map(rim).collect(),
            corners: corners.map(|v| mesh.points[v]).collect(),
            sizes: None,
            finer: None,
        };
        let grid = coarse(mesh)?;
        let sample = |of: fn(&Self, &Vector) -> f64| {
            let at = |n: usize| of(&faces, &grid.centre(grid.voxel(n)).coords) as f32;
            let values: Vec<f32> = (0..grid.len()).into_par_iter().map(at).collect();
            Volume::from_fn(grid.clone(), |v| values[grid.offset(v)])
        };
        let (depth, rim) = (sample(Self::depth_at), sample(Self::rim_at));
        let thickness = sample(Self::thickness_at);
        faces.sizes = Some(Sizes { depth, rim, thickness });
        Ok(faces)
    }

    /// The same, to be meshed finer in some places; `frame` is that of the mesh.
    pub(crate) fn refined_in(self, refinement: Refinement, frame: Frame) -> Self {
        Self { finer: Some((refinement, frame)), ..self }
    }

    /// Distance to the nearest face, mm.
    fn depth_at(&self, p: &Vector) -> f64 {
        let away = |patch: &Patch| (patch.nearest(p).0 - p).norm();
        self.patches.iter().flatten().map(away).fold(FAR_MM, f64::min)
    }

    fn rim_at(&self, p: &Vector) -> f64 {
        let away = |rim: &Polyline| rim.distance_to_local_point(vec3(p), false);
        self.rims.values().map(away).fold(FAR_MM, f64::min)
    }

    fn thickness_at(&self, p: &Vector) -> f64 {
        let away = |field: usize| {
            self.patches[field].as_ref().map_or(FAR_MM, |patch| (patch.nearest(p).0 - p).norm())
        };
        away(SKIN) + away(WALL)
    }

    fn sampled(&self, of: fn(&Sizes) -> &Volume<f32>, p: &Vector) -> f64 {
        let known = self.sizes.as_ref().map(of);
        known.map_or(FAR_MM, |v| f64::from(sample_trilinear_at(v, &Point::from(*p))))
    }
}

/// A grid over the mesh and a little around it.
fn coarse(mesh: &Complex) -> Result<Grid, GridError> {
    let start = mesh.points.first().copied().unwrap_or_default();
    let (low, high) = mesh.points.iter().fold((start, start), |(a, b), p| (a.inf(p), b.sup(p)));
    let step = ((high - low).max() / SAMPLES).max(1e-3);
    let size = (high - low).map(|d| (d / step).ceil() + 1.0);
    let size = [0, 1, 2].map(|a| size[a] as usize + 1);
    Grid::new(size, Vector::repeat(step), Point::from(low), Matrix::identity())
}

impl Patch {
    fn new(mesh: &Complex, points: &[Vec3], tag: u8) -> Option<Self> {
        let tagged = mesh.ids().flat_map(|id| (0..4).map(move |corner| (id, corner)));
        let tagged = tagged.filter(|&(id, corner)| mesh.tags[id as usize][corner] == tag);
        let faces: Vec<[u32; 3]> = tagged.map(|(id, corner)| mesh.face(id, corner)).collect();
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| mesh.points[v as usize]);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default()
        };
        let normals = faces.iter().map(normal).collect();
        // Without faces there is no surface.
        Some(Self { surface: TriMesh::new(points.to_vec(), faces).ok()?, normals })
    }

    /// The nearest point of the faces and the normal there.
    fn nearest(&self, p: &Vector) -> (Vector, Vector) {
        let (at, (face, _)) = self.surface.project_local_point_and_get_location(vec3(p), false);
        (vector(at.point), self.normals[face as usize])
    }
}

impl Boundary for Faces {
    fn level_gradient(&self, field: usize, p: &Vector) -> (f64, Vector) {
        let Some(patch) = &self.patches[field] else { return (-FAR_MM, Vector::zeros()) };
        let (at, normal) = patch.nearest(p);
        let away = p - at;
        (away.norm().copysign(away.dot(&normal)), normal)
    }

    fn thickness(&self, p: &Vector) -> f64 {
        self.sampled(|s| &s.thickness, p)
    }

    fn depth(&self, p: &Vector) -> f64 {
        self.sampled(|s| &s.depth, p)
    }

    fn rim_distance(&self, p: &Vector) -> f64 {
        self.sampled(|s| &s.rim, p)
    }

    fn refined(&self, usual: f64, p: &Vector) -> f64 {
        let finer = |(refinement, frame): &(Refinement, Frame)| {
            refinement.length(usual, || frame.to_patient(p))
        };
        self.finer.as_ref().map_or(usual, finer)
    }

    /// Rims and corners are those of the mesh itself: levels count on the faces only.
    fn project(&self, class: Class, p: Vector, level: &[f64; 3]) -> Option<Vector> {
        let to = match class.count_ones() {
            0 => return Some(p),
            1 => {
                let field = class.trailing_zeros() as usize;
                let (at, normal) = self.patches[field].as_ref()?.nearest(&p);
                at + normal * level[field]
            }
            2 => vector(self.rims.get(&class)?.project_local_point(vec3(&p), false).point),
            _ => {
                let away = |c: &&Vector| (*c - p).norm_squared();
                *self.corners.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?
            }
        };
        ((to - p).norm() <= REACH_MM).then_some(to)
    }
}

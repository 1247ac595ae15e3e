//! Fading the displacement towards the cut, so that no step shows there.

use crate::element::min_dets;
use crate::pieces::Curve;
use crate::{Error, Params};
use parry3d_f64::math::Vec3;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::TriMesh;
use rayon::prelude::*;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Displacement, Edges, TetMesh};
use supine_space::{Point, Warning};

/// Width in units of the largest displacement on the cut from which the search starts. The fade
/// alone squeezes tissue by at most 1.5 / 3, so det F stays above about a half.
const FIRST_WIDTH: f64 = 3.0;
/// Each further width.
const WIDER: f64 = 1.25;
/// No fade is wider, mm: beyond it the fade would replace the mechanics.
const WIDEST_MM: f64 = 60.0;
/// Displacements on the cut below this need no fade, mm: a hundredth of a voxel.
const STILL_MM: f64 = 0.005;
/// A fade is wide enough when det F of no tetrahedron falls below this, unless it stays above this
/// share of its value without the fade. Tetrahedra that are inverted without it do not count.
const ENOUGH: f64 = 0.2;
const SHARE: f64 = 0.8;

/// A deformation that fades towards the cut: the map by which CT, points and fields are carried.
#[derive(Clone, Debug)]
pub struct Faded {
    /// The mesh with the faded displacement.
    pub deformation: Deformation,
    /// Width of the fade, mm; 0 when the displacement was left alone.
    pub width_mm: f64,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// The displacement of a deformation with its fade towards the `cut` faces.
///
/// u s(d / w) with s(t) = t² (3 - 2 t), d the distance of the node (CT shape) to the cut. The width
/// w is `params.fade_mm`, or chosen so that det F > 0.
///
/// # Errors
/// When a parameter is out of range.
pub fn fade(deformation: &Deformation, params: &Params) -> Result<Faded, Error> {
    Prepared::new(deformation, params).map(|prepared| prepared.faded)
}

/// What every product begins with: checked parameters, edges, faded displacement.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) edges: Edges,
    pub(crate) faded: Faded,
}

impl Prepared {
    pub(crate) fn new(deformation: &Deformation, params: &Params) -> Result<Self, Error> {
        params.check()?;
        let fading = Fading::new(Arc::clone(deformation.mesh()));
        let faded = fading.fade(deformation, params)?;
        Ok(Self { edges: fading.edges, faded })
    }

    /// The mesh with its faded displacement.
    pub(crate) fn curve(&self) -> Curve<'_> {
        let (mesh, displacement) =
            (self.faded.deformation.mesh(), self.faded.deformation.displacement());
        Curve { mesh, edges: &self.edges, displacement }
    }
}

/// What fades the displacements of a mesh, as often as they change: how far its nodes lie from the
/// cut.
#[derive(Debug)]
pub struct Fading {
    mesh: Arc<TetMesh>,
    edges: Edges,
    /// Of the nodes of a quadratic displacement, mm; none where nothing is cut.
    depths: Option<Vec<f64>>,
    cut_edge_mm: f64,
}

impl Fading {
    /// Of the displacements of a mesh.
    pub fn new(mesh: Arc<TetMesh>) -> Self {
        let edges = Edges::new(&mesh);
        let depths = cut_surface(&mesh).map(|cut| depths(&mesh, &edges, &cut));
        let cut_edge_mm = mean_cut_edge(&mesh);
        Self { mesh, edges, depths, cut_edge_mm }
    }

    /// The largest displacement where the mesh is cut, mm; 0 where nothing is.
    pub fn on_cut_mm(&self, displacement: &Displacement) -> f64 {
        let depths = self.depths.iter().flatten().zip(displacement.values());
        let on_cut = depths.filter(|(depth, _)| **depth < 1e-6);
        on_cut.map(|(_, u)| u.norm()).fold(0.0, f64::max)
    }

    /// As [`fade`]: u s(d / w) with s(t) = t² (3 - 2 t) for t in 0..1, d = distance (mm) of the
    /// node in the CT shape to the nearest cut face, w = width.
    ///
    /// Without a given width: the smallest of a geometric series, not below three times the largest
    /// displacement on the cut nor below the mean edge of the cut faces, that spoils no
    /// tetrahedron.
    ///
    /// # Errors
    /// When a parameter is out of range, or it is a displacement of another mesh.
    pub fn fade(&self, deformation: &Deformation, params: &Params) -> Result<Faded, Error> {
        params.check()?;
        let Self { mesh, edges, .. } = self;
        let displacement = deformation.displacement();
        displacement.check(mesh)?;
        let left_alone =
            Faded { deformation: deformation.clone(), width_mm: 0.0, warnings: Vec::new() };
        let Some(depths) = &self.depths else { return Ok(left_alone) };
        let on_cut = self.on_cut_mm(displacement);
        let at_width = |width: f64| -> Result<Displacement, Error> {
            let values = displacement.values().iter().zip(depths);
            let values = values.map(|(u, depth)| u * share(depth / width)).collect();
            Ok(Displacement::new(mesh, edges, values)?)
        };
        match params.fade_mm {
            Some(0.0) => return Ok(left_alone),
            Some(width) => {
                let deformation = Deformation::new(mesh.clone(), at_width(width)?)?;
                return Ok(Faded { deformation, width_mm: width, warnings: Vec::new() });
            }
            None if on_cut < STILL_MM => return Ok(left_alone),
            None => {}
        }
        let before = min_dets(mesh, edges, displacement);
        let mut width = (FIRST_WIDTH * on_cut).max(self.cut_edge_mm).min(WIDEST_MM);
        let (spoiled, width_mm, displacement) = loop {
            let faded = at_width(width)?;
            let after = min_dets(mesh, edges, &faded);
            let spoiled = before
                .iter()
                .zip(&after)
                .filter(|(b, a)| **b > 0.0 && **a < ENOUGH.min(SHARE * **b))
                .count();
            if spoiled == 0 || width >= WIDEST_MM {
                break (spoiled, width, faded);
            }
            width = (width * WIDER).min(WIDEST_MM);
        };
        let deformation = Deformation::new(mesh.clone(), displacement)?;
        let warnings = warning(on_cut, width_mm, spoiled).into_iter().collect();
        Ok(Faded { deformation, width_mm, warnings })
    }
}

/// What to say of a fade of this width where the tissue moves by `on_cut` mm on the cut.
fn warning(on_cut: f64, width_mm: f64, spoiled: usize) -> Option<Warning> {
    if spoiled > 0 {
        let text = format!(
            "the tissue moves by {on_cut:.1} mm where the region ends, too much to fade within \
             {WIDEST_MM:.0} mm: {spoiled} tetrahedra are squeezed; enlarge the region"
        );
        return Some(
            Warning::new("fade-squeezes", text)
                .value("displacement_mm", on_cut)
                .value("tetrahedra", spoiled as f64),
        );
    }
    (width_mm > 0.5 * WIDEST_MM).then(|| {
        let text = format!(
            "the tissue moves by {on_cut:.1} mm where the region ends; the displacement fades over \
             {width_mm:.0} mm and is too small there; enlarge the region"
        );
        Warning::new("wide-fade", text).value("displacement_mm", on_cut).value("fade_mm", width_mm)
    })
}

fn share(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn cut_surface(mesh: &TetMesh) -> Option<TriMesh> {
    let cut: Vec<[u32; 3]> =
        mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Cut).map(|f| f.points).collect();
    let points = mesh.points().iter().map(vec3).collect();
    TriMesh::new(points, cut).ok()
}

fn vec3(p: &Point) -> Vec3 {
    Vec3::new(p.x, p.y, p.z)
}

/// Distance of every node to the cut, mm.
fn depths(mesh: &TetMesh, edges: &Edges, cut: &TriMesh) -> Vec<f64> {
    let mut nodes = mesh.points().to_vec();
    nodes.extend(edges.ends().iter().map(|e| {
        let [a, b] = e.map(|p| mesh.points()[p as usize]);
        midpoint(a, b)
    }));
    nodes.par_iter().map(|p| cut.distance_to_local_point(vec3(p), true)).collect()
}

fn midpoint(a: Point, b: Point) -> Point {
    a + (b - a) * 0.5
}

fn mean_cut_edge(mesh: &TetMesh) -> f64 {
    let (mut sum, mut n) = (0.0, 0usize);
    for face in mesh.boundary().iter().filter(|f| f.tag == BoundaryTag::Cut) {
        let p = face.points.map(|p| mesh.points()[p as usize]);
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            sum += (p[a] - p[b]).norm();
            n += 1;
        }
    }
    if n == 0 { 0.0 } else { sum / n as f64 }
}

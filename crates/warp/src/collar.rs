//! A thin layer of air-side tetrahedra on the skin, which carries the CT's blurred skin edge along.
//!
//! The skin of a mesh lies within the partial-volume edge of the CT. Without the collar the outer
//! part of that edge would stay behind as a ghost in the air, and the new skin would have a step.

use crate::{pieces::Pieces, pullback::trilinear};
use supine_space::{Point, Vector};
use supine_volume::Ct;

/// The collar's geometry; its vertices come after those of the pieces.
#[derive(Clone, Debug, Default)]
pub(crate) struct Collar {
    /// Outer vertices in the CT, LPS, mm.
    pub(crate) rest: Vec<Point>,
    /// Outer vertices after deformation, LPS, mm.
    pub(crate) deformed: Vec<Point>,
    /// Tetrahedra over the vertices of the pieces, then those of the collar.
    pub(crate) tets: Vec<[u32; 4]>,
}

/// Steps along the normal in which the CT is looked at, mm.
const STEP_MM: f64 = 0.25;
/// Below this is air, with its noise and most of the blurred skin edge, HU.
const AIR_BELOW_HU: f64 = -700.0;
/// Where no air is met, a gap between two skins may still show below this (fat is above it), HU.
const GAP_BELOW_HU: f64 = -250.0;
/// Halvings of a prism's height before it is given up.
const ATTEMPTS: usize = 6;

/// The skin in the CT, from which a collar is extruded for one deformation after the other.
#[derive(Debug)]
pub(crate) struct Skin {
    /// Its vertices among those of the pieces, ascending.
    vertices: Vec<u32>,
    /// Its faces, outwards, as places in `vertices`.
    faces: Vec<[usize; 3]>,
    /// The collar's tetrahedra.
    tets: Vec<[u32; 4]>,
    rest: Vec<Point>,
    normals: Vec<Vector>,
    /// How far the CT lets the collar reach, mm.
    heights: Vec<f64>,
}

impl Skin {
    /// The skin of `pieces` in `ct`, for a collar of up to `height_mm`.
    ///
    /// The height is less where the CT shows other tissue nearby (a fold, an arm).
    pub(crate) fn new(ct: &Ct, pieces: &Pieces, height_mm: f64) -> Self {
        let skin = if height_mm > 0.0 { &pieces.skin[..] } else { &[] };
        let mut vertices: Vec<u32> = skin.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |v: u32| vertices.partition_point(|&w| w < v);
        let faces: Vec<[usize; 3]> = skin.iter().map(|f| f.map(place)).collect();
        let first = pieces.rest.len() as u32;
        let mut tets = Vec::with_capacity(3 * faces.len());
        for face in &faces {
            // Side quads are cut from the lower base vertex to the other's top: neighbours agree.
            let mut prism = *face;
            prism.sort_unstable();
            let base = prism.map(|v| vertices[v]);
            let top = prism.map(|v| first + v as u32);
            tets.push([base[0], base[1], base[2], top[2]]);
            tets.push([base[0], base[1], top[1], top[2]]);
            tets.push([base[0], top[0], top[1], top[2]]);
        }
        let rest: Vec<Point> = vertices.iter().map(|&v| pieces.rest[v as usize]).collect();
        let normals = normals(&rest, &faces);
        let height = |(p, n)| free_height(ct, p, n, height_mm);
        let heights = rest.iter().zip(&normals).map(height).collect();
        Self { vertices, faces, tets, rest, normals, heights }
    }

    /// The collar along the normals, before and after the displacement of `pieces`, which have this
    /// skin.
    ///
    /// It is lower where prisms would be inverted. It keeps its height while it turns with the
    /// skin.
    pub(crate) fn collar(&self, pieces: &Pieces) -> Collar {
        let Self { faces, rest, .. } = self;
        let moved = |v: &u32| pieces.rest[*v as usize] + pieces.displacement[*v as usize];
        let deformed: Vec<Point> = self.vertices.iter().map(moved).collect();
        let (n0, n1) = (&self.normals, &normals(&deformed, faces));
        let mut heights = self.heights.clone();
        for attempt in 0..=ATTEMPTS {
            let bad: Vec<usize> = (0..faces.len())
                .filter(|&f| {
                    let top = |p: &[Point], n: &[Vector], v: usize| p[v] + n[v] * heights[v];
                    inverted(&faces[f], rest, |v| top(rest, n0, v))
                        || inverted(&faces[f], &deformed, |v| top(&deformed, n1, v))
                })
                .collect();
            if bad.is_empty() {
                break;
            }
            let mut concerned: Vec<usize> = bad.iter().flat_map(|&f| faces[f]).collect();
            concerned.sort_unstable();
            concerned.dedup();
            for v in concerned {
                heights[v] = if attempt == ATTEMPTS { 0.0 } else { 0.5 * heights[v] };
            }
        }
        let raised = |p: &[Point], n: &[Vector]| {
            p.iter().zip(n).zip(&heights).map(|((p, n), h)| p + n * *h).collect()
        };
        Collar { rest: raised(rest, n0), deformed: raised(&deformed, n1), tets: self.tets.clone() }
    }
}

/// Unit normals at the vertices: the mean of the faces around each, weighted by area.
fn normals(points: &[Point], faces: &[[usize; 3]]) -> Vec<Vector> {
    let mut sums = vec![Vector::zeros(); points.len()];
    for &[a, b, c] in faces {
        let normal = (points[b] - points[a]).cross(&(points[c] - points[a]));
        for v in [a, b, c] {
            sums[v] += normal;
        }
    }
    sums.into_iter().map(|n| n.try_normalize(0.0).unwrap_or_else(Vector::zeros)).collect()
}

/// How far (mm) the collar may reach from the skin along its normal: up to `height_mm` through air,
/// not beyond the middle of a gap to other tissue, and nowhere where there is no gap.
fn free_height(ct: &Ct, p: &Point, normal: &Vector, height_mm: f64) -> f64 {
    let mut air: Option<(f64, f64)> = None;
    let (mut lowest, mut at) = (f64::INFINITY, 0.0);
    // Twice as far, since the gap must be known to its other side.
    let steps = (2.0 * height_mm / STEP_MM).ceil() as usize;
    for t in (0..=steps).map(|n| n as f64 * STEP_MM) {
        let q = ct.grid().index_from_patient(&(p + normal * t));
        let value = trilinear(ct.data(), ct.grid().size(), q);
        match air {
            None if t > height_mm => break,
            None if value < AIR_BELOW_HU => air = Some((t, t)),
            None if value < lowest => (lowest, at) = (value, t),
            None => {}
            Some((from, _)) if value < AIR_BELOW_HU => air = Some((from, t)),
            Some((from, to)) => return (0.5 * (from + to)).min(height_mm),
        }
    }
    match air {
        Some(_) => height_mm,
        None if lowest < GAP_BELOW_HU => at,
        None => 0.0,
    }
}

/// Whether a prism over a face has a negative corner: the top turned over against the base.
fn inverted(face: &[usize; 3], points: &[Point], top: impl Fn(usize) -> Point) -> bool {
    let base = face.map(|v| points[v]);
    let top = face.map(top);
    let normal = (base[1] - base[0]).cross(&(base[2] - base[0]));
    let above = (top[1] - top[0]).cross(&(top[2] - top[0]));
    if above.dot(&normal) <= 0.0 {
        return true;
    }
    (0..3).any(|v| {
        let up = top[v] - base[v];
        up.norm_squared() > 0.0 && (up.dot(&normal) <= 0.0 || up.dot(&above) <= 0.0)
    })
}

//! Normal and curvature of the chest wall, from the triangles that stand for it.

use crate::boundary::Face;
use nalgebra::{SMatrix, SVector};
use supine_mesh::TetMesh;
use supine_space::{Matrix, Vector};

/// The points about a place that tell its shape: those nearer than this, mm, or the nearest so many
/// where these are fewer. Bumps of a few mm, by which a segmented wall differs from a fascia, are
/// smoothed.
const REACH_MM: f64 = 15.0;
const LEAST: usize = 12;
/// Coefficients of a quadratic height.
const TERMS: usize = 6;

/// The wall's points and the area vectors of the faces around each.
#[derive(Debug)]
pub(crate) struct WallShape {
    points: Vec<Vector>,
    faces: Vec<([u32; 3], Vector)>,
}

impl WallShape {
    /// Of these faces of a mesh.
    pub(crate) fn new(mesh: &TetMesh, faces: &[Face]) -> Self {
        let at = |p: u32| mesh.points()[p as usize].coords;
        let mut numbers: Vec<u32> = faces.iter().flat_map(|face| face.points).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let face = |face: &Face| {
            let [a, b, c] = face.points.map(at);
            (face.points, (b - a).cross(&(c - a)))
        };
        Self {
            points: numbers.into_iter().map(at).collect(),
            faces: faces.iter().map(face).collect(),
        }
    }

    /// Unit normal n and curvature K (1/mm) at a node at `place` that is the point or lies between
    /// the points `ends`: near it the wall is where n · p + ½ p · K p = 0, p from the place.
    ///
    /// By the quadratic height above the mean plane of the faces around that is nearest to the
    /// points about it (least squares); flat where those tell no curvature.
    pub(crate) fn at(&self, place: &Vector, ends: &[u32]) -> (Vector, Matrix) {
        let around = self.faces.iter().filter(|(own, _)| ends.iter().all(|end| own.contains(end)));
        let flat = around.map(|(_, area)| *area).sum::<Vector>().normalize();
        let frame = frame(flat);
        let Some(height) = quadratic(&self.about(place), &frame) else {
            return (flat, Matrix::zeros());
        };
        let [s, t, n] = frame;
        let [_, b, c, d, e, f] = height;
        let normal = n - s * b - t * c;
        let bent = s * s.transpose() * d
            + (s * t.transpose() + t * s.transpose()) * e
            + t * t.transpose() * f;
        (normal / normal.norm(), -bent / normal.norm())
    }

    /// Where the points about a place lie from it.
    fn about(&self, place: &Vector) -> Vec<Vector> {
        let mut all: Vec<Vector> = self.points.iter().map(|p| p - place).collect();
        let near = all.iter().filter(|p| p.norm() < REACH_MM).count().max(LEAST).min(all.len());
        all.sort_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()));
        all.truncate(near);
        all
    }
}

/// Two unit vectors across a normal, and it.
fn frame(normal: Vector) -> [Vector; 3] {
    let across = normal.cross(&Vector::ith(normal.iamin(), 1.0)).normalize();
    [across, normal.cross(&across), normal]
}

/// a, b, c, d, e, f of the height a + b s + c t + ½ d s² + e s t + ½ f t² nearest to some points.
fn quadratic(points: &[Vector], [s, t, n]: &[Vector; 3]) -> Option<[f64; TERMS]> {
    // Lengths in reaches, so that all terms are of one size.
    let (mut matrix, mut right) = (SMatrix::<f64, TERMS, TERMS>::zeros(), SVector::zeros());
    for p in points {
        let [s, t, height] = [s, t, n].map(|axis| axis.dot(p) / REACH_MM);
        let row = SVector::from([1.0, s, t, 0.5 * s * s, s * t, 0.5 * t * t]);
        matrix += row * row.transpose();
        right += row * height;
    }
    let solved = matrix.cholesky()?.solve(&right);
    let scales = [REACH_MM, 1.0, 1.0, 1.0 / REACH_MM, 1.0 / REACH_MM, 1.0 / REACH_MM];
    let coefficients: [f64; TERMS] = std::array::from_fn(|k| solved[k] * scales[k]);
    coefficients.iter().all(|value| value.is_finite()).then_some(coefficients)
}

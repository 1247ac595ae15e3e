//! Curved sides: where the nodes of quadratic elements lie on skin and chest wall.

use crate::Error;
use crate::boundary::{Boundary, CUT};
use crate::complex::Class;
use crate::domain::Domain;
use rayon::prelude::*;
use supine_mesh::{Displacement, Edges, TET_EDGES, TetMesh};
use supine_record::Curved;
use supine_space::Vector;

/// No node moves farther than this share of its (shortest) edge: what lies farther off is no bulge
/// of a surface but the end of a wedge, which has no surface to lie on.
const FARTHEST: f64 = 0.2;
/// The curved elements have at least this volume ratio to the straight ones at every place looked
/// at.
const MIN_RATIO: f64 = 0.3;
/// Offsets around a bad element are halved so often, then left out.
const HALVINGS: usize = 5;

impl Domain {
    /// How far the nodes of quadratic elements lie off the points and edge middles of `mesh` when
    /// those of skin and chest wall lie on their surfaces, mm.
    ///
    /// Points count too: a straight mesh fits its surfaces in the mean, so its corners lie a little
    /// beyond them. On a rim a node lies on both surfaces; the cut itself stays straight, and edges
    /// inside stay straight between their ends. Offsets are shortened where an element would be
    /// squeezed (det of the map from straight to curved below 0.3 at a node or quadrature point).
    ///
    /// # Errors
    /// When an offset is not finite.
    pub fn curved(&self, mesh: &TetMesh) -> Result<(Displacement, Curved), Error> {
        let edges = Edges::new(mesh);
        let full = self.offsets(mesh, &edges);
        let moves: Vec<bool> = full.iter().map(|o| *o != Vector::zeros()).collect();
        let mut share = vec![1.0; full.len()];
        let mut offsets = shared(&full, &share, mesh, &edges)?;
        for halving in 1..=HALVINGS {
            let bad: Vec<usize> = (0..mesh.tets().len())
                .into_par_iter()
                .filter(|&tet| min_ratio(&offsets, mesh, &edges, tet) < MIN_RATIO)
                .collect();
            if bad.is_empty() {
                break;
            }
            let points = mesh.points().len();
            let nodes = |tet: usize| {
                let sides = edges.of_tets()[tet].map(|e| points + e as usize);
                mesh.tets()[tet].map(|p| p as usize).into_iter().chain(sides)
            };
            let mut around: Vec<usize> = bad.into_iter().flat_map(nodes).collect();
            around.sort_unstable();
            around.dedup();
            let factor = if halving < HALVINGS { 0.5 } else { 0.0 };
            around.into_iter().for_each(|n| share[n] *= factor);
            offsets = shared(&full, &share, mesh, &edges)?;
        }
        let curving = told(&offsets, &share, &moves);
        Ok((offsets, curving))
    }

    /// Offsets of the nodes on skin and chest wall to their surfaces; zero for all others.
    fn offsets(&self, mesh: &TetMesh, edges: &Edges) -> Vec<Vector> {
        let points = mesh.points().len();
        let mut class: Vec<Class> = vec![0; points + edges.ends().len()];
        for face in mesh.boundary() {
            let [a, b, c] = face.points;
            let bit = 1 << (face.tag.number() - 1);
            face.points.iter().for_each(|&p| class[p as usize] |= bit);
            for (a, b) in [(a, b), (b, c), (c, a)] {
                if let Some(edge) = edges.between(a, b) {
                    class[points + edge as usize] |= bit;
                }
            }
        }
        let mut shortest = vec![f64::INFINITY; points];
        let ends = |e: usize| edges.ends()[e].map(|p| mesh.points()[p as usize]);
        for (e, both) in edges.ends().iter().enumerate() {
            let [a, b] = ends(e);
            let length = (b - a).norm();
            both.iter().for_each(|&p| shortest[p as usize] = shortest[p as usize].min(length));
        }
        let frame = self.fields.frame();
        let offset = |n: usize| {
            if class[n] == 0 || class[n] == 1 << CUT {
                return Vector::zeros();
            }
            let (place, length) = if n < points {
                (mesh.points()[n], shortest[n])
            } else {
                let [a, b] = ends(n - points);
                (a + (b - a) * 0.5, (b - a).norm())
            };
            let from = frame.of_patient(&place);
            let projected = self.fields.project(class[n], from, &[0.0; 3]);
            let offset = projected.map(|p| frame.axes * (p - from)).unwrap_or_default();
            if offset.norm() <= FARTHEST * length { offset } else { Vector::zeros() }
        };
        (0..class.len()).into_par_iter().map(offset).collect()
    }
}

/// The offsets in their shares; edges that are on no surface stay straight between their ends.
fn shared(
    full: &[Vector],
    share: &[f64],
    mesh: &TetMesh,
    edges: &Edges,
) -> Result<Displacement, Error> {
    let points = mesh.points().len();
    let mut offsets: Vec<Vector> = full.iter().zip(share).map(|(o, s)| o * *s).collect();
    for (e, ends) in edges.ends().iter().enumerate() {
        if full[points + e] == Vector::zeros() {
            let [a, b] = ends.map(|p| offsets[p as usize]);
            offsets[points + e] = (a + b) * 0.5;
        }
    }
    Ok(Displacement::new(mesh, edges, offsets)?)
}

/// Smallest ratio of the volumes of curved and straight element over its nodes and quadrature
/// points.
fn min_ratio(offsets: &Displacement, mesh: &TetMesh, edges: &Edges, tet: usize) -> f64 {
    let near = |at: usize, l: f64| [0, 1, 2, 3].map(|c| if c == at { l } else { (1.0 - l) / 3.0 });
    let corners = (0..4).map(|c| near(c, 1.0));
    // Of the rule of four points.
    let inner = (0..4).map(|c| near(c, (5.0 + 3.0 * 5f64.sqrt()) / 20.0));
    let middles = TET_EDGES
        .into_iter()
        .map(|[a, b]| [0, 1, 2, 3].map(|c| if c == a || c == b { 0.5 } else { 0.0 }));
    let ratio = |l: [f64; 4]| {
        let slope = offsets.gradient(mesh, edges, tet, l);
        (slope + supine_space::Matrix::identity()).determinant()
    };
    corners.chain(middles).chain(inner).map(ratio).fold(f64::INFINITY, f64::min)
}

fn told(offsets: &Displacement, share: &[f64], moves: &[bool]) -> Curved {
    let of_surfaces = || (0..share.len()).filter(|&n| moves[n]);
    let lengths = || of_surfaces().map(|n| offsets.values()[n].norm());
    let nodes = of_surfaces().count();
    Curved {
        nodes,
        shortened: of_surfaces().filter(|&n| share[n] < 1.0).count(),
        mean_mm: if nodes > 0 { lengths().sum::<f64>() / nodes as f64 } else { 0.0 },
        max_mm: lengths().fold(0.0, f64::max),
    }
}

#[cfg(test)]
#[path = "curved_tests.rs"]
mod tests;

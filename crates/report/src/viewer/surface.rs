//! The mesh's skin and cut as triangles, before and after, for the viewer to draw where a plane
//! cuts them.

use crate::Scene;
use base64::Engine;
use serde::Serialize;
use std::collections::BTreeMap;
use supine_mesh::{BoundaryTag, Edges, Order};
use supine_space::{Point, Vector};

/// Unit of the corners' positions, mm: 16 bits hold 0.65 m to either side.
const UNIT_MM: f64 = 0.02;

/// Triangles of the mesh's boundary; numbers little-endian in base64.
#[derive(Debug, Serialize)]
pub(super) struct Surface {
    unit_mm: f64,
    /// Positions of the corners in the CT against the region's centre, LPS, in units: 16 bits,
    /// signed.
    before: String,
    /// The same on the operating table.
    after: String,
    /// Numbers of the corners of each triangle of the skin: 32 bits.
    skin: String,
    /// The same of the cut.
    cut: String,
}

/// The corners that were met, by their place in the mesh.
#[derive(Default)]
struct Corners {
    numbers: BTreeMap<[u32; 2], u32>,
    before: Vec<u8>,
    after: Vec<u8>,
}

impl Surface {
    pub(super) fn new(scene: &Scene<'_>) -> Self {
        let (mesh, edges) = (scene.mesh(), Edges::new(scene.mesh()));
        let mut corners = Corners::default();
        let mut triangles = |tag: BoundaryTag| -> String {
            let mut bytes = Vec::new();
            for face in mesh.boundary().iter().filter(|f| f.tag == tag) {
                for ends in flat(face.points, scene.displacement().order()) {
                    bytes.extend(corners.number(scene, &edges, ends).to_le_bytes());
                }
            }
            base64(&bytes)
        };
        let (skin, cut) = (triangles(BoundaryTag::Skin), triangles(BoundaryTag::Cut));
        let (before, after) = (base64(&corners.before), base64(&corners.after));
        Self { unit_mm: UNIT_MM, before, after, skin, cut }
    }
}

/// The corners of a face's flat triangles, three by three, each as the ends of the edge on whose
/// middle it lies; a node of the mesh as an edge to itself. A quadratic face is taken as four flat
/// ones, as in the pictures.
fn flat([a, b, c]: [u32; 3], order: Order) -> Vec<[u32; 2]> {
    let side = |p: u32, q: u32| [p.min(q), p.max(q)];
    let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
    let [a, b, c] = [[a; 2], [b; 2], [c; 2]];
    match order {
        Order::Quadratic => vec![a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca],
        Order::Linear => vec![a, b, c],
    }
}

impl Corners {
    /// The number of a corner; its positions are kept the first time.
    fn number(&mut self, scene: &Scene<'_>, edges: &Edges, [a, b]: [u32; 2]) -> u32 {
        let next = self.numbers.len() as u32;
        let number = *self.numbers.entry([a, b]).or_insert(next);
        if number == next {
            let points = scene.mesh().points();
            let values = scene.displacement().values();
            let [from, to] = [a, b].map(|p| points[p as usize]);
            let middle = from + 0.5 * (to - from);
            let edge = edges.between(a, b).map(|e| points.len() + e as usize);
            let u = values.get(edge.unwrap_or(a as usize)).copied().unwrap_or_else(Vector::zeros);
            self.before.extend(packed(scene, &middle));
            self.after.extend(packed(scene, &(middle + u)));
        }
        number
    }
}

/// A position (LPS, mm) in units against the region's centre.
fn packed(scene: &Scene<'_>, p: &Point) -> Vec<u8> {
    let away = (p - scene.sphere.centre()) / UNIT_MM;
    away.iter().flat_map(|x| (x.round() as i16).to_le_bytes()).collect()
}

fn base64(bytes: &[u8]) -> String {
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Phantom;
    use supine_space::Matrix;

    fn numbers<const N: usize>(text: &str) -> Vec<[u8; N]> {
        let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
        bytes.chunks_exact(N).map(|c| c.try_into().unwrap()).collect()
    }

    fn mm(text: &str) -> Vec<f64> {
        numbers(text).into_iter().map(|c| f64::from(i16::from_le_bytes(c)) * UNIT_MM).collect()
    }

    #[test]
    fn corners_lie_on_the_mesh_and_move_with_it() {
        let u = Vector::new(2.0, 1.0, -3.0);
        let phantom = Phantom::new(Matrix::identity(), u);
        let scene = phantom.scene();
        let surface = Surface::new(&scene);
        let (before, after) = (mm(&surface.before), mm(&surface.after));
        for (n, (a, b)) in before.iter().zip(&after).enumerate() {
            assert!((b - a - u[n % 3]).abs() < UNIT_MM, "{n}");
        }
        let of = |tag| scene.mesh().boundary().iter().filter(|f| f.tag == tag).count();
        let skin: Vec<u32> = numbers(&surface.skin).into_iter().map(u32::from_le_bytes).collect();
        assert_eq!(skin.len(), 3 * of(BoundaryTag::Skin));
        assert!(skin.iter().all(|&n| (before[3 * n as usize + 1] + 20.0).abs() < UNIT_MM));
        assert_eq!(numbers::<4>(&surface.cut).len(), 3 * of(BoundaryTag::Cut));
    }

    #[test]
    fn a_quadratic_face_is_four_triangles_of_six_corners() {
        let corners = flat([7, 3, 5], Order::Quadratic);
        let mut all = corners.clone();
        all.sort_unstable();
        all.dedup();
        assert_eq!((corners.len(), all.len()), (12, 6));
        assert_eq!(flat([7, 3, 5], Order::Linear), [[7; 2], [3; 2], [5; 2]]);
    }
}

//! Surfaces as bytes, little-endian: u32 number of points, u32 of triangles, f32 x, y, z of each point (LPS, mm), u32 indices
//! of each triangle.

use std::collections::BTreeMap;
use supine_mesh::{BoundaryTag, TetMesh};
use supine_space::{Point, Sphere, Vector};

/// Halvings of an icosahedron's edges: 320 triangles.
const HALVINGS: usize = 2;

/// Points, LPS, mm, and triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Surface {
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The faces of a mesh's boundary with a tag.
    pub(crate) fn of(mesh: &TetMesh, tag: BoundaryTag) -> Self {
        let (mut numbers, mut points) = (BTreeMap::new(), Vec::new());
        let mut number = |point: u32| {
            *numbers.entry(point).or_insert_with(|| {
                points.push(mesh.points()[point as usize]);
                points.len() as u32 - 1
            })
        };
        let faces = mesh.boundary().iter().filter(|face| face.tag == tag);
        let triangles = faces.map(|face| face.points.map(&mut number)).collect();
        Self { points, triangles }
    }

    /// A sphere.
    pub(crate) fn ball(sphere: &Sphere) -> Self {
        let mut unit = icosahedron();
        for _ in 0..HALVINGS {
            unit = unit.halved();
        }
        let on = |p: &Point| sphere.centre() + p.coords * sphere.radius();
        Self { points: unit.points.iter().map(on).collect(), ..unit }
    }

    /// Each triangle as four, the new points on the unit sphere.
    fn halved(&self) -> Self {
        let (mut middles, mut points) = (BTreeMap::new(), self.points.clone());
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let sum: Vector = points[a as usize].coords + points[b as usize].coords;
                points.push(Point::from(sum.normalize()));
                points.len() as u32 - 1
            })
        };
        let four = |&[a, b, c]: &[u32; 3]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        let triangles = self.triangles.iter().flat_map(four).collect();
        Self { points, triangles }
    }

    /// Its bytes.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        let counts = [self.points.len() as u32, self.triangles.len() as u32];
        let points = self.points.iter().flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]);
        let head = counts.into_iter().flat_map(u32::to_le_bytes);
        let triangles = self.triangles.iter().flatten().flat_map(|n| n.to_le_bytes());
        head.chain(points.flat_map(f32::to_le_bytes)).chain(triangles).collect()
    }
}

fn icosahedron() -> Surface {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(Point::from));
    }
    let edge = |p: &Point, q: &Point| ((p - q).norm() - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|n: usize| points[n]);
                if edge(&p, &q) && edge(&q, &r) && edge(&r, &p) {
                    let out = (q - p).cross(&(r - p)).dot(&p.coords) > 0.0;
                    let turned = if out { [a, b, c] } else { [a, c, b] };
                    triangles.push(turned.map(|n| n as u32));
                }
            }
        }
    }
    let points = points.iter().map(|p: &Point| Point::from(p.coords.normalize())).collect();
    Surface { points, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_closed_round_and_faces_out() {
        let sphere = Sphere::new(Point::new(10.0, -20.0, 30.0), 7.0).unwrap();
        let ball = Surface::ball(&sphere);
        assert_eq!((ball.points.len(), ball.triangles.len()), (162, 320));
        let mut volume = 0.0;
        for triangle in &ball.triangles {
            let [a, b, c] = triangle.map(|n| ball.points[n as usize] - sphere.centre());
            let part = a.dot(&b.cross(&c)) / 6.0;
            assert!(part > 0.0);
            volume += part;
        }
        let whole = 4.0 / 3.0 * std::f64::consts::PI * 7.0_f64.powi(3);
        assert!((0.93..1.0).contains(&(volume / whole)), "{volume} of {whole}");
        let bytes = ball.bytes();
        assert_eq!(bytes.len(), 8 + 162 * 12 + 320 * 12);
        assert_eq!(bytes[..8], [162, 0, 0, 0, 64, 1, 0, 0]);
    }
}

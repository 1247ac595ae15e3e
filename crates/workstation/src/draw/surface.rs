//! Surfaces and arrows as bytes, little-endian. A surface: u32 number of points, u32 of triangles,
//! f32 x, y, z of each point (LPS, mm), u32 indices of each triangle. Arrows: u32 number, u32 0,
//! f32 x, y, z of both ends of each (LPS, mm). Points: u32 number, u32 0, f32 x, y, z (LPS, mm) and
//! value of each.

use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{BoundaryTag, Deformation, Edges, Order, ScanDistances, Split, TetMesh};
use supine_space::{Point, Sphere, Vector};
use supine_volume::{LabelMap, Layers, isosurface, label};

/// Halvings of an icosahedron's edges: 320 triangles.
const HALVINGS: usize = 2;

/// At most so many arrows are drawn.
const ARROWS: usize = 400;
/// The patient's skin is drawn on a grid so coarse, mm.
const COARSE_MM: f64 = 6.0;

/// In which shape of the breast something is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Ct,
    Deformed,
    Both,
}

impl Shape {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Ct => "ct",
            Self::Deformed => "deformed",
            Self::Both => "both",
        }
    }
}

/// What is drawn in space.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Drawn {
    Triangles(Surface),
    Arrows(Vec<[Point; 2]>),
    /// A scan by its distances from the last of its surfaces, mm; NaN where none is known.
    Scan(Arc<ScanDistances>),
}

impl Drawn {
    /// The displacements of nodes of a mesh, evenly among them, from where they were.
    pub(crate) fn arrows(carried: &Deformation) -> Self {
        let (points, moves) = (carried.mesh().points(), carried.displacement().values());
        let each = points.len().div_ceil(ARROWS).max(1);
        let arrow = |n: usize| [points[n], points[n] + moves[n]];
        Self::Arrows((0..points.len()).step_by(each).map(arrow).collect())
    }

    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Triangles(_) => "triangles",
            Self::Arrows(_) => "arrows",
            Self::Scan(_) => "points",
        }
    }

    /// Its bytes.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Triangles(surface) => surface.bytes(),
            Self::Arrows(all) => {
                let head = [all.len() as u32, 0].into_iter().flat_map(u32::to_le_bytes);
                head.chain(all.iter().flatten().flat_map(place)).collect()
            }
            Self::Scan(scan) => {
                let far = scan.surfaces.last().map_or(&[][..], |surface| &surface.mm);
                let head = [far.len() as u32, 0].into_iter().flat_map(u32::to_le_bytes);
                let value = |mm: &Option<f64>| mm.map_or(f32::NAN, |mm| mm as f32);
                let points = scan.places.iter().zip(far);
                let one = |(p, mm)| place(p).chain(value(mm).to_le_bytes());
                head.chain(points.flat_map(one)).collect()
            }
        }
    }
}

/// The bytes of a position.
fn place(p: &Point) -> impl Iterator<Item = u8> + use<> {
    [p.x as f32, p.y as f32, p.z as f32].into_iter().flat_map(f32::to_le_bytes)
}

/// Points, LPS, mm, and triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Surface {
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The faces of a mesh's boundary with a tag.
    pub(crate) fn of(mesh: &TetMesh, tag: BoundaryTag) -> Self {
        Self::faces(mesh, tag, |point| mesh.points()[point as usize])
    }

    /// The same of a displaced mesh, quadratic faces as four flat ones; nothing where a tetrahedron
    /// is too flat to be split.
    pub(crate) fn carried(carried: &Deformation, tag: BoundaryTag) -> Option<Self> {
        let (mesh, u) = (carried.mesh(), carried.displacement());
        let moved = |mesh: &TetMesh| {
            Self::faces(mesh, tag, |n| mesh.points()[n as usize] + u.values()[n as usize])
        };
        match u.order() {
            Order::Linear => Some(moved(mesh)),
            Order::Quadratic => Some(moved(&Split::new(mesh, &Edges::new(mesh)).ok()?.mesh)),
        }
    }

    fn faces(mesh: &TetMesh, tag: BoundaryTag, at: impl Fn(u32) -> Point) -> Self {
        let (mut numbers, mut points) = (BTreeMap::new(), Vec::new());
        let mut number = |point: u32| {
            *numbers.entry(point).or_insert_with(|| {
                points.push(at(point));
                points.len() as u32 - 1
            })
        };
        let faces = mesh.boundary().iter().filter(|face| face.tag == tag);
        let triangles = faces.map(|face| face.points.map(&mut number)).collect();
        Self { points, triangles }
    }

    /// The border of all labels, coarse; nothing where there are none.
    pub(crate) fn body(labels: &LabelMap) -> Option<Self> {
        let grid = labels.grid();
        let (size, spacing) = (grid.size(), grid.spacing());
        let step = [0, 1, 2].map(|a| ((COARSE_MM / spacing[a]).round() as usize).max(1));
        let count = [0, 1, 2].map(|a| size[a].div_ceil(step[a]));
        let outside = |v: [usize; 3]| {
            let at = [0, 1, 2].map(|a| (v[a] * step[a]).min(size[a] - 1));
            if labels.at(at) == label::OUTSIDE { 1.0 } else { -1.0 }
        };
        let layer = |k: usize| -> Vec<f32> {
            let rows = (0..count[1]).flat_map(|j| (0..count[0]).map(move |i| [i, j, k]));
            rows.map(outside).collect()
        };
        let values: Vec<Vec<f32>> = (0..count[2]).map(layer).collect();
        let at =
            |v: [usize; 3]| grid.patient_from_index([0, 1, 2].map(|a| (v[a] * step[a]) as f64));
        let (mut points, triangles) =
            isosurface(&Layers { size: [count[0], count[1]], values: &values }, at);
        smooth(&mut points, &triangles);
        (!triangles.is_empty()).then_some(Self { points, triangles })
    }

    /// With each point moved; nothing where one cannot be.
    pub(crate) fn moved(&self, by: impl Fn(&Point) -> Option<Vector>) -> Option<Self> {
        let points = self.points.iter().map(|p| Some(p + by(p)?)).collect::<Option<_>>()?;
        Some(Self { points, triangles: self.triangles.clone() })
    }

    /// LPS, mm.
    pub(crate) fn points(&self) -> &[Point] {
        &self.points
    }

    /// Three numbers of points each.
    pub(crate) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
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
        let head = counts.into_iter().flat_map(u32::to_le_bytes);
        let triangles = self.triangles.iter().flatten().flat_map(|n| n.to_le_bytes());
        head.chain(self.points.iter().flat_map(place)).chain(triangles).collect()
    }
}

/// Takes the steps of the voxels away: each point moves half way to the middle of its neighbours, a
/// few times.
fn smooth(points: &mut [Point], triangles: &[[u32; 3]]) {
    const ROUNDS: usize = 4;
    for _ in 0..ROUNDS {
        let mut sums = vec![(Vector::zeros(), 0.0); points.len()];
        for [a, b, c] in triangles {
            for (n, others) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                let (sum, count) = &mut sums[*n as usize];
                for other in others {
                    *sum += points[*other as usize].coords;
                    *count += 1.0;
                }
            }
        }
        for (p, (sum, count)) in points.iter_mut().zip(sums).filter(|(_, (_, n))| *n > 0.0) {
            *p = Point::from((p.coords + sum / count) / 2.0);
        }
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

//! A synthetic torso with a known displacement, for the tests.

use crate::Scene;
use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{
    BoundaryFace, BoundaryTag, Deformation, Displacement, Edges, TET_FACES, TetMesh,
};
use supine_space::{Grid, Matrix, Point, Side, Sphere, Vector};
use supine_volume::{Ct, LabelMap, Surfaces, Volume, label};

/// Centre of a dense cube at the patient's left, front and head side, LPS, mm.
pub(crate) const MARKER: [f64; 3] = [34.0, -26.0, 22.0];
/// Half of its side, mm.
pub(crate) const MARKER_HALF: f64 = 6.5;

/// Products of a run on the torso.
pub(crate) struct Phantom {
    pub(crate) ct: Ct,
    pub(crate) deformed: Ct,
    pub(crate) labels: LabelMap,
    pub(crate) surfaces: Surfaces,
    pub(crate) uncertainty: Volume<u8>,
    pub(crate) tissues: LabelMap,
    pub(crate) deformation: Deformation,
}

impl Phantom {
    /// The torso on a grid whose axes are the columns of `axes`, with everything in the mesh
    /// moved by `u` (mm).
    pub(crate) fn new(axes: Matrix, u: Vector) -> Self {
        let spacing = Vector::repeat(2.0);
        let size = [61; 3];
        let origin = Point::from(axes * Vector::repeat(-60.0));
        let grid = Grid::new(size, spacing, origin, axes).unwrap();
        let hu = |p: Point| {
            let marker = (p - Point::from(MARKER)).abs().max() < MARKER_HALF;
            let body = (p.x / 55.0).powi(2) + (p.y / 42.0).powi(2) < 1.0;
            if marker {
                1000
            } else if body {
                0
            } else {
                -1000
            }
        };
        let ct = Volume::from_fn(grid.clone(), |v| hu(grid.centre(v)));
        let deformed = Volume::from_fn(grid.clone(), |v| hu(grid.centre(v) - u));
        let labels = Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            match hu(p) {
                -1000 => label::OUTSIDE,
                _ if p.y > 5.0 => label::CHEST_WALL,
                _ => label::SOFT_TISSUE,
            }
        });
        let mesh = block(4, 40.0);
        let values = vec![u; mesh.points().len()];
        let displacement = Displacement::new(&mesh, &Edges::new(&mesh), values).unwrap();
        let deformation = Deformation::new(Arc::new(mesh), displacement).unwrap();
        // The patient's left half of the boundary is uncertain.
        let uncertainty = Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let near = (p.y - 5.0).abs() < 3.0 && hu(p) > -1000;
            if near && p.x > 0.0 { 40 } else { u8::from(near) }
        });
        let tissues = Volume::from_fn(grid.clone(), |v| match labels.at(v) {
            label::CHEST_WALL => label::MUSCLE,
            label::SOFT_TISSUE if grid.centre(v).x > 0.0 => label::GLAND,
            label::SOFT_TISSUE => label::FAT,
            other => other,
        });
        let surfaces = Surfaces::half_way(&labels);
        Self { ct, deformed, labels, surfaces, uncertainty, tissues, deformation }
    }

    /// The scene with the nipple as focus; no tumour.
    pub(crate) fn scene(&self) -> Scene<'_> {
        Scene {
            ct: &self.ct,
            deformed: &self.deformed,
            labels: &self.labels,
            surfaces: &self.surfaces,
            uncertainty: Some(&self.uncertainty),
            tissues: Some(&self.tissues),
            deformation: &self.deformation,
            tissue: self.deformation.displacement(),
            sphere: Sphere::new(Point::origin(), 48.0).unwrap(),
            tumour: None,
            tumour_after: None,
            tumour_within: None,
            nipple: Some(Point::from(MARKER)),
            side: Side::Left,
        }
    }
}

/// A cube of tetrahedra around the origin, `n` cells and `side` mm along each axis: skin in front,
/// chest wall behind, cut elsewhere.
pub(crate) fn block(n: u32, side: f64) -> TetMesh {
    let m = n + 1;
    let place = |i: u32| side * (f64::from(i) / f64::from(n) - 0.5);
    let points: Vec<Point> = (0..m.pow(3))
        .map(|p| Point::new(place(p % m), place(p / m % m), place(p / (m * m))))
        .collect();
    let mut tets = Vec::new();
    for cell in 0..n.pow(3) {
        let (i, j, k) = (cell % n, cell / n % n, cell / (n * n));
        let at = |c: u32| (i + (c & 1)) + m * (j + (c >> 1 & 1)) + m * m * (k + (c >> 2 & 1));
        let six =
            [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
        tets.extend(six.map(|t| t.map(at)));
    }
    let mut faces: BTreeMap<[u32; 3], usize> = BTreeMap::new();
    for tet in &tets {
        for face in TET_FACES {
            let mut key = face.map(|c| tet[c]);
            key.sort_unstable();
            *faces.entry(key).or_default() += 1;
        }
    }
    let tag = |face: [u32; 3]| {
        let y = face.map(|p| points[p as usize].y);
        match y {
            _ if y.iter().all(|y| *y == -side / 2.0) => BoundaryTag::Skin,
            _ if y.iter().all(|y| *y == side / 2.0) => BoundaryTag::ChestWall,
            _ => BoundaryTag::Cut,
        }
    };
    let outer = faces.into_iter().filter(|(_, n)| *n == 1);
    let boundary = outer.map(|(points, _)| BoundaryFace { points, tag: tag(points) }).collect();
    TetMesh::new(points.clone(), tets, boundary).unwrap()
}

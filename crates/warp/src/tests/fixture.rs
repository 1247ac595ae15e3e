//! What the tests are made of: stored workloads, meshes, volumes.

use ndarray::{ArrayD, OwnedRepr};
use ndarray_npy::{NpzReader, ReadableElement};
use std::fs::File;
use std::sync::Arc;
use supine_mesh::{
    BoundaryFace, BoundaryTag, Deformation, Displacement, Edges, Order, TET_FACES, TetMesh,
};
use supine_space::{Point, Vector};

/// A file of arrays in fixtures/warp.
pub(super) struct Archive(NpzReader<File>);

impl Archive {
    #[expect(clippy::disallowed_methods, reason = "test data")]
    pub(super) fn open(name: &str) -> Self {
        let path = format!("{}/../../fixtures/warp/{name}", env!("CARGO_MANIFEST_DIR"));
        Self(NpzReader::new(File::open(path).unwrap()).unwrap())
    }

    fn array<T: ReadableElement>(&mut self, name: &str) -> Vec<T> {
        let array: ArrayD<T> = self.0.by_name::<OwnedRepr<T>, _>(name).unwrap();
        assert!(array.is_standard_layout(), "{name} is not in C order");
        array.into_raw_vec_and_offset().0
    }

    pub(super) fn integers(&mut self, name: &str) -> Vec<i32> {
        self.array(name)
    }

    pub(super) fn hu(&mut self, name: &str) -> Vec<i16> {
        self.array(name)
    }

    pub(super) fn flags(&mut self, name: &str) -> Vec<i8> {
        self.array(name)
    }

    pub(super) fn floats(&mut self, name: &str) -> Vec<f64> {
        self.array(name)
    }

    pub(super) fn vectors(&mut self, name: &str) -> Vec<[f64; 3]> {
        self.floats(name).chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
    }

    pub(super) fn tets(&mut self, name: &str) -> Vec<[u32; 4]> {
        let flat = self.integers(name);
        flat.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]].map(|v| v as u32)).collect()
    }

    /// Voxels along i, j, k from a stored shape (slices, rows, columns).
    pub(super) fn size(&mut self, name: &str) -> [usize; 3] {
        let shape = self.integers(name);
        [shape[2], shape[1], shape[0]].map(|n| n as usize)
    }
}

/// A CT of integers alone, the same on every machine: ramps with hashed noise of four bits.
pub(crate) fn patterned_ct(size: [usize; 3], seed: u64) -> Vec<i16> {
    const MASK: u64 = 0xffff_ffff;
    let voxel = |n: usize| {
        let mut hash = (n as u64 * 2_654_435_761 + seed) & MASK;
        hash ^= hash >> 15;
        hash = (hash * 2_246_822_519) & MASK;
        hash ^= hash >> 13;
        let (i, j, k) = (n % size[0], n / size[0] % size[1], n / (size[0] * size[1]));
        ((i * 9 + j * 5 + k * 11) % 1500) as i16 - 1000 + (hash % 16) as i16
    };
    (0..size.iter().product()).map(voxel).collect()
}

/// A mesh whose boundary faces are tagged by their centre.
pub(super) fn mesh(
    points: Vec<Point>,
    tets: Vec<[u32; 4]>,
    tag: impl Fn(Point) -> BoundaryTag,
) -> Arc<TetMesh> {
    let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::new();
    for tet in &tets {
        for face in TET_FACES {
            let face = face.map(|c| tet[c]);
            let mut key = face;
            key.sort_unstable();
            faces.push((key, face));
        }
    }
    faces.sort_unstable();
    let open = faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
    let boundary = open
        .map(|same| {
            let p = same[0].1.map(|v| points[v as usize].coords);
            BoundaryFace { points: same[0].1, tag: tag(Point::from((p[0] + p[1] + p[2]) / 3.0)) }
        })
        .collect();
    Arc::new(TetMesh::new(points, tets, boundary).unwrap())
}

/// `n` cubes of side `step` along each axis from `origin`, six positive tetrahedra each.
pub(crate) fn lattice(
    n: [usize; 3],
    step: f64,
    origin: Point,
    tag: impl Fn(Point) -> BoundaryTag,
) -> Arc<TetMesh> {
    let id = |v: [usize; 3]| ((v[2] * (n[1] + 1) + v[1]) * (n[0] + 1) + v[0]) as u32;
    let mut points = Vec::new();
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            for i in 0..=n[0] {
                let at = Vector::new(i as f64, j as f64, k as f64);
                points.push(origin + at * step);
            }
        }
    }
    let mut tets = Vec::new();
    let paths = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]];
    for cell in 0..n[0] * n[1] * n[2] {
        let start = [cell % n[0], cell / n[0] % n[1], cell / (n[0] * n[1])];
        for (turn, path) in paths.into_iter().enumerate() {
            let mut at = start;
            let mut tet = [id(at); 4];
            for step in 0..3 {
                at[path[step]] += 1;
                tet[step + 1] = id(at);
            }
            if turn >= 3 {
                tet.swap(1, 2);
            }
            tets.push(tet);
        }
    }
    mesh(points, tets, tag)
}

/// `mesh` with its nodes displaced by a function of their place in the CT.
pub(crate) fn moved(mesh: &Arc<TetMesh>, order: Order, u: impl Fn(Point) -> Vector) -> Deformation {
    let edges = Edges::new(mesh);
    let mut values: Vec<Vector> = mesh.points().iter().map(|p| u(*p)).collect();
    if order == Order::Quadratic {
        let at = |p: u32| mesh.points()[p as usize];
        values.extend(edges.ends().iter().map(|[a, b]| u(at(*a) + (at(*b) - at(*a)) * 0.5)));
    }
    Deformation::new(mesh.clone(), Displacement::new(mesh, &edges, values).unwrap()).unwrap()
}

/// `mesh` as it is in the CT.
pub(super) fn still(mesh: &Arc<TetMesh>) -> Deformation {
    Deformation::new(mesh.clone(), Displacement::zero(mesh)).unwrap()
}

//! A block of tetrahedra and a ball of them for tests.

use std::collections::BTreeMap;
use std::sync::Arc;
use supine_mesh::{BoundaryFace, BoundaryTag, Displacement, Edges, TET_FACES, TetMesh};
use supine_space::{Point, Vector};

/// The corners of the six tetrahedra of a cube around its diagonal, as steps along the axes.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// A block of `cells` cubes of side `side` mm, six tetrahedra each, its points shaken by `shake`
/// of these. The face at z = 0 is chest wall, the rest skin.
pub(crate) fn block(cells: [usize; 3], side: f64, shake: f64) -> Arc<TetMesh> {
    let at = |c: [usize; 3]| ((c[2] * (cells[1] + 1) + c[1]) * (cells[0] + 1) + c[0]) as u32;
    let mut points = Vec::new();
    for z in 0..=cells[2] {
        for y in 0..=cells[1] {
            for x in 0..=cells[0] {
                let n = points.len() as f64;
                let mut p = Point::new(x as f64, y as f64, z as f64) * side;
                // The wall stays plane.
                if z > 0 {
                    let wave = |k: f64| shake * side * (12.9898 * k * (n + 1.0)).sin();
                    p += Vector::new(wave(1.0), wave(2.1), wave(3.3));
                }
                points.push(p);
            }
        }
    }
    let mut tets = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                for path in PATHS {
                    let mut c = [x, y, z];
                    let mut tet = [at(c); 4];
                    for (k, axis) in path.into_iter().enumerate() {
                        c[axis] += 1;
                        tet[k + 1] = at(c);
                    }
                    let [a, b, d, e] = tet.map(|p| points[p as usize]);
                    if (b - a).dot(&(d - a).cross(&(e - a))) < 0.0 {
                        tet.swap(2, 3);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    let mut open: BTreeMap<[u32; 3], [u32; 3]> = BTreeMap::new();
    for tet in &tets {
        for face in TET_FACES.map(|f| f.map(|c| tet[c])) {
            let mut key = face;
            key.sort_unstable();
            if open.remove(&key).is_none() {
                open.insert(key, face);
            }
        }
    }
    let wall = |face: &[u32; 3]| face.iter().all(|&p| points[p as usize].z == 0.0);
    let boundary = open
        .into_values()
        .map(|face| BoundaryFace {
            points: face,
            tag: if wall(&face) { BoundaryTag::ChestWall } else { BoundaryTag::Skin },
        })
        .collect();
    TetMesh::new(points.clone(), tets, boundary).expect("a block").into()
}

/// The mesh with the tag that `tag` gives to the corners of each boundary face.
pub(crate) fn tagged(mesh: &TetMesh, tag: impl Fn(&[Point; 3]) -> BoundaryTag) -> Arc<TetMesh> {
    let mut boundary = mesh.boundary().to_vec();
    for face in &mut boundary {
        face.tag = tag(&face.points.map(|p| mesh.points()[p as usize]));
    }
    TetMesh::new(mesh.points().to_vec(), mesh.tets().to_vec(), boundary)
        .expect("the same mesh")
        .into()
}

/// The mesh with its points raised along z by ½ `curvature` (1/mm) times the square of their
/// distance from the axis.
pub(crate) fn bent(mesh: &TetMesh, curvature: f64) -> Arc<TetMesh> {
    let raised = |p: &Point| Point::new(p.x, p.y, p.z + 0.5 * curvature * (p.x * p.x + p.y * p.y));
    let points = mesh.points().iter().map(raised).collect();
    TetMesh::new(points, mesh.tets().to_vec(), mesh.boundary().to_vec()).expect("a block").into()
}

/// Points on the unit sphere and triangles between them, outward: an icosahedron whose triangles
/// are cut into four `rounds` times.
pub(crate) fn icosphere(rounds: usize) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut points = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        points.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(|p| Vector::from(p).normalize()));
    }
    let near = |a: &Vector, b: &Vector| (a - b).norm() < 1.2;
    let mut triangles = Vec::new();
    for (i, a) in points.iter().enumerate() {
        for (j, b) in points.iter().enumerate().skip(i + 1) {
            for (k, c) in points.iter().enumerate().skip(j + 1) {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(&(c - a)).dot(a) > 0.0;
                    let [i, j, k] = [i, j, k].map(|n| n as u32);
                    triangles.push(if outward { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..rounds {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        let cut = triangles.iter().flat_map(|&[a, b, c]| {
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        });
        triangles = cut.collect();
    }
    (points, triangles)
}

/// A ball of radius `outer` held at its surface, with points on the concentric sphere of radius
/// `inner`, and how far the middles of its edges lie off its concentric spheres.
pub(crate) fn ball(
    inner: f64,
    outer: f64,
    layers: usize,
    rounds: usize,
) -> (Arc<TetMesh>, Displacement) {
    let (unit, triangles) = icosphere(rounds);
    let each = unit.len() as u32;
    let mut points = vec![Point::origin()];
    for layer in 0..=layers {
        let radius = inner * (outer / inner).powf(layer as f64 / layers as f64);
        points.extend(unit.iter().map(|p| Point::from(p * radius)));
    }
    let at = |layer: usize, n: u32| 1 + layer as u32 * each + n;
    let mut tets: Vec<[u32; 4]> =
        triangles.iter().map(|t| [0, at(0, t[0]), at(0, t[1]), at(0, t[2])]).collect();
    for layer in 0..layers {
        for triangle in &triangles {
            let mut sorted = *triangle;
            sorted.sort_unstable();
            let [[a, b, c], [d, e, f]] = [layer, layer + 1].map(|l| sorted.map(|n| at(l, n)));
            tets.extend([[a, b, c, f], [a, b, e, f], [a, d, e, f]]);
        }
    }
    for tet in &mut tets {
        let [a, b, c, d] = tet.map(|p| points[p as usize]);
        if (b - a).dot(&(c - a).cross(&(d - a))) < 0.0 {
            tet.swap(2, 3);
        }
    }
    let outside = |t: &[u32; 3]| BoundaryFace {
        points: t.map(|n| at(layers, n)),
        tag: BoundaryTag::ChestWall,
    };
    let mesh = TetMesh::new(points, tets, triangles.iter().map(outside).collect()).expect("a ball");
    let edges = Edges::new(&mesh);
    let mut off = vec![Vector::zeros(); mesh.points().len()];
    for ends in edges.ends() {
        let [a, b] = ends.map(|n| mesh.points()[n as usize].coords);
        let (radius, middle) = ((a.norm() + b.norm()) / 2.0, (a + b) / 2.0);
        let inside = ends.contains(&0);
        off.push(if inside { Vector::zeros() } else { middle.normalize() * radius - middle });
    }
    let off = Displacement::new(&mesh, &edges, off).expect("one vector per node");
    (mesh.into(), off)
}

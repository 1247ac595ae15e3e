//! A block of tetrahedra for tests.

use std::collections::BTreeMap;
use supine_mesh::{BoundaryFace, BoundaryTag, TET_FACES, TetMesh};
use supine_space::Point;

/// The corners of the six tetrahedra of a cube around its diagonal, as steps along the axes.
const PATHS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

/// A block of `cells` cubes of side `side` mm, six tetrahedra each, its points shaken by `shake`
/// sides. The face at z = 0 is chest wall, the rest skin.
pub(crate) fn block(cells: [usize; 3], side: f64, shake: f64) -> TetMesh {
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
                    p += supine_space::Vector::new(wave(1.0), wave(2.1), wave(3.3));
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
    TetMesh::new(points.clone(), tets, boundary).expect("a block")
}

/// The mesh with the tag that `tag` gives to the corners of each boundary face.
pub(crate) fn tagged(mesh: &TetMesh, tag: impl Fn(&[Point; 3]) -> BoundaryTag) -> TetMesh {
    let mut boundary = mesh.boundary().to_vec();
    for face in &mut boundary {
        face.tag = tag(&face.points.map(|p| mesh.points()[p as usize]));
    }
    TetMesh::new(mesh.points().to_vec(), mesh.tets().to_vec(), boundary).expect("the same mesh")
}

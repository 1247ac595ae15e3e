//! What a plane shows of a mesh: the tetrahedron below each pixel, and the faces it cuts.

use crate::{BoundaryTag, Displacement, Edges, Order, TET_FACES, TetMesh};
use supine_space::{Matrix, Plane, Point, Spot, Vector};

/// The tetrahedron of the CT shape below a pixel, with the pixel's barycentric coordinates.
pub type Below = Option<(usize, [f64; 4])>;

/// Barycentric slack that keeps pixels on a face from falling between two tetrahedra.
const ON_FACE: f64 = 1e-9;

/// The tetrahedron below each pixel, row by row; the lowest where two meet.
pub fn below(mesh: &TetMesh, plane: &Plane) -> Vec<Below> {
    let mut pixels = vec![None; plane.width * plane.height];
    for tet in 0..mesh.tets().len() {
        let corners = mesh.corners(tet);
        let depth = corners.map(|c| plane.depth(&c));
        if depth.iter().all(|d| *d > 0.0) || depth.iter().all(|d| *d < 0.0) {
            continue;
        }
        let Some(gradients) = gradients(&corners) else { continue };
        let spots = corners.map(|c| plane.spot(&c));
        let range = |a: usize, end: usize| {
            let low = spots.iter().map(|s| s[a]).fold(f64::INFINITY, f64::min);
            let high = spots.iter().map(|s| s[a]).fold(f64::NEG_INFINITY, f64::max);
            low.ceil().max(0.0) as usize..(high.floor().max(-1.0) + 1.0).min(end as f64) as usize
        };
        for y in range(1, plane.height) {
            for x in range(0, plane.width) {
                let n = y * plane.width + x;
                if pixels[n].is_none() {
                    let from = plane.patient([x as f64, y as f64]) - corners[0];
                    let l = gradients.map(|g| g.dot(&from));
                    let weights = [1.0 + l[0], l[1], l[2], l[3]];
                    if weights.iter().all(|w| *w >= -ON_FACE) {
                        pixels[n] = Some((tet, weights));
                    }
                }
            }
        }
    }
    pixels
}

/// Gradients of the four barycentric coordinates, 1/mm; `None` for a flat tetrahedron.
fn gradients(corners: &[Point; 4]) -> Option<[Vector; 4]> {
    let sides = [1, 2, 3].map(|c| corners[c] - corners[0]);
    let inverse = Matrix::from_columns(&sides).try_inverse()?;
    let [b, c, d] = [0, 1, 2].map(|r| inverse.row(r).transpose());
    Some([-(b + c + d), b, c, d])
}

/// det F of the deformation x + u within tetrahedron `tet` at barycentric coordinates `l`: the
/// local change of volume.
pub fn det_f(
    mesh: &TetMesh,
    edges: &Edges,
    displacement: &Displacement,
    tet: usize,
    l: [f64; 4],
) -> f64 {
    (Matrix::identity() + displacement.gradient(mesh, edges, tet, l)).determinant()
}

/// The faces of a mesh, each once, with the tag of those on the boundary.
#[derive(Debug)]
pub struct Faces<'a> {
    mesh: &'a TetMesh,
    faces: Vec<([u32; 3], Option<BoundaryTag>)>,
}

/// A line in which a plane cuts a face.
#[derive(Clone, Copy, Debug)]
pub struct FaceCut {
    /// The line.
    pub segment: [Spot; 2],
    /// The tag of a boundary face.
    pub tag: Option<BoundaryTag>,
}

impl<'a> Faces<'a> {
    /// The faces of `mesh`.
    pub fn new(mesh: &'a TetMesh) -> Self {
        let key = |mut face: [u32; 3]| {
            face.sort_unstable();
            face
        };
        let mut tags: Vec<([u32; 3], BoundaryTag)> =
            mesh.boundary().iter().map(|f| (key(f.points), f.tag)).collect();
        tags.sort_unstable();
        let mut keys: Vec<[u32; 3]> =
            mesh.tets().iter().flat_map(|t| TET_FACES.map(|f| key(f.map(|c| t[c])))).collect();
        keys.sort_unstable();
        keys.dedup();
        let tag =
            |k: [u32; 3]| tags.binary_search_by_key(&k, |t| t.0).ok().map(|found| tags[found].1);
        Self { mesh, faces: keys.into_iter().map(|k| (k, tag(k))).collect() }
    }

    /// The lines in which a plane cuts the faces of the mesh, displaced if a displacement is given.
    ///
    /// A quadratic face is taken as four flat ones.
    pub fn cut(
        &self,
        edges: &Edges,
        displacement: Option<&Displacement>,
        plane: &Plane,
    ) -> Vec<FaceCut> {
        let seen = |p: &Point| {
            let [x, y] = plane.spot(p);
            [x, y, plane.depth(p)]
        };
        self.cut_by(edges, displacement, &seen)
    }

    /// The same for a plane of any frame: `seen` gives a position's two coordinates in the plane,
    /// and its distance from it in any unit.
    pub fn cut_by(
        &self,
        edges: &Edges,
        displacement: Option<&Displacement>,
        seen: &dyn Fn(&Point) -> [f64; 3],
    ) -> Vec<FaceCut> {
        let points = self.mesh.points();
        let moved = |p: u32| {
            let u = displacement.map_or_else(Vector::zeros, |d| d.values()[p as usize]);
            points[p as usize] + u
        };
        let quadratic = displacement.filter(|d| d.order() == Order::Quadratic);
        let side = |a: u32, b: u32| {
            let middle = points[a as usize] + (points[b as usize] - points[a as usize]) / 2.0;
            let edge = edges.between(a, b).map(|e| points.len() + e as usize);
            let u = quadratic.zip(edge).map_or_else(Vector::zeros, |(d, e)| d.values()[e]);
            middle + u
        };
        let mut cuts = Vec::new();
        for ([a, b, c], tag) in &self.faces {
            let corner = [moved(*a), moved(*b), moved(*c)];
            let mut add = |triangle: [Point; 3]| {
                cuts.extend(
                    cut_triangle(&triangle.map(|p| seen(&p)))
                        .map(|segment| FaceCut { segment, tag: *tag }),
                );
            };
            if quadratic.is_some() {
                let [ab, bc, ca] = [side(*a, *b), side(*b, *c), side(*c, *a)];
                add([corner[0], ab, ca]);
                add([ab, corner[1], bc]);
                add([ca, bc, corner[2]]);
                add([ab, bc, ca]);
            } else {
                add(corner);
            }
        }
        cuts
    }
}

/// The line in which a plane cuts a triangle, whose corners lie at two coordinates and a distance
/// from it.
pub fn cut_triangle(corners: &[[f64; 3]; 3]) -> Option<[Spot; 2]> {
    let crossing = |a: usize, b: usize| {
        let [from, to] = [corners[a], corners[b]];
        ((from[2] >= 0.0) != (to[2] >= 0.0)).then(|| {
            let t = from[2] / (from[2] - to[2]);
            [from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t]
        })
    };
    let mut ends = [(0, 1), (1, 2), (2, 0)].into_iter().filter_map(|(a, b)| crossing(a, b));
    Some([ends.next()?, ends.next()?])
}

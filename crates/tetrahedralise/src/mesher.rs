//! The mesh under work together with the fields and sizes that steer it.

use crate::boundary::{Boundary, WALL};
use crate::complex::Complex;
use crate::sizing::Sizing;
use supine_space::Vector;

/// A mesh, the fields its boundary follows and the edge lengths it aims at.
pub(crate) struct Mesher<'a> {
    pub mesh: Complex,
    pub sizing: Sizing<'a>,
}

/// Boundary faces may turn this far from the field's normal (cosine) before it counts.
const NORMAL_COSINE: f64 = 0.78;
/// Their centroid may lie this far from the surface, as a share of the longest edge ...
const SAG: f64 = 0.09;
/// ... plus this, mm, before it counts.
const SAG_MM: f64 = 0.05;
/// An edge whose middle lies this share of the wanted length off its surface is long enough.
const BRIDGED: f64 = 0.06;
/// Where a field has less slope than this there is no surface of it.
const MIN_SLOPE: f64 = 0.2;
/// The fault of a face where its field has no surface.
const LOST: f64 = 2.0;

impl<'a> Mesher<'a> {
    pub(crate) fn fields(&self) -> &'a dyn Boundary {
        self.sizing.fields
    }

    /// How badly a boundary face (corners outwards) follows the field of its tag: 0 is well.
    ///
    /// Used only as "not worse than before": as a hard rule it would freeze bad faces for ever.
    pub(crate) fn face_fault(&self, tag: u8, [a, b, c]: &[Vector; 3]) -> f64 {
        let middle = (a + b + c) / 3.0;
        let normal = (b - a).cross(&(c - a));
        let (level, slope) = self.fields().level_gradient(usize::from(tag - 1), &middle);
        let steep = slope.norm();
        let tight = if usize::from(tag - 1) == WALL { 0.05 } else { MIN_SLOPE };
        if steep < tight {
            return LOST;
        }
        let longest = (b - a).norm_squared().max((c - a).norm_squared());
        let longest = longest.max((c - b).norm_squared()).sqrt();
        let cosine = normal.dot(&slope) / (normal.norm() * steep).max(1e-12);
        let off = (level / steep.min(1.0)).abs() - SAG * longest - SAG_MM;
        (NORMAL_COSINE - cosine).max(0.0) + (off / longest).max(0.0)
    }

    /// The worst fault among the boundary faces at `v` if `v` were at `at`; stops above `limit`.
    pub(crate) fn star_fault(&self, v: u32, at: &Vector, limit: f64) -> f64 {
        let mut worst = 0.0f64;
        for (id, corner) in self.mesh.boundary_faces(v) {
            let face = self.mesh.face(id, corner);
            let place = face.map(|w| if w == v { *at } else { self.mesh.points[w as usize] });
            worst = worst.max(self.face_fault(self.mesh.tags[id as usize][corner], &place));
            if worst > limit {
                break;
            }
        }
        worst
    }

    /// The point near `p` on the surfaces of vertex `v`, at the vertex's own levels.
    pub(crate) fn project(&self, v: u32, p: Vector) -> Option<Vector> {
        let class = self.mesh.class[v as usize];
        if class == 0 {
            return Some(p);
        }
        self.fields().project(class, p, &self.mesh.level[v as usize])
    }

    /// Edge length wanted at vertex `v`, mm.
    pub(crate) fn size_at(&self, v: u32) -> f64 {
        self.sizing.at(&self.mesh.points[v as usize])
    }

    /// All edges with their length in units of the wanted one, shortest first. An edge that bridges
    /// a hollow or a ridge counts as longer than it is.
    pub(crate) fn edges_by_length(&self) -> Vec<(f64, [u32; 2])> {
        let length = |e| {
            let middle = self.mesh.middle(e);
            let size = self.sizing.at(&middle);
            let bridged = (self.bridged(e) / (BRIDGED * size)).sqrt();
            ((self.mesh.length(e) / size).max(bridged), e)
        };
        let mut edges: Vec<(f64, [u32; 2])> = self.mesh.edges().into_iter().map(length).collect();
        edges.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        edges
    }

    /// Whether one edge bridges no more than is well, or than another did in its place.
    pub(crate) fn bridges_no_more(&self, new: [u32; 2], old: [u32; 2]) -> bool {
        let well = BRIDGED * self.sizing.at(&self.mesh.middle(new));
        let off = self.bridged(new);
        off <= well || off <= self.bridged(old)
    }

    /// How far the middle of an edge along a surface lies off it, beside what its ends do, mm.
    fn bridged(&self, [a, b]: [u32; 2]) -> f64 {
        let both = self.mesh.class[a as usize] & self.mesh.class[b as usize];
        let middle = self.mesh.middle([a, b]);
        let off = |field: usize| {
            let ends = [a, b].map(|v| self.mesh.level[v as usize][field]);
            (self.fields().level(field, &middle) - 0.5 * (ends[0] + ends[1])).abs()
        };
        (0..3).filter(|f| both >> f & 1 == 1).map(off).fold(0.0, f64::max)
    }

    /// Tetrahedra worse than `threshold`, worst first.
    pub(crate) fn bad(&self, threshold: f64) -> Vec<u32> {
        let quality = |t: &u32| self.mesh.quality[*t as usize];
        let mut bad: Vec<u32> = self.mesh.ids().filter(|t| quality(t) < threshold).collect();
        bad.sort_by(|a, b| quality(a).total_cmp(&quality(b)).then(a.cmp(b)));
        bad
    }
}

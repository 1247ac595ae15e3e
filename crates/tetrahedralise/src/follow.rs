//! Bringing the faces nearer to the surfaces they follow, where levels of single vertices cannot:
//! edges that bridge a hollow or a ridge are flipped, and vertices slide along their surface.
//!
//! What is bettered is the integral of the fourth power of the distance over the faces concerned:
//! the worst places weigh most, and none is bought with much on the mean.

use crate::boundary::Boundary;
use crate::fit::SAMPLES;
use crate::mesher::Mesher;
use std::ops::RangeInclusive;
use supine_space::Vector;

/// A change must take away this share of the distance's integral.
const GAIN: f64 = 0.05;
/// Faces this near to their surface are left alone, mm: no labels tell more.
const NEAR_MM: f64 = 0.03;
/// First step of a slide as a share of the wanted edge length.
const STEP: f64 = 0.15;
/// Halvings of a step before a slide is given up.
const HALVINGS: usize = 3;
/// Step of the difference quotients as a share of the wanted edge length.
const PROBE: f64 = 1e-3;

impl Mesher<'_> {
    /// Flips and slides over the whole boundary; tetrahedra stay better than `threshold`, or get
    /// no worse, and the count changes at each flip by a number in `delta`.
    pub(crate) fn follow(&mut self, threshold: f64, delta: &RangeInclusive<i64>) {
        for edge in self.surface_edges() {
            self.flip_nearer(edge, threshold, delta);
        }
        for v in 0..self.mesh.points.len() as u32 {
            let on_surface = self.mesh.class[v as usize].count_ones() == 1;
            if on_surface && !self.mesh.star[v as usize].is_empty() {
                self.slide(v, threshold);
            }
        }
    }

    /// The largest distance of a face to its surface, mm.
    pub(crate) fn furthest(&self) -> f64 {
        self.mesh.ids().map(|id| self.off(id)).fold(0.0, f64::max)
    }

    /// The largest distance to their surface of the faces of one tetrahedron, mm; 0 inside.
    pub(crate) fn off(&self, id: u32) -> f64 {
        let mesh = &self.mesh;
        let mut furthest = 0.0f64;
        for corner in (0..4).filter(|&c| mesh.tags[id as usize][c] != 0) {
            let field = usize::from(mesh.tags[id as usize][corner] - 1);
            let p = mesh.face(id, corner).map(|v| mesh.points[v as usize]);
            for weights in SAMPLES {
                let at: Vector = p.iter().zip(weights).map(|(p, w)| p * w).sum();
                furthest = furthest.max(self.fields().level(field, &at).abs());
            }
        }
        furthest
    }

    /// Edges of the boundary, lower vertex first, sorted.
    pub(crate) fn surface_edges(&self) -> Vec<[u32; 2]> {
        let mesh = &self.mesh;
        let mut edges = Vec::new();
        for id in mesh.ids() {
            for corner in (0..4).filter(|&c| mesh.tags[id as usize][c] != 0) {
                let [a, b, c] = mesh.face(id, corner);
                edges.extend([[a, b], [b, c], [a, c]].map(|[p, q]| [p.min(q), p.max(q)]));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Flips a boundary edge when that brings the two faces nearer to their surface.
    fn flip_nearer(&mut self, edge: [u32; 2], threshold: f64, delta: &RangeInclusive<i64>) -> bool {
        let lowest = |worst: f64| (worst - 1e-9).min(threshold);
        self.flip_edge(edge, delta, lowest, |m, tag, before, after| {
            let field = usize::from(tag - 1);
            let error = |faces: [[Vector; 3]; 2]| {
                faces.iter().map(|face| face_error(m.fields(), field, face)).sum::<f64>()
            };
            let now = error(before);
            now > before.iter().map(near).sum() && error(after) < (1.0 - GAIN) * now
        })
    }

    /// Moves a vertex along its surface, at its level, to where its faces are nearer to it.
    fn slide(&mut self, v: u32, threshold: f64) -> bool {
        let (mesh, fields) = (&self.mesh, self.fields());
        let field = mesh.class[v as usize].trailing_zeros() as usize;
        let faces: Vec<[Vector; 2]> = mesh
            .boundary_faces(v)
            .map(|(id, corner)| {
                let face = mesh.face(id, corner);
                let own = face.iter().position(|&w| w == v).unwrap_or(0);
                [1, 2].map(|n| mesh.points[face[(own + n) % 3] as usize])
            })
            .collect();
        let error = |at: &Vector| -> f64 {
            faces.iter().map(|[p, q]| face_error(fields, field, &[*at, *p, *q])).sum()
        };
        let start = mesh.points[v as usize];
        let size = self.size_at(v);
        let now = error(&start);
        if now < faces.iter().map(|[p, q]| near(&[start, *p, *q])).sum() {
            return false;
        }
        let probe = PROBE * size;
        let mut slope = Vector::from_fn(|axis, _| {
            let mut at = start;
            at[axis] += probe;
            (error(&at) - now) / probe
        });
        self.keep_tangential(mesh.class[v as usize], &start, std::slice::from_mut(&mut slope));
        let Some(downhill) = (-slope).try_normalize(1e-12) else { return false };
        let lowest = mesh.worst_of(&mesh.star[v as usize]).min(threshold);
        let limit = self.star_fault(v, &start, f64::INFINITY) + 1e-9;
        let mut step = STEP * size;
        for _ in 0..=HALVINGS {
            let to = self.project(v, start + downhill * step);
            if let Some(to) = to.filter(|to| error(to) < (1.0 - GAIN) * now)
                && self.star_fault(v, &to, limit) <= limit
            {
                self.mesh.move_vertex(v, to);
                if self.mesh.worst_of(&self.mesh.star[v as usize]) >= lowest {
                    return true;
                }
                self.mesh.move_vertex(v, start);
            }
            step *= 0.4;
        }
        false
    }
}

/// What the integral is over a face that is near enough to its surface, mm⁶.
fn near([a, b, c]: &[Vector; 3]) -> f64 {
    0.5 * (b - a).cross(&(c - a)).norm() * NEAR_MM.powi(4)
}

/// Integral over a face of the fourth power of its distance to its field, mm⁶.
fn face_error(fields: &dyn Boundary, field: usize, p: &[Vector; 3]) -> f64 {
    let area = 0.5 * (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
    let level = |weights: [f64; 3]| {
        let at: Vector = p.iter().zip(weights).map(|(p, w)| p * w).sum();
        fields.level(field, &at).powi(4)
    };
    area * SAMPLES.into_iter().map(level).sum::<f64>() / SAMPLES.len() as f64
}

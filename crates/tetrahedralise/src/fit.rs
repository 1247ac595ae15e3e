//! Placing the surface so that its triangles, not its vertices, lie on the fields on average.
//!
//! With vertices on a convex surface all triangles lie inside it, and the volume shrinks. Each
//! boundary vertex gets a level of its own for each of its fields, such that the area-weighted
//! mean of the field over its triangles vanishes; on a rim, the mean over both its triangles and
//! its rim edges.

use crate::count::NONE;
use crate::mesher::Mesher;
use supine_space::{Progress, Stopped, Vector};

/// Sweeps of levels and smoothing.
const SWEEPS: usize = 6;
/// Sweeps at the end.
const CLOSING: usize = 4;
/// Share of the mean error that a sweep takes away.
const SHARE: f64 = 0.9;
/// Share of its level that a vertex keeps: levels of neighbours that lie on opposite sides cancel
/// in the mean and would grow.
const KEPT: f64 = 0.93;
/// Vertices may leave their surfaces this far in units of the edge length.
const LEVEL: f64 = 0.15;
/// Vertices on rims may leave their surfaces this far, mm.
const RIM_LEVEL_MM: f64 = 0.4;
/// Quality that may be lost for a better place, and above which it does not count.
const BEARABLE: f64 = 0.08;
const GOOD: f64 = 0.45;

/// Points (barycentric) where a triangle's distance to its field is sampled.
pub(crate) const SAMPLES: [[f64; 3]; 6] = [
    [2. / 3., 1. / 6., 1. / 6.],
    [1. / 6., 2. / 3., 1. / 6.],
    [1. / 6., 1. / 6., 2. / 3.],
    [0.5, 0.5, 0.0],
    [0.5, 0.0, 0.5],
    [0.0, 0.5, 0.5],
];

/// Weight of the rim edges against the triangles at a vertex on a rim.
const RIM_SHARE: f64 = 0.45;
/// Shares of a rim edge where its distance to the fields is sampled.
const RIM_SAMPLES: [f64; 4] = [0.125, 0.375, 0.625, 0.875];

impl Mesher<'_> {
    /// Fits the boundary to the fields in the mean.
    pub(crate) fn fit(&mut self, threshold: f64, progress: Progress<'_>) -> Result<(), Stopped> {
        for sweep in 0..SWEEPS {
            progress.at(sweep as f64 / SWEEPS as f64)?;
            self.shift_all(|before| GOOD.min(before) - BEARABLE);
            if sweep + 1 < SWEEPS {
                self.follow(threshold, &NONE);
                self.smooth_all(threshold, 3);
            }
        }
        Ok(())
    }

    /// Fits the boundary to the fields in the mean where the tetrahedra stay better than
    /// `threshold` or get no worse.
    pub(crate) fn close(&mut self, threshold: f64, progress: Progress<'_>) -> Result<(), Stopped> {
        for sweep in 0..CLOSING {
            progress.at(sweep as f64 / CLOSING as f64)?;
            self.shift_all(|before| threshold.min(before));
            self.follow(threshold, &NONE);
        }
        self.shift_all(|before| threshold.min(before));
        Ok(())
    }

    /// Shifts the levels of all boundary vertices against the mean errors; `least`: quality that
    /// the tetrahedra must keep, from their worst before.
    fn shift_all(&mut self, lowest: impl Fn(f64) -> f64) {
        let mut error = self.mean_errors();
        self.mean_rim_errors(&mut error);
        for v in 0..self.mesh.points.len() as u32 {
            if self.mesh.class[v as usize] != 0 && !self.mesh.star[v as usize].is_empty() {
                self.shift(v, &error[v as usize], &lowest);
            }
        }
    }

    /// Area-weighted mean level of each field over the triangles of each vertex, mm.
    fn mean_errors(&self) -> Vec<[f64; 3]> {
        let mesh = &self.mesh;
        let mut sum = vec![[(0.0, 0.0); 3]; mesh.points.len()];
        for id in mesh.ids() {
            for corner in (0..4).filter(|&c| mesh.tags[id as usize][c] != 0) {
                let field = usize::from(mesh.tags[id as usize][corner] - 1);
                let face = mesh.face(id, corner);
                let p = face.map(|v| mesh.points[v as usize]);
                let area = (p[1] - p[0]).cross(&(p[2] - p[0])).norm();
                for weights in SAMPLES {
                    let at: Vector = p.iter().zip(weights).map(|(p, w)| p * w).sum();
                    let level = self.fields().level(field, &at);
                    for (v, w) in face.into_iter().zip(weights) {
                        let (error, weight) = &mut sum[v as usize][field];
                        *error += area * w * level;
                        *weight += area * w;
                    }
                }
            }
        }
        sum.into_iter().map(|s| s.map(|(e, w)| if w > 0.0 { e / w } else { 0.0 })).collect()
    }

    /// Mixes in, for each vertex on a rim, the length-weighted mean level of both fields over its
    /// rim edges, mm.
    fn mean_rim_errors(&self, errors: &mut [[f64; 3]]) {
        let mesh = &self.mesh;
        let mut sum = vec![([0.0; 3], 0.0); mesh.points.len()];
        for [a, b] in mesh.edges() {
            let both = mesh.class[a as usize] & mesh.class[b as usize];
            if both.count_ones() < 2 {
                continue;
            }
            let (class, _) = mesh.edge_class(&mesh.ring(a, b), a, b);
            if class.count_ones() < 2 {
                continue;
            }
            let (pa, pb) = (mesh.points[a as usize], mesh.points[b as usize]);
            for t in RIM_SAMPLES {
                let levels = self.fields().levels(&(pa + (pb - pa) * t));
                for (v, w) in [(a, 1.0 - t), (b, t)] {
                    let (errors, weight) = &mut sum[v as usize];
                    let w = w * (pb - pa).norm();
                    for f in (0..3).filter(|f| class >> f & 1 == 1) {
                        errors[f] += w * levels[f];
                    }
                    *weight += w;
                }
            }
        }
        for (v, (error, weight)) in sum.into_iter().enumerate() {
            if weight > 0.0 && mesh.class[v].count_ones() == 2 {
                for f in 0..3 {
                    errors[v][f] += RIM_SHARE * (error[f] / weight - errors[v][f]);
                }
            }
        }
    }

    /// Shifts the levels of a vertex against the mean error, if its tetrahedra bear it.
    fn shift(&mut self, v: u32, error: &[f64; 3], lowest: &impl Fn(f64) -> f64) {
        let class = self.mesh.class[v as usize];
        let limit = if class.count_ones() > 1 { RIM_LEVEL_MM } else { LEVEL * self.size_at(v) };
        let old = self.mesh.level[v as usize];
        let mut level = old;
        for f in (0..3).filter(|f| class >> f & 1 == 1) {
            level[f] = (KEPT * old[f] - SHARE * error[f]).clamp(-limit, limit);
        }
        let from = self.mesh.points[v as usize];
        let Some(to) = self.fields().project(class, from, &level) else { return };
        if self.bears(v, to, lowest, false) || self.bears(v, to, lowest, true) {
            self.mesh.level[v as usize] = level;
        }
    }

    /// Moves a vertex when the tetrahedra bear it, if asked for with its neighbours making way.
    fn bears(&mut self, v: u32, to: Vector, lowest: &impl Fn(f64) -> f64, way: bool) -> bool {
        self.mesh.begin();
        self.mesh.move_vertex(v, to);
        if way {
            for w in self.mesh.neighbours(v) {
                self.smooth(w, 2);
            }
        }
        let (before, after) = self.mesh.effect();
        let keep = after >= lowest(before);
        if keep {
            self.mesh.commit()
        } else {
            self.mesh.rollback()
        }
        keep
    }
}

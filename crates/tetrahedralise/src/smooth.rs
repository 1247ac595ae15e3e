//! Moving single vertices so that the worst tetrahedron around them gets better.

use crate::complex::Class;
use crate::mesher::Mesher;
use crate::shape::shape;
use supine_space::Vector;

/// Qualities this near the worst count as worst too when a direction is sought.
const ACTIVE: f64 = 0.04;
/// Most tetrahedra that share in a direction.
const MAX_ACTIVE: usize = 8;
/// Least gain of a move.
const GAIN: f64 = 1e-4;
/// Halvings of a step before the direction is given up.
const HALVINGS: usize = 5;
/// Neighbours whose worst tetrahedron is better than this need no smoothing.
const CONTENT: f64 = 0.62;
/// First step as a share of the wanted edge length.
const STEP: f64 = 0.12;

/// The tetrahedra around a vertex, with the vertex's place among the corners of each.
struct Star {
    tets: Vec<([Vector; 4], usize)>,
}

impl Star {
    /// Worst quality with the vertex at `at`; may stop early once it is below `enough`.
    fn worst(&self, at: Vector, enough: f64) -> f64 {
        let mut worst = f64::INFINITY;
        for (corners, own) in &self.tets {
            let mut p = *corners;
            p[*own] = at;
            worst = worst.min(shape(&p));
            if worst < enough {
                break;
            }
        }
        worst
    }

    /// Gradients of the qualities near the worst, with the vertex at `at`.
    fn gradients(&self, at: Vector, worst: f64, step: f64) -> Vec<Vector> {
        let mut active: Vec<(f64, usize)> = Vec::with_capacity(MAX_ACTIVE);
        for (n, (corners, own)) in self.tets.iter().enumerate() {
            let mut p = *corners;
            p[*own] = at;
            let quality = shape(&p);
            if quality < worst + ACTIVE {
                active.push((quality, n));
            }
        }
        active.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        active.truncate(MAX_ACTIVE);
        let slope = |(quality, n): (f64, usize)| {
            let (mut p, own) = self.tets[n];
            Vector::from_fn(|axis, _| {
                p[own] = at;
                p[own][axis] += step;
                (shape(&p) - quality) / step
            })
        };
        active.into_iter().map(slope).collect()
    }
}

/// The shortest vector of the convex hull: the direction in which all grow, or 0.
///
/// Gilbert's iteration: step towards the vector that grows least along the present one.
fn shortest(vectors: &[Vector]) -> Vector {
    let Some(mut d) = vectors.first().copied() else { return Vector::zeros() };
    for _ in 0..20 {
        let lowest = vectors.iter().min_by(|a, b| a.dot(&d).total_cmp(&b.dot(&d)));
        let Some(v) = lowest else { break };
        if v.dot(&d) >= d.norm_squared() * 0.98 {
            break;
        }
        let step = d - v;
        let share = (d.dot(&step) / step.norm_squared().max(1e-300)).clamp(0.0, 1.0);
        d -= step * share;
    }
    d
}

impl Mesher<'_> {
    /// Moves vertex `v` (on its surfaces) so that its worst tetrahedron gets better, in up to
    /// `moves` steps; the boundary follows its fields no worse than before. Returns whether it
    /// moved. Corners stay.
    pub(crate) fn smooth(&mut self, v: u32, moves: usize) -> bool {
        let class = self.mesh.class[v as usize];
        let ids = &self.mesh.star[v as usize];
        if class.count_ones() == 3 || ids.is_empty() {
            return false;
        }
        let corners = |&id: &u32| {
            (self.mesh.corners(self.mesh.tets[id as usize]), self.mesh.corner_of(id, v))
        };
        let star = Star { tets: ids.iter().map(corners).collect() };
        let start = self.mesh.points[v as usize];
        let mut worst = self.mesh.worst_of(ids);
        let mut at = start;
        let limit = if class == 0 { 0.0 } else { self.star_fault(v, &start, f64::INFINITY) + 1e-9 };
        let size = self.size_at(v);
        let mut step = STEP * size;
        let accept = |to: Vector, worst: &mut f64, at: &mut Vector| {
            let Some(to) = self.project(v, to) else { return false };
            let quality = star.worst(to, *worst + GAIN);
            let better =
                quality > *worst + GAIN && (class == 0 || self.star_fault(v, &to, limit) <= limit);
            if better {
                (*worst, *at) = (quality, to);
            }
            better
        };
        if let Some(middle) = self.middle_of_neighbours(v, class)
            && !accept(middle, &mut worst, &mut at)
        {
            accept((middle + start) * 0.5, &mut worst, &mut at);
        }
        for _ in 0..moves {
            let mut slopes = star.gradients(at, worst, 1e-4 * size);
            self.keep_tangential(class, &at, &mut slopes);
            let direction = shortest(&slopes);
            let steep = direction.norm();
            if steep * size < 1e-3 {
                break;
            }
            let unit = direction / steep;
            let mut length = step;
            let improved = (0..HALVINGS).any(|_| {
                let accepted = accept(at + unit * length, &mut worst, &mut at);
                if !accepted {
                    length *= 0.4;
                }
                accepted
            });
            if !improved {
                break;
            }
            step = (1.5 * length).min(STEP * size);
        }
        let moved = at != start;
        if moved {
            self.mesh.move_vertex(v, at);
        }
        moved
    }

    /// Middle of the neighbours that share the class of the vertex.
    fn middle_of_neighbours(&self, v: u32, class: Class) -> Option<Vector> {
        let mesh = &self.mesh;
        let near = if class == 0 { mesh.neighbours(v) } else { mesh.boundary_neighbours(v) };
        let alike = near.into_iter().filter(|&w| mesh.class[w as usize] & class == class);
        let (mut sum, mut count) = (Vector::zeros(), 0);
        for w in alike {
            sum += mesh.points[w as usize];
            count += 1;
        }
        (count > 0).then(|| sum / f64::from(count))
    }

    /// Takes from the slopes what leads off the surfaces of the class.
    pub(crate) fn keep_tangential(&self, class: Class, at: &Vector, slopes: &mut [Vector]) {
        let mut normals: Vec<Vector> = Vec::new();
        for f in (0..3).filter(|f| class >> f & 1 == 1) {
            let (_, mut normal) = self.fields().level_gradient(f, at);
            for n in &normals {
                normal -= n * n.dot(&normal);
            }
            if let Some(unit) = normal.try_normalize(1e-6) {
                normals.push(unit);
            }
        }
        for slope in slopes {
            for n in &normals {
                *slope -= n * n.dot(slope);
            }
        }
    }

    /// Smooths the vertices of all tetrahedra worse than `threshold`, worst first; returns how
    /// many moved.
    pub(crate) fn smooth_all(&mut self, threshold: f64, moves: usize) -> usize {
        let mesh = &self.mesh;
        let mut vertices: Vec<(f64, u32)> = (0..mesh.points.len() as u32)
            .filter(|&v| !mesh.star[v as usize].is_empty())
            .map(|v| (mesh.worst_of(&mesh.star[v as usize]), v))
            .filter(|(worst, _)| *worst < threshold)
            .collect();
        vertices.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        vertices.into_iter().filter(|&(_, v)| self.smooth(v, moves)).count()
    }

    /// Smooths `v` and then those of its neighbours that need it.
    pub(crate) fn smooth_around(&mut self, v: u32) {
        self.smooth(v, 5);
        for w in self.mesh.neighbours(v) {
            if self.mesh.worst_of(&self.mesh.star[w as usize]) < CONTENT {
                self.smooth(w, 2);
            }
        }
        self.smooth(v, 2);
    }
}

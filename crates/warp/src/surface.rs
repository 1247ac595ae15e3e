//! Closed surfaces carried along.

use crate::{Error, Params, fade};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use supine_mesh::{Deformation, Embedding, Motion, Surround, TriSurface};
use supine_space::{Point, Progress, Vector};

/// What became of a closed surface, or of the solid within contours.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// Volume enclosed in the CT and after deformation, mL.
    pub volume_ml: [f64; 2],
    /// Points of the surface before edges were split that moved by more than 0.01 mm.
    pub moved_points: usize,
    /// Points that were added on edges, so that these follow the curved map.
    pub added_points: usize,
    /// Largest displacement of a point, mm.
    pub max_displacement_mm: f64,
}

/// The edges of the carried triangles follow the carried edges within this, mm.
const TOLERANCE_MM: f64 = 0.1;
/// Edges are not made shorter than half of this, mm. The map is compared with an edge at steps of
/// this.
const STEP_MM: f64 = 1.0;
/// Sides of triangles within the reach of the mesh are no longer than this, mm: the map inside a
/// larger triangle does not show on its edges.
const LONGEST_MM: f64 = 5.0;
/// The way on which the motion beside the skin falls to nothing behind the collar, mm.
const DECAY_MM: f64 = 40.0;
/// Points that move less are said to stay, mm.
const MOVED_MM: f64 = 0.01;
/// Halvings: 5 m to 1 mm.
const ROUNDS: usize = 13;

/// A closed surface (LPS, mm) in the operating position; `deformation` as the solver gave it, the
/// fade is applied within.
///
/// Points in the mesh move with its map, those outside the skin as in [`crate::carry_points`] up to
/// `params.collar_mm`; from there the motion falls smoothly to nothing within 40 mm, so that the
/// surface does not tear. Points behind the chest wall and beyond the cut stay. Sides are split
/// until the straight ones follow the carried ones within 0.1 mm, down to 1 mm. The first points
/// are those of the given surface, in their order, unless two came to the same place.
///
/// # Errors
/// When a parameter is out of range, or the user stopped.
pub fn carry_surface(
    surface: &TriSurface,
    deformation: &Deformation,
    params: &Params,
    progress: Progress<'_>,
) -> Result<(TriSurface, Carried), Error> {
    carried(surface, &Field::new(deformation, params)?, progress)
}

/// Points (LPS, mm) in the operating position, moved as those of a surface ([`carry_surface`]),
/// such as the corners of open lines.
///
/// # Errors
/// When a parameter is out of range.
pub fn carry_vertices(
    points: &[Point],
    deformation: &Deformation,
    params: &Params,
) -> Result<Vec<Point>, Error> {
    let field = Field::new(deformation, params)?;
    Ok(points.par_iter().map(|p| p + field.at(p)).collect())
}

fn carried(
    surface: &TriSurface,
    field: &Field,
    progress: Progress<'_>,
) -> Result<(TriSurface, Carried), Error> {
    let mut pieces = Pieces {
        displacement: surface.points().par_iter().map(|p| field.at(p)).collect(),
        points: surface.points().to_vec(),
        triangles: surface.triangles().to_vec(),
    };
    let moved_points = pieces.displacement.iter().filter(|u| u.norm() > MOVED_MM).count();
    let mut settled = HashSet::new();
    for round in 0..ROUNDS {
        progress.at(round as f64 / ROUNDS as f64)?;
        if !pieces.split(field, &mut settled) {
            break;
        }
    }
    let added_points = pieces.points.len() - surface.points().len();
    let carried = pieces.points.iter().zip(&pieces.displacement).map(|(p, u)| p + u).collect();
    let carried = TriSurface::new(carried, pieces.triangles)?;
    let facts = Carried {
        volume_ml: [surface.volume() / 1000.0, carried.volume() / 1000.0],
        moved_points,
        added_points,
        max_displacement_mm: pieces.displacement.iter().map(|u| u.norm()).fold(0.0, f64::max),
    };
    Ok((carried, facts))
}

/// The displacement anywhere, and the box outside which there is none.
struct Field {
    embedding: Arc<Embedding>,
    motion: Motion,
    low: Point,
    high: Point,
}

impl Field {
    fn new(deformation: &Deformation, params: &Params) -> Result<Self, Error> {
        let faded = fade(deformation, params)?.deformation;
        let embedding = Arc::new(Embedding::new(faded.mesh().clone()));
        let reach_mm = params.collar_mm + DECAY_MM;
        let surround = Surround { rigid_mm: params.collar_mm, reach_mm };
        let motion = Motion::new(embedding.clone(), faded.displacement().clone(), surround)?;
        let (low, high) = faded.mesh().bounds();
        let margin = Vector::repeat(reach_mm);
        Ok(Self { embedding, motion, low: low - margin, high: high + margin })
    }

    fn at(&self, p: &Point) -> Vector {
        if !self.may_move(&[*p]) {
            return Vector::zeros();
        }
        self.motion.at(&self.embedding.place(p)).unwrap_or_else(Vector::zeros)
    }

    /// Whether the box of points meets the box in which something moves.
    fn may_move(&self, points: &[Point]) -> bool {
        (0..3).all(|a| {
            points.iter().any(|p| p[a] >= self.low[a])
                && points.iter().any(|p| p[a] <= self.high[a])
        })
    }

    /// Whether the carried edge leaves the straight one between its carried ends.
    fn bends(&self, ends: [Point; 2], carried: [Vector; 2]) -> bool {
        if !self.may_move(&ends) {
            return false;
        }
        let steps = ((ends[1] - ends[0]).norm() / STEP_MM).ceil().max(2.0) as usize;
        (1..steps).any(|n| {
            let t = n as f64 / steps as f64;
            let straight = carried[0] + (carried[1] - carried[0]) * t;
            (self.at(&(ends[0] + (ends[1] - ends[0]) * t)) - straight).norm() > TOLERANCE_MM
        })
    }
}

/// A surface under refinement.
struct Pieces {
    points: Vec<Point>,
    displacement: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
}

/// An edge, lower point first.
fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Pieces {
    /// Halves the edges that have to be; false when there are none. `settled` edges need not be
    /// looked at again.
    fn split(&mut self, field: &Field, settled: &mut HashSet<[u32; 2]>) -> bool {
        let mut edges: Vec<([u32; 2], bool)> = Vec::with_capacity(3 * self.triangles.len());
        for &[a, b, c] in &self.triangles {
            let near = field.may_move(&[a, b, c].map(|p| self.points[p as usize]));
            edges.extend([key(a, b), key(b, c), key(c, a)].map(|edge| (edge, near)));
        }
        edges.retain(|(edge, _)| !settled.contains(edge));
        edges.sort_unstable();
        // Of equal edges the last is the one with a triangle near by, if any is.
        let edges: Vec<_> = edges.chunk_by(|a, b| a.0 == b.0).map(|s| s[s.len() - 1]).collect();
        let halve = |&(edge, near): &([u32; 2], bool)| {
            let ends = edge.map(|p| self.points[p as usize]);
            let length = (ends[1] - ends[0]).norm();
            let carried = edge.map(|p| self.displacement[p as usize]);
            length > STEP_MM && (near && length > LONGEST_MM || field.bends(ends, carried))
        };
        let halved: Vec<bool> = edges.par_iter().map(halve).collect();
        let mut middles = HashMap::new();
        let mut added = Vec::new();
        for (&(edge, _), halved) in edges.iter().zip(halved) {
            if halved {
                middles.insert(edge, (self.points.len() + added.len()) as u32);
                let [p, q] = edge.map(|p| self.points[p as usize]);
                added.push(p + (q - p) * 0.5);
            } else {
                settled.insert(edge);
            }
        }
        self.displacement.par_extend(added.par_iter().map(|p| field.at(p)));
        self.points.extend(added);
        let whole = std::mem::take(&mut self.triangles);
        for triangle in whole {
            cut(triangle, &middles, &mut self.triangles);
        }
        !middles.is_empty()
    }
}

/// A triangle with some of its edges halved, as one to four of the same winding.
fn cut(triangle: [u32; 3], middles: &HashMap<[u32; 2], u32>, out: &mut Vec<[u32; 3]>) {
    let middle = |[a, b, c]: [u32; 3]| {
        [key(a, b), key(b, c), key(c, a)].map(|edge| middles.get(&edge).copied())
    };
    let [a, b, c] = triangle;
    // Turned so that the halved edges come first.
    for turned in [[a, b, c], [b, c, a], [c, a, b]] {
        let [a, b, c] = turned;
        match middle(turned) {
            [None, None, None] => return out.push(turned),
            [Some(ab), None, None] => return out.extend([[a, ab, c], [ab, b, c]]),
            [Some(ab), Some(bc), None] => {
                return out.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]);
            }
            [Some(ab), Some(bc), Some(ca)] => {
                return out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            _ => {}
        }
    }
}

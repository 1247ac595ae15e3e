//! Surfaces that may have parameters.

use rayon::prelude::*;
use std::sync::Arc;
use supine_mesh::{PointTree, representatives};
use supine_space::{Point, Vector};

/// What is known of a parameter before the scan is looked at: normally distributed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Its mean.
    pub mean: f64,
    /// Its standard deviation; infinite where nothing is known.
    pub deviation: f64,
    /// It is not followed beyond these two.
    pub range: [f64; 2],
    /// It changes by at most so much in one iteration.
    pub step: f64,
}

/// A surface of triangles whose points move with parameters.
pub trait Shape: Sync {
    /// Triangles, counter-clockwise seen from outside.
    fn triangles(&self) -> &[[u32; 3]];

    /// How much a scan's point counts whose nearest is each of the surface's points: 0 where the
    /// surface says nothing.
    fn weights(&self) -> &[f64];

    /// What is known of each parameter.
    fn priors(&self) -> &[Prior] {
        &[]
    }

    /// The points at values of the parameters, LPS, mm.
    fn points(&self, values: &[f64]) -> Vec<Point>;

    /// How the points move with each parameter, mm per unit of it.
    fn slopes(&self, _values: &[f64]) -> Vec<Vec<Vector>> {
        Vec::new()
    }
}

/// A surface without parameters.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// LPS, mm.
    pub points: Vec<Point>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// As of [`Shape::weights`].
    pub weights: Vec<f64>,
}

impl Shape for Rigid {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    fn weights(&self) -> &[f64] {
        &self.weights
    }

    fn points(&self, _: &[f64]) -> Vec<Point> {
        self.points.clone()
    }
}

/// A surface that is larger or smaller than it should be: its parameter is the scale about a place,
/// less 1.
#[derive(Debug)]
pub struct Scaled<'a> {
    surface: &'a Rigid,
    about: Point,
    priors: [Prior; 1],
}

impl<'a> Scaled<'a> {
    /// The surface scaled about a place (LPS, mm) by no more than a tenth.
    pub fn new(surface: &'a Rigid, about: Point) -> Self {
        let prior = Prior { mean: 0.0, deviation: f64::INFINITY, range: [-0.1, 0.1], step: 0.02 };
        Self { surface, about, priors: [prior] }
    }
}

impl Shape for Scaled<'_> {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.surface.triangles
    }

    fn weights(&self) -> &[f64] {
        &self.surface.weights
    }

    fn priors(&self) -> &[Prior] {
        &self.priors
    }

    fn points(&self, values: &[f64]) -> Vec<Point> {
        let at = |p: &Point| self.about + (p - self.about) * (1.0 + values[0]);
        self.surface.points.iter().map(at).collect()
    }

    fn slopes(&self, _: &[f64]) -> Vec<Vec<Vector>> {
        vec![self.surface.points.iter().map(|p| p - self.about).collect()]
    }
}

/// A shape at values of its parameters, prepared to be searched.
#[derive(Clone, Debug)]
pub struct Posed {
    pub(crate) points: Vec<Point>,
    pub(crate) normals: Arc<Vec<Vector>>,
    /// Those of the points that count.
    tree: Arc<PointTree>,
    counting: Arc<Vec<u32>>,
    /// How the points move with each parameter, mm per unit of it.
    pub(crate) slopes: Arc<Vec<Vec<Vector>>>,
}

impl Posed {
    /// The shape at these values.
    pub fn new(shape: &dyn Shape, values: &[f64]) -> Self {
        let points = shape.points(values);
        let normals = vertex_normals(&points, shape.triangles());
        let weights = shape.weights().iter().enumerate();
        let counting: Vec<u32> =
            weights.filter(|(_, w)| **w > 0.0).map(|(n, _)| n as u32).collect();
        let counted: Vec<Point> = counting.iter().map(|n| points[*n as usize]).collect();
        Self {
            normals: Arc::new(normals),
            tree: Arc::new(PointTree::new(&counted)),
            counting: Arc::new(counting),
            slopes: Arc::new(shape.slopes(values)),
            points,
        }
    }

    /// The same with fewer points that count, one for each cell of a grid of this spacing (mm): far
    /// from a surface the nearest of many points is slow to find.
    pub(crate) fn sparser(&self, spacing_mm: f64) -> Self {
        let counted: Vec<Point> = self.counting.iter().map(|n| self.points[*n as usize]).collect();
        let kept = representatives(&counted, spacing_mm);
        let tree = PointTree::new(&kept.iter().map(|n| counted[*n as usize]).collect::<Vec<_>>());
        let counting = kept.iter().map(|n| self.counting[*n as usize]).collect();
        Self { tree: Arc::new(tree), counting: Arc::new(counting), ..self.clone() }
    }

    /// The nearest of the points that count, no farther than `within_mm`.
    pub(crate) fn nearest(&self, place: &Point, within_mm: f64) -> Option<usize> {
        let (found, _) = self.tree.nearest(place, within_mm)?;
        Some(self.counting[found] as usize)
    }

    /// Moves the points along their slopes by changes of the parameters; which is nearest, and the
    /// normals, stay as they were.
    pub(crate) fn shift(&mut self, changes: &[f64]) {
        for (slopes, change) in self.slopes.iter().zip(changes) {
            self.points.iter_mut().zip(slopes).for_each(|(p, slope)| *p += slope * *change);
        }
    }

    /// Its points, LPS, mm.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Unit normals at them, outwards.
    pub fn normals(&self) -> &[Vector] {
        &self.normals
    }
}

/// Unit normals of the points of a surface: the sum of the triangles around each, weighted by area.
pub(crate) fn vertex_normals(points: &[Point], triangles: &[[u32; 3]]) -> Vec<Vector> {
    let twice: Vec<Vector> = triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = t.map(|p| points[p as usize]);
            (b - a).cross(&(c - a))
        })
        .collect();
    let mut normals = vec![Vector::zeros(); points.len()];
    for (triangle, twice) in triangles.iter().zip(twice) {
        triangle.iter().for_each(|&p| normals[p as usize] += twice);
    }
    normals.into_iter().map(|n| n.try_normalize(0.0).unwrap_or_else(Vector::zeros)).collect()
}

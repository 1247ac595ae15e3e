//! Points of a scan and the points of a surface that they belong to.

use crate::Posed;
use rayon::prelude::*;
use supine_mesh::Scan;
use supine_space::{Point, Pose, Vector};

/// The cosine between the normals of a scan's point and the surface below which they do not belong
/// together.
const SAME_SIDE: f64 = 0.6;

/// A point of a scan on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Match {
    /// Which of the scan's points.
    pub of: u32,
    /// The nearest of the surface's points.
    pub nearest: u32,
    /// Where the scan's point lies, LPS, mm.
    pub place: Point,
    /// Distance from the plane through the nearest point, positive outside, mm.
    pub residual_mm: f64,
    /// How much it counts before its residual is looked at.
    pub weight: f64,
}

/// All points of a scan that belong to a surface, in the scan's order.
#[derive(Clone, Debug)]
pub struct Matches(pub Vec<Match>);

impl Matches {
    /// The points of a scan in a pose that lie within a distance (mm) of a surface's points and
    /// face the same way.
    pub fn new(scan: &Scan, pose: &Pose, surface: &Posed, weights: &[f64], within_mm: f64) -> Self {
        let at = |n: usize| {
            let place = pose * scan.points()[n];
            let nearest = surface.nearest(&place, within_mm)?;
            let normal: &Vector = &surface.normals[nearest];
            let weight = weights[nearest];
            let faces = (pose.rotation * scan.normals()[n]).dot(normal);
            (weight > 0.0 && faces > SAME_SIDE).then(|| Match {
                of: n as u32,
                nearest: nearest as u32,
                place,
                residual_mm: normal.dot(&(place - surface.points[nearest])),
                weight,
            })
        };
        Self((0..scan.points().len()).into_par_iter().filter_map(at).collect())
    }
}

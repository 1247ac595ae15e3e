//! Surface scans of a body.

mod cells;
mod info;
mod islands;
mod normals;
mod orient;

pub use info::{NormalSource, ScanError, ScanInfo};

use crate::merge::merged;
pub use cells::representatives;
use supine_space::{Point, Pose, Vector};

/// A surface scan: points with unit normals that point out of the body, and triangles where it has
/// some. mm, in the frame of the scanner or of the patient; whoever holds it says which.
///
/// The surface may be open and have holes. No two points lie at the same place.
#[derive(Clone, Debug, PartialEq)]
pub struct Scan {
    points: Vec<Point>,
    normals: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
}

/// A scan of fewer points tells nothing of a body.
const FEWEST: usize = 500;
/// No body, nor a room, reaches farther, mm.
const FARTHEST_MM: f64 = 1e5;
/// With less than this share of the normals away from the middle the scan is inside out, with more
/// it is not; between the two the middle does not tell.
const INSIDE_OUT: [f64; 2] = [0.4, 0.6];

/// A scan is thinned to no more cells along an axis: they are to be counted.
const FINEST: f64 = (1 << 19) as f64;

impl Scan {
    /// A scan from points in mm, with a normal each where they are known, and triangles, none or
    /// counter-clockwise from outside.
    ///
    /// Points that are not finite are left out, points at the same place become one, and pieces of
    /// less than 1 % of the points that lie by themselves are left out. Normals need not be of unit
    /// length; one that is zero or not finite is made from those around. Without normals they come
    /// from the triangles, or else from the points near by. A scan that is inside out as a whole is
    /// turned. [`ScanInfo`] tells all that.
    ///
    /// # Errors
    /// When fewer than 500 points are left, they lie on a line or farther apart than any body, or a
    /// number makes no sense.
    pub fn new(
        points: Vec<Point>,
        normals: Option<Vec<Vector>>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<(Self, ScanInfo), ScanError> {
        check(&points, normals.as_deref(), &triangles)?;
        let mut info = ScanInfo::of(points.len());
        let mut scan = Self { points, normals: normals.unwrap_or_default(), triangles };
        scan.drop_not_finite(&mut info);
        scan.merge(&mut info);
        islands::drop(&mut scan, &mut info);
        if scan.points.len() < FEWEST {
            return Err(ScanError::TooFew { found: scan.points.len(), given: info.points });
        }
        let (low, high) = scan.bounds();
        if (high - low).amax() > FARTHEST_MM {
            return Err(ScanError::TooLarge { mm: (high - low).amax() });
        }
        normals::complete(&mut scan, &mut info)?;
        scan.turn(&mut info);
        Ok((scan, info))
    }

    /// Points, mm.
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    /// Unit normals out of the body, one for each point.
    pub fn normals(&self) -> &[Vector] {
        &self.normals
    }

    /// Triangles, as indices of three points, counter-clockwise seen from outside; none when the
    /// scan is of points only.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Lower and upper corner of the box around the points along the axes of their frame, mm.
    pub fn bounds(&self) -> (Point, Point) {
        let start = (self.points[0], self.points[0]);
        self.points.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)))
    }

    /// One point for each cell of a grid of this spacing, that nearest to the mean of the cell's
    /// points, with its normal; in the order of the scan, without triangles. A spacing that is not
    /// positive leaves all points.
    #[must_use]
    pub fn thinned(&self, spacing_mm: f64) -> Self {
        if spacing_mm.is_nan() || spacing_mm <= 0.0 {
            return Self { triangles: vec![], ..self.clone() };
        }
        let (low, high) = self.bounds();
        let kept = representatives(&self.points, spacing_mm.max((high - low).amax() / FINEST));
        Self {
            points: kept.iter().map(|&n| self.points[n as usize]).collect(),
            normals: kept.iter().map(|&n| self.normals[n as usize]).collect(),
            triangles: vec![],
        }
    }

    /// The scan without points, by their index, and without their triangles; `None` when nothing is
    /// left.
    pub fn without(&self, left_out: impl Fn(usize) -> bool) -> Option<Self> {
        let kept: Vec<bool> = (0..self.points.len()).map(|n| !left_out(n)).collect();
        let mut scan = self.clone();
        scan.retain(&kept);
        (!scan.points.is_empty()).then_some(scan)
    }

    /// The scan moved as a rigid body.
    #[must_use]
    pub fn moved(&self, pose: &Pose) -> Self {
        Self {
            points: self.points.iter().map(|p| pose * p).collect(),
            normals: self.normals.iter().map(|n| pose * n).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Keeps some points, and the triangles all corners of which are kept.
    fn retain(&mut self, kept: &[bool]) {
        let mut left = 0;
        let place = |&kept: &bool| {
            left += u32::from(kept);
            left.saturating_sub(1)
        };
        let place: Vec<u32> = kept.iter().map(place).collect();
        let mut keep = kept.iter().copied();
        self.points.retain(|_| keep.next().unwrap_or(true));
        let mut keep = kept.iter().copied();
        self.normals.retain(|_| keep.next().unwrap_or(true));
        self.triangles.retain(|t| t.iter().all(|&p| kept[p as usize]));
        self.triangles.iter_mut().for_each(|t| *t = t.map(|p| place[p as usize]));
    }

    /// Scanners write holes as points that are no numbers.
    fn drop_not_finite(&mut self, info: &mut ScanInfo) {
        let finite: Vec<bool> =
            self.points.iter().map(|p| p.iter().all(|c| c.is_finite())).collect();
        info.not_finite = finite.iter().filter(|finite| !**finite).count();
        if info.not_finite > 0 {
            self.retain(&finite);
            let text = format!("{} points of the scan have no position: left out", info.not_finite);
            info.warn("scan-not-finite", text, ("points", info.not_finite as f64));
        }
    }

    /// Makes points at the same place one; its normal is the mean of theirs.
    fn merge(&mut self, info: &mut ScanInfo) {
        let (points, place) = merged(&self.points);
        info.duplicates = self.points.len() - points.len();
        if info.duplicates > 0 {
            let given = std::mem::take(&mut self.normals);
            if !given.is_empty() {
                self.normals = vec![Vector::zeros(); points.len()];
            }
            for (normal, &at) in given.iter().zip(&place) {
                self.normals[at as usize] += normals::unit(normal).unwrap_or_default();
            }
            self.points = points;
            self.triangles.iter_mut().for_each(|t| *t = t.map(|p| place[p as usize]));
        }
        self.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    }

    /// Turns a scan that is inside out, and its triangles to the side of the normals.
    fn turn(&mut self, info: &mut ScanInfo) {
        let middle = centroid(&self.points);
        let away = |(p, n): (&Point, &Vector)| n.dot(&(p - middle)) > 0.0;
        let count = self.points.iter().zip(&self.normals).filter(|&both| away(both)).count();
        info.outwards = count as f64 / self.points.len() as f64;
        info.turned = info.outwards < INSIDE_OUT[0];
        if info.turned {
            self.normals.iter_mut().for_each(|n| *n = -*n);
            let text = "the normals of the scan point into the body: they are turned";
            info.warn("scan-turned", text, ("outwards", info.outwards));
        } else if info.outwards < INSIDE_OUT[1] {
            let text = "which side of the scan is outside is not sure: its normals point both towards its middle \
                        and away from it";
            info.warn("scan-sides-unsure", text, ("outwards", info.outwards));
        }
        let along = |t: &&[u32; 3]| {
            let sum: Vector = t.iter().map(|&p| self.normals[p as usize]).sum();
            normals::across(&self.points, t).dot(&sum) > 0.0
        };
        if 2 * self.triangles.iter().filter(along).count() < self.triangles.len() {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
    }
}

/// Whether the parts fit each other.
fn check(
    points: &[Point],
    normals: Option<&[Vector]>,
    triangles: &[[u32; 3]],
) -> Result<(), ScanError> {
    if u32::try_from(points.len()).is_err() {
        return Err(ScanError::TooMany(points.len()));
    }
    if let Some(normals) = normals.filter(|n| n.len() != points.len()) {
        return Err(ScanError::Normals { normals: normals.len(), points: points.len() });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&point) = corners.iter().find(|&&p| p as usize >= points.len()) {
            return Err(ScanError::Index { triangle, point, points: points.len() });
        }
    }
    Ok(())
}

/// The mean of points.
fn centroid(points: &[Point]) -> Point {
    let sum: Vector = points.iter().map(|p| p.coords).sum();
    (sum / points.len().max(1) as f64).into()
}

#[cfg(test)]
mod tests;

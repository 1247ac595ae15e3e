//! The field that the scanner reconstructed: beyond it nothing was measured.

use crate::frame::Frame;
use crate::plane::near;
use rayon::prelude::*;
use supine_space::{Grid, Point};
use supine_volume::Ct;

/// Values below are padding, not air (-2048 on chest-lidc0001; reference, section 9).
const PADDING_HU: i16 = -1100;
/// Padding that was replaced by air lies below this, HU.
const FILL_HU: i16 = -900;
/// Scanners fill a circle about the middle of the image, whatever its radius; its rim, this wide, holds what was measured
/// on at least this share. Measured: three of four real CTs end 0.5 pixels beyond 480 pixels of 512, with 1.00 of their rim.
const RIM_MM: f32 = 4.0;
const RIM_SHARE: f64 = 0.9;
/// A face of a mesh this near to the end of the field belongs to it, pixels: labels end on whole pixels, which a mesh smooths.
const NEAR_PIXELS: f32 = 1.6;

/// The pixels that were reconstructed, the same in all slices.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    frame: Frame,
    seen: Vec<bool>,
}

impl Field {
    /// The field of a CT with axial slices: all that is not padding, or the circle beyond which each slice has one value.
    ///
    /// # Errors
    /// [`crate::Error::NotAxial`] or [`crate::Error::TooSmall`].
    pub fn of(ct: &Ct) -> Result<Self, crate::Error> {
        Ok(Self::within(ct, &Frame::new(ct.grid())?))
    }

    pub(crate) fn within(ct: &Ct, frame: &Frame) -> Self {
        let hu = ct.data();
        let seen = if hu.par_iter().any(|&v| v < PADDING_HU) {
            measured(hu, frame.plane(), |v| v >= PADDING_HU)
        } else {
            let fill = hu[0];
            let live = measured(hu, frame.plane(), |v| v != fill);
            circle(&live, frame).filter(|_| fill < FILL_HU).unwrap_or(vec![true; frame.plane()])
        };
        Self { frame: frame.clone(), seen }
    }

    pub(crate) fn into_seen(self) -> Vec<bool> {
        self.seen
    }

    /// Whether the scanner reconstructed these pixels of a slice.
    pub(crate) fn seen(&self) -> &[bool] {
        &self.seen
    }

    /// The end of the field, for many points.
    pub fn end(&self) -> FieldEnd {
        let Frame { size: [ni, nj, _], spacing, .. } = self.frame;
        let beyond = |n: usize| {
            let (i, j) = (n % ni, n / ni);
            !self.seen[n] || i == 0 || j == 0 || i + 1 == ni || j + 1 == nj
        };
        let beyond: Vec<bool> = (0..ni * nj).map(beyond).collect();
        let reach = NEAR_PIXELS * self.frame.pixel();
        FieldEnd { near: near(&beyond, ni, [spacing[0], spacing[1]], reach), size: [ni, nj] }
    }
}

/// Where the field of a CT ends.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldEnd {
    near: Vec<bool>,
    size: [usize; 2],
}

impl FieldEnd {
    /// Lengths of the runs of pixels that are, in turn, away from the end and near to it, from the first pixel on; to be kept.
    pub fn runs(&self) -> Vec<u32> {
        let first = self.near.first().is_some_and(|&near| near).then_some(0);
        let runs = self.near.chunk_by(|a, b| a == b).map(|run| run.len() as u32);
        first.into_iter().chain(runs).collect()
    }

    /// What [`Self::runs`] gave of a CT of that size within the slices; `None` when it is of another.
    pub fn of_runs(runs: &[u32], size: [usize; 2]) -> Option<Self> {
        let runs = runs.iter().enumerate();
        let near: Vec<bool> =
            runs.flat_map(|(n, &run)| std::iter::repeat_n(n % 2 == 1, run as usize)).collect();
        (near.len() == size[0] * size[1]).then_some(Self { near, size })
    }

    /// Whether a point (LPS, mm) lies at the end of the field or beyond it, within 1.6 pixels; `grid` is that of the CT.
    pub fn is_near(&self, grid: &Grid, point: &Point) -> bool {
        let at = grid.index_from_patient(point);
        let [i, j] = [0, 1].map(|a| at[a].round());
        let [ni, nj] = self.size;
        let outside = i < 0.0 || j < 0.0 || i >= ni as f64 || j >= nj as f64;
        outside || self.near[j as usize * ni + i as usize]
    }
}

/// The pixels where any slice holds a value that was measured.
fn measured(hu: &[i16], plane: usize, is_measured: impl Fn(i16) -> bool + Sync) -> Vec<bool> {
    let any = |n: usize| (n..hu.len()).step_by(plane).any(|m| is_measured(hu[m]));
    (0..plane).into_par_iter().map(any).collect()
}

/// The smallest circle about the middle that holds all live pixels, when its rim is full of them.
fn circle(live: &[bool], frame: &Frame) -> Option<Vec<bool>> {
    let [ni, nj, _] = frame.size;
    let [si, sj, _] = frame.spacing;
    let away = |n: usize| {
        let [x, y] = frame.position(n);
        (x - 0.5 * (ni - 1) as f32 * si).hypot(y - 0.5 * (nj - 1) as f32 * sj)
    };
    let radius = (0..live.len()).filter(|&n| live[n]).map(away).fold(0.0, f32::max);
    let inside: Vec<bool> = (0..live.len()).map(|n| away(n) <= radius).collect();
    let rim = || (0..live.len()).filter(|&n| inside[n] && away(n) > radius - RIM_MM);
    let full = rim().filter(|&n| live[n]).count() as f64 >= RIM_SHARE * rim().count() as f64;
    (full && inside.contains(&false)).then_some(inside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Vector};
    use supine_volume::Volume;

    /// Air with noise within a circle about the middle, and one value beyond.
    fn scanned(radius_mm: f32, fill: i16, still: bool) -> Ct {
        let size = [120, 120, 40];
        let grid = Grid::new(size, Vector::repeat(3.0), Point::origin(), Matrix::identity());
        let value = |[i, j, k]: [usize; 3]| {
            let off = [i, j].map(|c| 3.0 * (c as f32 - 59.5));
            let body = off[0].hypot(1.3 * off[1]) < 60.0;
            if off[0].hypot(off[1]) > radius_mm {
                fill
            } else if body {
                40
            } else if still {
                fill
            } else {
                -1000 + ((7 * i + 13 * j + 29 * k) % 31) as i16
            }
        };
        Volume::from_fn(grid.unwrap(), value)
    }

    #[test]
    fn a_circle_of_any_radius_is_found_with_and_without_padding() {
        for (radius, fill) in [(178.5, -1024), (188.0, -1024), (150.0, -1024), (188.0, -3024)] {
            let field = Field::of(&scanned(radius, fill, false)).unwrap();
            for (n, &seen) in field.seen().iter().enumerate() {
                let off = [n % 120, n / 120].map(|c| 3.0 * (c as f32 - 59.5));
                assert_eq!(seen, off[0].hypot(off[1]) <= radius, "{radius} {fill} {off:?}");
            }
        }
    }

    #[test]
    fn still_air_around_a_patient_is_no_end_of_the_field() {
        assert!(Field::of(&scanned(178.5, -1000, true)).unwrap().seen().iter().all(|&s| s));
    }

    #[test]
    fn points_at_the_end_are_told() {
        let ct = scanned(150.0, -1024, false);
        let end = Field::of(&ct).unwrap().end();
        let at = |r: f64| Point::new(178.5 + r, 178.5, 60.0);
        let points = [at(0.0), at(140.0), at(149.0), at(151.0), at(170.0), at(400.0)];
        let want = [false, false, true, true, true, true];
        assert_eq!(points.map(|p| end.is_near(ct.grid(), &p)), want);
        assert_eq!(FieldEnd::of_runs(&end.runs(), [120, 120]), Some(end.clone()));
        assert_eq!(FieldEnd::of_runs(&end.runs(), [120, 119]), None);
    }
}

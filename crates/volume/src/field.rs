//! The field that the scanner reconstructed: beyond it nothing was measured.

use crate::{Ct, Volume, distance_mm};
use rayon::prelude::*;
use supine_space::{Grid, Matrix, Point, Vector};

/// Values below are padding, not air (-2048 on chest-lidc0001; docs/SEGMENTATION.md, Traps).
const PADDING_HU: i16 = -1100;
/// Padding that was replaced by air lies below this, HU.
const FILL_HU: i16 = -900;
/// What air may be.
const AIR_HU: std::ops::Range<i16> = PADDING_HU..FILL_HU;
/// Scanners fill a circle about the middle of the image, whatever its radius; its rim, this wide,
/// holds what was measured on at least this share. Measured: three of four real CTs end 0.5 pixels
/// beyond 480 pixels of 512, with 1.00 of their rim.
const RIM_MM: f64 = 4.0;
const RIM_SHARE: f64 = 0.9;

/// The pixels of a slice that were measured: where any slice of a CT holds a measurement, the same
/// for all slices.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Pixels along i and j, and their distances, mm.
    size: [usize; 2],
    spacing: [f64; 2],
    seen: Vec<bool>,
}

impl Field {
    /// The field of a CT on `grid` of which runs of voxels, as they lie in memory, hold `hu` in
    /// place of a measurement; `None` when every pixel was measured in some slice. Values that air
    /// may have count as measured: where a file calls them padding, air that was clipped to them
    /// bears the same mark.
    pub fn of_padding(
        grid: &Grid,
        runs: impl IntoIterator<Item = (std::ops::Range<usize>, i16)>,
    ) -> Option<Self> {
        let [ni, nj, slices] = grid.size();
        let mut missing = vec![0; ni * nj];
        for (run, _) in runs.into_iter().filter(|(_, hu)| !AIR_HU.contains(hu)) {
            run.for_each(|n| missing[n % (ni * nj)] += 1);
        }
        let seen: Vec<bool> = missing.into_iter().map(|missing| missing < slices).collect();
        seen.contains(&false).then(|| Self::new(grid, seen))
    }

    /// The field of a CT that does not say what was measured: all that is not padding (below -1100
    /// HU), or the circle beyond which each slice has one value; all of it when there is neither.
    pub fn found(ct: &Ct) -> Self {
        let (hu, grid) = (ct.data(), ct.grid());
        let plane = grid.size()[0] * grid.size()[1];
        let seen = if hu.par_iter().any(|&v| v < PADDING_HU) {
            measured(hu, plane, |v| v >= PADDING_HU)
        } else {
            let fill = hu[0];
            let live = measured(hu, plane, |v| v != fill);
            circle(&live, grid).filter(|_| fill < FILL_HU).unwrap_or(vec![true; plane])
        };
        Self::new(grid, seen)
    }

    fn new(grid: &Grid, seen: Vec<bool>) -> Self {
        let ([ni, nj, _], spacing) = (grid.size(), grid.spacing());
        Self { size: [ni, nj], spacing: [spacing[0], spacing[1]], seen }
    }

    /// What [`Self::runs`] told of the field of a CT of `size` pixels within the slices, `spacing`
    /// mm apart; `None` when it is of another.
    pub fn of_runs(size: [usize; 2], spacing: [f64; 2], runs: &[usize]) -> Option<Self> {
        let whole = runs.iter().try_fold(0usize, |sum, &run| sum.checked_add(run));
        let own = size[0].checked_mul(size[1]).is_some_and(|plane| whole == Some(plane));
        let runs = runs.iter().enumerate();
        let seen = || runs.flat_map(|(n, &run)| std::iter::repeat_n(n % 2 == 0, run)).collect();
        (own && spacing.iter().all(|&s| s > 0.0)).then(|| Self { size, spacing, seen: seen() })
    }

    /// Lengths of the runs of pixels that were, in turn, measured and not measured, from the first
    /// pixel on; to be kept.
    pub fn runs(&self) -> Vec<usize> {
        let first = self.seen.first().is_some_and(|&seen| !seen).then_some(0);
        first.into_iter().chain(self.seen.chunk_by(|a, b| a == b).map(<[bool]>::len)).collect()
    }

    /// Pixels along i and j.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Distances of the pixels along i and j, mm.
    pub fn spacing(&self) -> [f64; 2] {
        self.spacing
    }

    /// Mean distance of the pixels, mm.
    pub fn pixel_mm(&self) -> f64 {
        (self.spacing[0] * self.spacing[1]).sqrt()
    }

    /// Whether each pixel of a slice was measured; i fastest.
    pub fn seen(&self) -> &[bool] {
        &self.seen
    }

    /// The pixel at a point (LPS, mm) of a CT on `grid`; `None` beside the image.
    pub fn pixel(&self, grid: &Grid, point: &Point) -> Option<usize> {
        let (at, [ni, nj]) = (grid.index_from_patient(point), self.size);
        let [i, j] = [at[0].round(), at[1].round()];
        let within = i >= 0.0 && j >= 0.0 && i < ni as f64 && j < nj as f64;
        within.then(|| j as usize * ni + i as usize)
    }

    /// Whether each pixel of a slice lies within `mm` of one that was not measured, centre to
    /// centre, those beyond the border of the image among them; 0 and all beyond the field.
    pub fn near_end(&self, mm: f64) -> Vec<bool> {
        let [ni, nj] = self.size;
        // One pixel more on each side, which was not measured.
        let (wide, [si, sj]) = (ni + 2, self.spacing);
        let spacing = Vector::new(si, sj, 1.0);
        let grid = Grid::new([wide, nj + 2, 1], spacing, Point::origin(), Matrix::identity());
        let Ok(grid) = grid else { return vec![false; self.seen.len()] };
        let inner = |at: usize, n: usize| at.checked_sub(1).filter(|&at| at < n);
        let beyond = |[i, j, _]: [usize; 3]| match (inner(i, ni), inner(j, nj)) {
            (Some(i), Some(j)) => !self.seen[j * ni + i],
            _ => true,
        };
        let away = distance_mm(&Volume::from_fn(grid, beyond));
        let near = |n: usize| f64::from(away.at([n % ni + 1, n / ni + 1, 0])) <= mm;
        (0..ni * nj).map(near).collect()
    }
}

/// The pixels where any slice holds a value that was measured.
fn measured(hu: &[i16], plane: usize, is_measured: impl Fn(i16) -> bool + Sync) -> Vec<bool> {
    let any = |n: usize| (n..hu.len()).step_by(plane).any(|m| is_measured(hu[m]));
    (0..plane).into_par_iter().map(any).collect()
}

/// The smallest circle about the middle that holds all live pixels, when its rim is full of them.
fn circle(live: &[bool], grid: &Grid) -> Option<Vec<bool>> {
    let ([ni, nj, _], spacing) = (grid.size(), grid.spacing());
    let away = |n: usize| {
        let from_middle =
            |at: usize, a: usize, size: usize| (at as f64 - 0.5 * (size - 1) as f64) * spacing[a];
        from_middle(n % ni, 0, ni).hypot(from_middle(n / ni, 1, nj))
    };
    let radius = (0..live.len()).filter(|&n| live[n]).map(away).fold(0.0, f64::max);
    let inside: Vec<bool> = (0..live.len()).map(|n| away(n) <= radius).collect();
    let rim = || (0..live.len()).filter(|&n| inside[n] && away(n) > radius - RIM_MM);
    let full = rim().filter(|&n| live[n]).count() as f64 >= RIM_SHARE * rim().count() as f64;
    (full && inside.contains(&false)).then_some(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Air with noise within a circle about the middle, and one value beyond.
    fn scanned(radius_mm: f64, fill: i16, still: bool) -> Ct {
        let size = [120, 120, 40];
        let grid = Grid::new(size, Vector::repeat(3.0), Point::origin(), Matrix::identity());
        let value = |[i, j, k]: [usize; 3]| {
            let off = [i, j].map(|c| 3.0 * (c as f64 - 59.5));
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

    fn assert_circle(field: &Field, radius: f64) {
        for (n, &seen) in field.seen().iter().enumerate() {
            let off = [n % 120, n / 120].map(|c| 3.0 * (c as f64 - 59.5));
            assert_eq!(seen, off[0].hypot(off[1]) <= radius, "{radius} {off:?}");
        }
    }

    #[test]
    fn a_circle_of_any_radius_is_found_with_and_without_padding() {
        for (radius, fill) in [(178.5, -1024), (188.0, -1024), (150.0, -1024), (188.0, -3024)] {
            assert_circle(&Field::found(&scanned(radius, fill, false)), radius);
        }
    }

    #[test]
    fn still_air_around_a_patient_is_no_end_of_the_field() {
        assert!(Field::found(&scanned(178.5, -1000, true)).seen().iter().all(|&s| s));
    }

    #[test]
    fn padding_that_a_file_tells_is_the_field_whatever_the_voxels_hold_now() {
        let ct = scanned(150.0, -1000, true);
        let plane = 120 * 120;
        let off = |n: usize| [n % 120, n % plane / 120].map(|c| 3.0 * (c as f64 - 59.5));
        let beyond = |n: &usize| off(*n)[0].hypot(off(*n)[1]) > 150.0;
        let told = |hu: i16, from: usize| {
            let voxels = (from..ct.data().len()).filter(beyond).map(|n| (n..n + 1, hu));
            Field::of_padding(ct.grid(), voxels)
        };
        assert_circle(&told(-2048, 0).unwrap(), 150.0);
        // Measured in one slice, measured; and what air may be is no padding.
        assert_eq!(told(-2048, plane), None);
        assert_eq!(told(-1024, 0), None);
        assert_circle(&told(3071, 0).unwrap(), 150.0);
    }

    #[test]
    fn pixels_at_the_end_are_told() {
        let ct = scanned(150.0, -1024, false);
        let field = Field::found(&ct);
        let near = |mm: f64, r: f64| {
            let pixel = field.pixel(ct.grid(), &Point::new(178.5 + r, 178.5, 60.0));
            pixel.map(|n| field.near_end(mm)[n])
        };
        let of = |mm: f64| [0.0, 130.0, 140.0, 149.0, 151.0, 170.0, 400.0].map(|r| near(mm, r));
        let [yes, no] = [Some(true), Some(false)];
        assert_eq!(of(1.6 * field.pixel_mm()), [no, no, no, yes, yes, yes, None]);
        assert_eq!(of(20.0), [no, no, yes, yes, yes, yes, None]);
        // Without a circle the image's border is the end: its last pixels are one away from it.
        let whole = Field::of_runs([4, 3], [1.0, 1.0], &[12]).unwrap();
        let inner = [5, 6];
        let want: Vec<bool> = (0..12).map(|n| !inner.contains(&n)).collect();
        assert_eq!(whole.near_end(1.0), want);
        assert_eq!(whole.near_end(0.0), [false; 12]);
    }

    #[test]
    fn runs_are_the_field() {
        let field = Field::found(&scanned(150.0, -1024, false));
        let of = |size| Field::of_runs(size, field.spacing(), &field.runs());
        assert_eq!(of([120, 120]), Some(field.clone()));
        assert_eq!(of([120, 119]), None);
    }
}

//! How much of a structure receives how much dose.

use rayon::prelude::*;
use supine_space::{Grid, Point, Vector};
use supine_volume::{ContourError, Rule, Volume, fill_contours, held_by, sample_trilinear_at};

/// Structures are sampled this finely, mm, ...
const STEP_MM: f64 = 1.0;
/// ... and coarser where that would be more samples than these.
const SAMPLES: f64 = 4e6;
/// Beyond their outermost planes contours hold for half a step, which is at most this, mm.
const BEYOND_MM: f64 = 6.0;

/// The dose within a structure.
#[derive(Clone, Debug, PartialEq)]
pub struct DoseVolume {
    /// Share of the structure beyond the grid of the dose, taken as 0 Gy, 0..=1.
    pub beyond: f64,
    /// The doses of its samples, all alike in volume, ascending, Gy.
    pub doses_gy: Vec<f32>,
}

impl DoseVolume {
    /// The dose within closed contours parallel to the slices of `slices` (LPS, mm), trilinear at
    /// samples 1 mm apart, more in structures of over 4 litres.
    ///
    /// # Errors
    /// When the contours enclose nothing, or are not what [`fill_contours`] takes.
    pub fn of(
        dose: &Volume<f32>,
        contours: &[Vec<Point>],
        rule: Rule,
        slices: &Grid,
    ) -> Result<Self, ContourError> {
        held_by(slices, contours)?;
        let grid = around(contours, slices)?;
        let (mask, _) = fill_contours(&grid, contours, rule)?;
        let inside: Vec<usize> = (0..grid.len()).filter(|&n| mask.data()[n]).collect();
        if inside.is_empty() {
            return Err(ContourError::Empty);
        }
        let at = |&n: &usize| {
            let place = grid.centre(grid.voxel(n));
            dose.grid().voxel_at(&place).map(|_| sample_trilinear_at(dose, &place))
        };
        let samples: Vec<Option<f32>> = inside.par_iter().map(at).collect();
        let beyond = samples.iter().filter(|d| d.is_none()).count() as f64 / samples.len() as f64;
        let mut doses_gy: Vec<f32> = samples.into_iter().map(|d| d.unwrap_or(0.0)).collect();
        doses_gy.par_sort_unstable_by(f32::total_cmp);
        Ok(Self { beyond, doses_gy })
    }

    /// Mean, Gy.
    pub fn mean_gy(&self) -> f64 {
        self.doses_gy.iter().map(|&d| f64::from(d)).sum::<f64>() / self.doses_gy.len() as f64
    }

    /// Largest, Gy.
    pub fn max_gy(&self) -> f64 {
        self.doses_gy.last().copied().unwrap_or(0.0).into()
    }

    /// Least dose to the share of the volume that receives most, Gy: D98 % at 0.98 (ICRU Report
    /// 83).
    pub fn at_volume(&self, share: f64) -> f64 {
        let last = self.doses_gy.len() - 1;
        let rank = ((1.0 - share) * self.doses_gy.len() as f64).floor() as usize;
        self.doses_gy[rank.min(last)].into()
    }

    /// Share of the volume that receives at least a dose, 0..=1.
    pub fn at_dose(&self, gy: f64) -> f64 {
        let below = self.doses_gy.partition_point(|&d| f64::from(d) < gy);
        1.0 - below as f64 / self.doses_gy.len() as f64
    }
}

/// A grid along the axes of `slices` that holds the contours.
fn around(contours: &[Vec<Point>], slices: &Grid) -> Result<Grid, ContourError> {
    let axes = slices.direction();
    let places = contours.iter().flatten().map(|p| axes.transpose() * p.coords);
    let first = places.clone().next().ok_or(ContourError::Empty)?;
    let (low, high) = places.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    let beyond = Vector::new(STEP_MM, STEP_MM, BEYOND_MM);
    let (low, extent) = (low - beyond, high - low + 2.0 * beyond);
    let step = (extent.product() / SAMPLES).cbrt().max(STEP_MM);
    let size = [0, 1, 2].map(|a| (extent[a] / step) as usize + 2);
    let origin = Point::from(axes * low);
    Grid::new(size, Vector::repeat(step), origin, *axes).map_err(|_| ContourError::Empty)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::Matrix;

    /// A dose that grows along x: 0.5 Gy/mm from -20 mm on.
    fn wedge() -> Volume<f32> {
        let grid = Grid::new(
            [17, 17, 17],
            Vector::repeat(2.5),
            Point::new(-20.0, -20.0, -20.0),
            Matrix::identity(),
        );
        let grid = grid.unwrap();
        Volume::from_fn(grid.clone(), |v| 0.5 * (grid.centre(v).x as f32 + 20.0))
    }

    fn block(centre: [f64; 3], half: f64) -> Vec<Vec<Point>> {
        let [x, y, z] = centre;
        let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
        let plane = |k: i32| {
            corners.map(|[a, b]| Point::new(x + a, y + b, z + 3.0 * f64::from(k))).to_vec()
        };
        (-3..=3).map(plane).collect()
    }

    #[test]
    fn a_block_in_a_wedge_has_the_doses_of_its_places() {
        let dose = wedge();
        let of = DoseVolume::of(&dose, &block([0.0; 3], 10.0), Rule::Joined, dose.grid()).unwrap();
        let close = |a: f64, b: f64, within: f64| assert!((a - b).abs() < within, "{a} {b}");
        // Samples 1 mm apart.
        close(of.doses_gy.len() as f64 / 1000.0, 20.0 * 20.0 * 21.0 / 1000.0, 0.7);
        close(of.mean_gy(), 10.0, 0.3);
        close(of.at_volume(0.5), 10.0, 0.6);
        close(of.at_volume(0.98), 5.2, 0.6);
        close(of.at_volume(0.02), 14.8, 0.6);
        close(of.at_dose(12.5), 0.25, 0.06);
        assert!(of.at_dose(0.0) == 1.0 && of.at_dose(16.0) == 0.0 && of.beyond == 0.0);
        close(of.max_gy(), 14.75, 0.3);
    }

    #[test]
    fn what_the_dose_does_not_cover_counts_as_none_and_is_told() {
        let dose = wedge();
        let of = DoseVolume::of(&dose, &block([21.0, 0.0, 0.0], 10.0), Rule::Joined, dose.grid())
            .unwrap();
        assert!((of.beyond - 0.5).abs() < 0.08, "{}", of.beyond);
        assert!((of.at_dose(0.1) - 1.0 + of.beyond).abs() < 1e-9);
        assert!(DoseVolume::of(&dose, &[], Rule::Joined, dose.grid()).is_err());
    }
}

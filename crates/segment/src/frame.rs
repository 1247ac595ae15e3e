//! The slices of a CT and their directions in the patient.

use crate::Error;
use supine_space::Grid;

/// Largest angle between the k axis and the head-foot direction, degrees. Chosen, not measured; 12
/// degrees are tried on the phantom.
const MAX_TILT_DEG: f64 = 20.0;

/// Sizes and directions within the slices.
///
/// Positions in a slice are (i * spacing, j * spacing), mm, in f32: the slices are below 1 m.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Frame {
    /// Voxels along i, j, k.
    pub(crate) size: [usize; 3],
    /// Distance of voxel centres along i, j, k, mm.
    pub(crate) spacing: [f32; 3],
    /// Unit vector to the patient's left within the slice.
    pub(crate) left: [f32; 2],
    /// Unit vector to the patient's back within the slice.
    pub(crate) back: [f32; 2],
    /// Whether k runs towards the head.
    pub(crate) towards_head: bool,
}

impl Frame {
    /// The frame of a grid whose slices are roughly axial.
    pub(crate) fn new(grid: &Grid) -> Result<Self, Error> {
        let size = grid.size();
        let extent_mm = [0, 1, 2].map(|a| size[a] as f64 * grid.spacing()[a]);
        let d = grid.direction();
        let degrees = d[(2, 2)].abs().min(1.0).acos().to_degrees();
        if degrees > MAX_TILT_DEG {
            return Err(Error::NotAxial { degrees });
        }
        let (short, long) = (extent_mm[0].min(extent_mm[1]), extent_mm[0].max(extent_mm[1]));
        if short < 100.0 || long < 150.0 || extent_mm[2] < 60.0 {
            return Err(Error::TooSmall { size, extent_mm });
        }
        let norm = d[(1, 0)].hypot(d[(1, 1)]);
        let back = [d[(1, 0)] / norm, d[(1, 1)] / norm];
        // Perpendicular to the back in the slice, on the patient's left.
        let sign = (back[1] * d[(0, 0)] - back[0] * d[(0, 1)]).signum();
        let left = [sign * back[1], -sign * back[0]];
        Ok(Self {
            size,
            spacing: [0, 1, 2].map(|a| grid.spacing()[a] as f32),
            left: left.map(|c| c as f32),
            back: back.map(|c| c as f32),
            towards_head: d[(2, 2)] > 0.0,
        })
    }

    /// Pixels of a slice.
    pub(crate) fn plane(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Mean pixel size within the slice, mm.
    pub(crate) fn pixel(&self) -> f32 {
        (self.spacing[0] * self.spacing[1]).sqrt()
    }

    /// Volume of a voxel, cm³.
    pub(crate) fn voxel_cm3(&self) -> f64 {
        self.spacing.iter().map(|&s| f64::from(s)).product::<f64>() / 1000.0
    }

    /// Position of a pixel in its slice, mm.
    #[inline]
    pub(crate) fn position(&self, n: usize) -> [f32; 2] {
        // Numbers of 32 bits, of which a slice has fewer pixels, are divided several times faster.
        let (n, ni) = (n as u32, self.size[0] as u32);
        [(n % ni) as f32 * self.spacing[0], (n / ni) as f32 * self.spacing[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    fn grid(direction: Matrix) -> Grid {
        Grid::new([100, 100, 40], Vector::new(4.0, 4.0, 5.0), Point::origin(), direction).unwrap()
    }

    #[test]
    fn directions_follow_the_grid() {
        let f = Frame::new(&grid(Matrix::identity())).unwrap();
        assert_eq!((f.left, f.back), ([1.0, 0.0], [0.0, 1.0]));
        // i towards the back, j towards the right, k towards the feet.
        let d = Matrix::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        let f = Frame::new(&grid(d)).unwrap();
        assert_eq!((f.left, f.back), ([0.0, -1.0], [1.0, 0.0]));
    }

    #[test]
    fn sagittal_slices_are_refused() {
        let d = Matrix::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let error = Frame::new(&grid(d)).unwrap_err();
        assert!(matches!(error, Error::NotAxial { degrees } if degrees > 89.0), "{error}");
    }
}

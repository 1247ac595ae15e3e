//! The surfaces between the tissues.

use crate::{LabelMap, SignedDistance, label};

/// Skin and chest wall of a label map, known between its voxels, on its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Surfaces {
    /// Negative inside the patient: where the label is not [`crate::label::OUTSIDE`].
    pub skin: SignedDistance,
    /// Negative inside the chest wall: where [`crate::label::is_chest_wall`] holds.
    pub chest_wall: SignedDistance,
}

impl Surfaces {
    /// The surfaces of labels of which no more is known: half way between the voxels' centres.
    pub fn half_way(labels: &LabelMap) -> Self {
        let of = |holds: fn(u8) -> bool| {
            let inside = |n: usize| holds(labels.data()[n]);
            SignedDistance::new(labels.grid(), SignedDistance::WIDEST_MM, inside, |_, _| 0.5)
        };
        Self { skin: of(|l| l != label::OUTSIDE), chest_wall: of(label::is_chest_wall) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Volume;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn half_way_is_half_way_between_the_centres() {
        let spacing = Vector::new(2.0, 1.0, 1.0);
        let grid = Grid::new([9, 5, 5], spacing, Point::origin(), Matrix::identity()).unwrap();
        let of = |i: usize| match i {
            0..=2 => label::CHEST_WALL,
            3..=5 => label::SOFT_TISSUE,
            _ => label::OUTSIDE,
        };
        let labels = Volume::from_fn(grid, |[i, _, _]| of(i));
        let Surfaces { skin, chest_wall } = Surfaces::half_way(&labels);
        let mm = |distance: &SignedDistance, i: usize| {
            f64::from(distance.values().at([i, 2, 2])) / SignedDistance::PER_MM
        };
        // Planes at 5 and 11 mm.
        for i in 0..9 {
            let x = 2.0 * i as f64;
            assert!((mm(&chest_wall, i) - (x - 5.0)).abs() < 1e-3, "{i}");
            assert!((mm(&skin, i) - (x - 11.0)).abs() < 1e-3, "{i}");
        }
    }
}

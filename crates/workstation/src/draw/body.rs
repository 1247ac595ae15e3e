//! Where the patient lies in a CT: what the views show at first.

use supine_space::Grid;
use supine_volume::{Ct, Volume, components};

/// Air below this, HU: mattresses too.
const TISSUE_HU: i16 = -300;
/// Looked for on a grid so coarse, mm.
const STEP_MM: f64 = 4.0;

/// First and last voxel of the largest connected part that is not air.
pub(crate) fn body(ct: &Ct) -> Option<[[usize; 3]; 2]> {
    let (size, spacing) = (ct.grid().size(), ct.grid().spacing());
    let step = [0, 1, 2].map(|a| ((STEP_MM / spacing[a]) as usize).max(1));
    let coarse = [0, 1, 2].map(|a| size[a].div_ceil(step[a]));
    let (origin, direction) = (ct.grid().origin(), *ct.grid().direction());
    let grid = Grid::new(coarse, spacing, origin, direction).ok()?;
    let mask = Volume::from_fn(grid, |v| ct.at([0, 1, 2].map(|a| v[a] * step[a])) > TISSUE_HU);
    let parts = components(&mask);
    let largest = parts.mask(parts.largest()?);
    let mut bounds: Option<[[usize; 3]; 2]> = None;
    for n in (0..largest.data().len()).filter(|n| largest.data()[*n]) {
        let v = largest.grid().voxel(n);
        let [low, high] = bounds.get_or_insert([v; 2]);
        for a in 0..3 {
            (low[a], high[a]) = (low[a].min(v[a]), high[a].max(v[a]));
        }
    }
    let [low, high] = bounds?;
    let fine = |v: [usize; 3], more: usize| {
        [0, 1, 2].map(|a| (v[a] * step[a] + more * (step[a] - 1)).min(size[a] - 1))
    };
    Some([fine(low, 0), fine(high, 1)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point, Vector};

    #[test]
    fn the_patient_is_found_and_the_table_is_not() {
        let spacing = Vector::new(1.0, 1.0, 5.0);
        let grid = Grid::new([200, 180, 12], spacing, Point::origin(), Matrix::identity()).unwrap();
        let ct = Ct::from_fn(grid, |[i, j, _]| {
            let body = (40..=160).contains(&i) && (60..=130).contains(&j);
            let table = (150..153).contains(&j);
            if body || table { 40 } else { -1000 }
        });
        let [low, high] = body(&ct).unwrap();
        assert_eq!((low, high), ([40, 60, 0], [163, 131, 11]));
    }
}

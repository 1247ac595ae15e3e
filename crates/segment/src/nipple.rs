//! Where the nipple seems to be.

use crate::breast::Breast;
use supine_space::{Grid, Point, Side};
use supine_volume::{LabelMap, Volume, gaussian, label};

/// The nipple is looked for this near the breast's highest point, mm.
const REACH_MM: f64 = 60.0;
/// Scale at which the skin's bend is judged: the size of a nipple, mm.
const SCALE_MM: f64 = 4.5;
/// A bump this sharp is taken for the nipple: share of the body within the Gaussian. Measured: 0.26
/// to 0.31 at nipples, 0.43 and above on skin without one.
const SHARP: f32 = 0.38;

/// An estimate of the nipple of that side, LPS, mm; `None` when there is no breast.
///
/// The skin point where the skin bends outwards most, judged by the share of the body within a
/// Gaussian of 4.5 mm round it: half at a flat skin, less on a bump. On a breast without a bump, as
/// under a bra, the point that stands farthest off the chest wall.
pub fn nipple(labels: &LabelMap, side: Side) -> Option<Point> {
    let top = Breast::find(labels, side).ok()?.top;
    let (start, part) = surroundings(labels.grid(), &top)?;
    let whole = |[i, j, k]: [usize; 3]| [i + start[0], j + start[1], k + start[2]];
    let body = Volume::from_fn(part, |v| f32::from(labels.at(whole(v)) != label::OUTSIDE));
    let share = gaussian(&body, [SCALE_MM; 3]);
    let grid = share.grid();
    (0..grid.len())
        .map(|n| grid.voxel(n))
        .filter(|&v| (grid.centre(v) - top).norm() <= REACH_MM && is_skin(labels, whole(v)))
        .min_by(|&a, &b| share.at(a).total_cmp(&share.at(b)))
        .map(|v| if share.at(v) < SHARP { grid.centre(v) } else { top })
}

/// The part of the grid within reach of a point, and where it starts.
fn surroundings(grid: &Grid, centre: &Point) -> Option<([usize; 3], Grid)> {
    let index = grid.index_from_patient(centre);
    let (mut start, mut size) = ([0; 3], [0; 3]);
    for a in 0..3 {
        // The Gaussian reaches 4 sigma beyond the farthest skin point that is judged.
        let reach = (REACH_MM + 4.0 * SCALE_MM) / grid.spacing()[a];
        let last = (grid.size()[a] - 1) as f64;
        start[a] = (index[a] - reach).floor().clamp(0.0, last) as usize;
        size[a] = (index[a] + reach).ceil().clamp(0.0, last) as usize + 1 - start[a];
    }
    grid.crop(start, size).ok().map(|part| (start, part))
}

/// Soft tissue with air beside it.
fn is_skin(labels: &LabelMap, voxel: [usize; 3]) -> bool {
    let size = labels.grid().size();
    let air = |v: [usize; 3]| labels.at(v) == label::OUTSIDE;
    label::is_soft_tissue(labels.at(voxel))
        && (0..3).any(|a| {
            let (mut below, mut above) = (voxel, voxel);
            below[a] = voxel[a].saturating_sub(1);
            above[a] = (voxel[a] + 1).min(size[a] - 1);
            air(below) || air(above)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Vector};

    /// A round chest with a breast on its left side and a nipple on the breast.
    fn chest(nipple: Point) -> LabelMap {
        let grid = Grid::new(
            [120, 110, 50],
            Vector::new(2.5, 2.5, 4.0),
            Point::new(-150.0, -160.0, 0.0),
            Matrix::identity(),
        );
        let breast = Point::new(70.0, -75.0, 100.0);
        let grid = grid.unwrap();
        Volume::from_fn(grid.clone(), |v| {
            let p = grid.centre(v);
            let radius = p.x.hypot(p.y);
            if radius < 100.0 {
                label::CHEST_WALL
            } else if radius < 108.0 || (p - breast).norm() < 60.0 || (p - nipple).norm() < 7.0 {
                label::SOFT_TISSUE
            } else {
                label::OUTSIDE
            }
        })
    }

    #[test]
    fn the_bump_on_the_breast_is_found() {
        let breast = Point::new(70.0, -75.0, 100.0);
        for direction in [Vector::new(1.0, -1.0, 0.0), Vector::new(0.8, -1.0, -0.4)] {
            let bump = breast + direction.normalize() * 60.0;
            let found = nipple(&chest(bump), Side::Left).unwrap();
            assert!((found - bump).norm() < 9.0, "{found} {bump}");
        }
    }

    #[test]
    fn no_breast_has_no_nipple() {
        let bump = Point::new(0.0, 0.0, 0.0);
        assert_eq!(nipple(&chest(bump), Side::Right), None);
    }
}

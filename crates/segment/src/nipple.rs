//! Where the nipple seems to be.

use crate::Breast;
use crate::front::lattice;
use supine_space::{Grid, Point, Sphere, Vector};
use supine_volume::{Ct, LabelMap, Volume, gaussian, label, median, sample_trilinear_at};

// But for the height of a bump, chosen, not measured.
/// Distance of the points at which the skin is judged, mm.
const STEP_MM: f64 = 1.5;
/// Scale at which the skin is seen with the nipple, mm: the size of one.
const SCALE_MM: f64 = 4.5;
/// Scale at which it is the breast's own, without the nipple, mm.
const BREAST_MM: f64 = 9.0;
/// Levels beyond which a tissue counts no more: air in a fold, metal and calcification, HU.
const TISSUE_HU: (f32, f32) = (-200.0, 150.0);
/// The skin is judged where the share of the body within the smaller Gaussian is so near one half.
const SKIN: f32 = 0.15;
/// A bump this high is a nipple that stands out (see [`Breast::nipple`]). Measured: 0.083 and above
/// at such, 0.073 at most at flat ones and under a bra.
const SEEN: f32 = 0.078;

/// Where the nipple seems to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nipple {
    /// Middle of its base on the breast's skin, LPS, mm.
    pub point: Point,
    /// Whether it stands out from the breast; else the place is a guess.
    pub seen: bool,
}

impl Breast {
    /// The nipple: the clearest bump of dense skin on the breast.
    ///
    /// The bump is how much the share of the body within a Gaussian of 9 mm falls short of one half
    /// on the skin as a Gaussian of 4.5 mm shows it: 0 on flat skin. Its clearness is that times
    /// the density of the body within the smaller Gaussian, less the median over the breast's skin,
    /// HU. `None` when no skin of the breast is in the labels.
    pub fn nipple(&self, ct: &Ct, labels: &LabelMap) -> Option<Nipple> {
        let around = Sphere::new(self.centre(), self.reach()).ok()?;
        let skin = Skin::new(ct, labels, &around)?;
        let grid = skin.near.grid();
        let spots: Vec<usize> = (0..grid.len())
            .filter(|&n| (skin.near.data()[n] - 0.5).abs() < SKIN)
            .filter(|&n| around.contains(&grid.centre(grid.voxel(n))))
            .filter(|&n| self.may_bear(&grid.centre(grid.voxel(n))))
            .collect();
        let usual = median(&mut spots.iter().map(|&n| skin.density(n)).collect::<Vec<f32>>())
            .unwrap_or(0.0);
        let clear = |n: usize| (skin.density(n) - usual).max(0.0) * skin.bump(n).max(0.0);
        let &best = spots.iter().max_by(|&&a, &&b| clear(a).total_cmp(&clear(b)))?;
        let tip = grid.centre(grid.voxel(best));
        let (mut sum, mut weight) = (Vector::zeros(), f64::MIN_POSITIVE);
        for &n in &spots {
            let off = grid.centre(grid.voxel(n)) - tip;
            if off.norm() <= BREAST_MM {
                sum += f64::from(clear(n)) * off;
                weight += f64::from(clear(n));
            }
        }
        Some(Nipple { point: skin.base(tip + sum / weight), seen: skin.bump(best) >= SEEN })
    }
}

/// The skin and what lies under it, smoothed, on a lattice round the breast.
struct Skin {
    /// Share of the body within the smaller Gaussian.
    near: Volume<f32>,
    /// Share of the body within the larger Gaussian.
    wide: Volume<f32>,
    /// HU of the body within the smaller Gaussian, times its share.
    hu: Volume<f32>,
}

impl Skin {
    fn new(ct: &Ct, labels: &LabelMap, around: &Sphere) -> Option<Self> {
        // The smaller Gaussian reaches beyond the farthest skin that is judged.
        let whole = Sphere::new(around.centre(), around.radius() + 4.0 * SCALE_MM).ok()?;
        let (start, part) = labels.grid().around(&whole)?;
        let at = |v: [usize; 3]| [0, 1, 2].map(|a| v[a] + start[a]);
        let body =
            Volume::par_from_fn(part.clone(), |v| u8::from(labels.at(at(v)) != label::OUTSIDE));
        let hu = Volume::par_from_fn(part, |v| {
            if body.at(v) == 0 {
                return 0.0;
            }
            f32::from(ct.at(at(v))).clamp(TISSUE_HU.0, TISSUE_HU.1)
        });
        let (low, high) = whole.bounds();
        let grid = lattice(low, high, STEP_MM)?;
        let body = sampled(&body, &grid);
        Some(Self {
            near: gaussian(&body, [SCALE_MM; 3]),
            wide: gaussian(&body, [BREAST_MM; 3]),
            hu: gaussian(&sampled(&hu, &grid), [SCALE_MM; 3]),
        })
    }

    fn density(&self, n: usize) -> f32 {
        self.hu.data()[n] / self.near.data()[n]
    }

    /// What the wider Gaussian misses of the body at the skin near by. Across flat skin its share
    /// changes half as fast as that of the smaller one.
    fn bump(&self, n: usize) -> f32 {
        let to_skin = (SCALE_MM / BREAST_MM) as f32 * (self.near.data()[n] - 0.5);
        0.5 + to_skin - self.wide.data()[n]
    }

    /// The point under the tip on the breast's own skin.
    fn base(&self, tip: Point) -> Point {
        let at = |p: &Point| sample_trilinear_at(&self.wide, p);
        let mut point = tip;
        // Not deeper than a nipple is high.
        for _ in 0..(2.0 * BREAST_MM / STEP_MM) as usize {
            if at(&point) >= 0.5 {
                break;
            }
            let slope = Vector::from([0, 1, 2].map(|a| {
                let mut step = Vector::zeros();
                step[a] = STEP_MM;
                f64::from(at(&(point + step)) - at(&(point - step)))
            }));
            point += slope.try_normalize(0.0).unwrap_or_default() * (0.5 * STEP_MM);
        }
        point
    }
}

/// The volume on a lattice; beyond its ends it goes on as it ended.
fn sampled<T: Copy + Into<f32> + Sync>(volume: &Volume<T>, lattice: &Grid) -> Volume<f32> {
    Volume::par_from_fn(lattice.clone(), |v| sample_trilinear_at(volume, &lattice.centre(v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Side};

    const BREAST: Point = Point::new(70.0, -75.0, 100.0);

    /// A round chest of fat with a breast on its left side, and on the breast a nipple and a fold.
    fn chest(nipple: Option<Point>, fold: Point) -> (Ct, LabelMap) {
        let grid = Grid::new(
            [150, 140, 50],
            Vector::new(2.0, 2.0, 4.0),
            Point::new(-150.0, -160.0, 0.0),
            Matrix::identity(),
        );
        let is_nipple = |p: &Point| nipple.is_some_and(|nipple| (p - nipple).norm() < 7.0);
        let labels = Volume::from_fn(grid.unwrap(), |_| 0u8);
        let of = |f: &dyn Fn(&Point) -> i16| {
            let grid = labels.grid();
            (0..grid.len()).map(|n| f(&grid.centre(grid.voxel(n)))).collect::<Vec<i16>>()
        };
        let ct = of(&|p| if is_nipple(p) { 30 } else { -100 });
        let map = of(&|p| {
            let radius = p.x.hypot(p.y);
            let breast = (p - BREAST).norm() < 60.0 || (p - fold).norm() < 7.0;
            if radius < 100.0 {
                label::CHEST_WALL.into()
            } else {
                i16::from(radius < 108.0 || breast || is_nipple(p))
            }
        });
        let map = map.into_iter().map(|l| l as u8).collect();
        (labels.with_data(ct).unwrap(), labels.with_data(map).unwrap())
    }

    fn on_skin(x: f64, y: f64, z: f64) -> Point {
        BREAST + Vector::new(x, y, z).normalize() * 60.0
    }

    #[test]
    fn the_dense_bump_is_found_and_not_the_fold() {
        for (nipple, fold) in
            [((1.0, -1.0, 0.0), (0.1, -1.0, 0.4)), ((0.4, -1.0, -0.4), (1.0, -1.0, 0.3))]
        {
            let nipple = on_skin(nipple.0, nipple.1, nipple.2);
            let (ct, labels) = chest(Some(nipple), on_skin(fold.0, fold.1, fold.2));
            let breast = Breast::find(&labels, Side::Left, None).unwrap();
            let found = breast.nipple(&ct, &labels).unwrap();
            assert!(found.seen && (found.point - nipple).norm() < 2.5, "{found:?} {nipple}");
        }
    }

    #[test]
    fn without_a_dense_bump_it_is_a_guess() {
        let (ct, labels) = chest(None, BREAST);
        let breast = Breast::find(&labels, Side::Left, None).unwrap();
        let found = breast.nipple(&ct, &labels).unwrap();
        assert!(!found.seen, "{found:?}");
    }
}

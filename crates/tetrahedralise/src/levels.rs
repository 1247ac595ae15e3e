//! Levels of a mask of voxels: the distance to its boundary between the voxels.

use crate::labels::Kind;
use crate::samples::Samples;
use rayon::prelude::*;
use supine_space::{Grid, GridError, Vector};
use supine_volume::{SignedDistance, Surfaces, Volume, gaussian};

/// Beyond this the smoothed mask is flat and says no distance: |2g - 1|.
const FLAT: f64 = 0.99999;
/// How far the distances to known surfaces are told, mm.
pub(crate) const BAND_MM: f64 = 8.0;
/// Rough labels are smoothed up to so many times as widely as clean ones: more takes shape away.
const WIDEST: f64 = 2.0;
/// Roughness of clean voxels: the smoothed surface follows them a little.
const CLEAN: f64 = 0.93;
/// Way over which the curvature is told, in standard deviations of the smoothing.
const CURVATURE: f64 = 4.0;
/// Where the level rises by less than this, mm per mm, lies a speck and no surface.
const SPECK: f64 = 0.5;
/// Labels this little rougher than clean ones are not smoothed once more.
const HARDLY_ROUGH: f64 = 1.05;
/// Distances to known surfaces are told at voxels about this far apart, mm.
const KNOWN_APART_MM: f64 = 1.5;
/// Samples of what a Gaussian leaves may be this far apart, in its standard deviations.
const APART: f64 = 0.9;

/// Beyond this a mask smoothed by `sigma` (mm) says no distance, mm.
pub(crate) fn flat_mm(sigma: f64) -> f64 {
    sigma * std::f64::consts::SQRT_2 * erf_inverse(FLAT)
}

/// Levels of air and chest wall.
pub(crate) type Levels = Result<[Volume<f32>; 2], GridError>;

/// Levels of outside air and chest wall from the voxels alone, positive inside them, mm. `sigma`
/// (mm) is for clean labels; rough ones are smoothed more widely, as their roughness asks.
pub(crate) fn smoothed_levels(kinds: &Volume<Kind>, sigma: f64) -> Levels {
    let blocks = Blocks::new(kinds.grid(), sigma)?;
    let level = |mask| smoothed_level(kinds, mask, &blocks, sigma);
    let (air, wall) = rayon::join(|| level(Kind::Air), || level(Kind::Wall));
    Ok([air, wall])
}

/// The points at which smoothed levels are kept: the middles of blocks of voxels, as large as the
/// smoothing allows.
#[derive(Clone, Debug)]
struct Blocks {
    /// Voxels of a block along each axis.
    step: [usize; 3],
    grid: Grid,
}

impl Blocks {
    /// Blocks of voxels for a smoothing with the standard deviation `sigma`, mm.
    fn new(voxels: &Grid, sigma: f64) -> Result<Self, GridError> {
        let s = voxels.spacing();
        let step = [0, 1, 2].map(|a| ((APART * sigma / s[a]) as usize).clamp(1, voxels.size()[a]));
        let size = [0, 1, 2].map(|a| voxels.size()[a].div_ceil(step[a]));
        let spacing = Vector::from_fn(|a, _| s[a] * step[a] as f64);
        let first = voxels.patient_from_index(step.map(|n| 0.5 * (n - 1) as f64));
        Ok(Self { step, grid: Grid::new(size, spacing, first, *voxels.direction())? })
    }

    /// Share of the voxels of each block that are of one kind; at the ends the last voxel goes on.
    fn shares(&self, kinds: &Volume<Kind>, mask: Kind) -> Volume<f32> {
        let ([ni, nj, nk], [mi, mj, _]) = (kinds.grid().size(), self.grid.size());
        let share = 1.0 / self.step.iter().product::<usize>() as f32;
        let mut shares = Volume::from_fn(self.grid.clone(), |_| 0.0);
        shares.data_mut().par_chunks_mut(mi).enumerate().for_each(|(block, out)| {
            let (first_j, first_k) = (block % mj * self.step[1], block / mj * self.step[2]);
            let mut sums = vec![0u16; mi * self.step[0]];
            for k in first_k..first_k + self.step[2] {
                for j in first_j..first_j + self.step[1] {
                    let start = (k.min(nk - 1) * nj + j.min(nj - 1)) * ni;
                    let row = &kinds.data()[start..start + ni];
                    sums.iter_mut().zip(row).for_each(|(sum, &k)| *sum += u16::from(k == mask));
                }
            }
            let last = sums[ni - 1];
            sums[ni..].fill(last);
            for (out, sums) in out.iter_mut().zip(sums.chunks(self.step[0])) {
                *out = share * f32::from(sums.iter().sum::<u16>());
            }
        });
        shares
    }

    /// The shares smoothed so that, with what the blocks did, `sigma` (mm) is reached.
    fn smoothed(&self, shares: &Volume<f32>, sigma: f64) -> Volume<f32> {
        let s = self.grid.spacing();
        let left = |a: usize| {
            let n = self.step[a] as f64;
            let done = (s[a] / n).powi(2) * (n * n - 1.0) / 12.0;
            (sigma * sigma - done).max(0.0).sqrt()
        };
        gaussian(shares, [0, 1, 2].map(left))
    }
}

fn smoothed_level(kinds: &Volume<Kind>, mask: Kind, blocks: &Blocks, sigma: f64) -> Volume<f32> {
    let shares = blocks.shares(kinds, mask);
    let level = |wider: f64| {
        let smoothed = blocks.smoothed(&shares, wider * sigma);
        unbent(level_of(smoothed, wider * sigma), sigma, wider * sigma)
    };
    let clean = level(1.0);
    let wider = (roughness(kinds, mask, &clean) / CLEAN).clamp(1.0, WIDEST);
    if wider > HARDLY_ROUGH { level(wider) } else { clean }
}

/// Distance for a plane: sigma sqrt2 erfinv(2g - 1) of the smoothed mask g, mm.
fn level_of(mut mask: Volume<f32>, sigma: f64) -> Volume<f32> {
    let flat = flat_mm(sigma);
    mask.data_mut().par_iter_mut().with_min_len(4096).for_each(|g| {
        let x = 2.0 * f64::from(*g) - 1.0;
        *g = if x.abs() >= FLAT {
            flat.copysign(x) as f32
        } else {
            (sigma * std::f64::consts::SQRT_2 * erf_inverse(x)) as f32
        };
    });
    mask
}

/// The level without the shift that smoothing gives a curved surface.
///
/// A Gaussian moves a surface by sigma² / 2 times the sum of its curvatures, which is the Laplacian
/// of the distance: told by differences over `CURVATURE` sigma, where the voxels are not felt.
fn unbent(level: Volume<f32>, clean: f64, sigma: f64) -> Volume<f32> {
    let (grid, [ni, nj, nk]) = (level.grid().clone(), level.grid().size());
    let stride = [1, ni, ni * nj];
    let reach =
        [0, 1, 2].map(|a| ((CURVATURE * sigma / grid.spacing()[a]).round() as usize).max(1));
    let share = [0, 1, 2].map(|a| {
        let way = reach[a] as f64 * grid.spacing()[a];
        (0.5 * (clean / way).powi(2)) as f32
    });
    let (d, sigma) = (level.data(), sigma as f32);
    let mut unbent = level.clone();
    unbent.data_mut().par_chunks_mut(ni * nj).enumerate().for_each(|(k, slice)| {
        for (at, out) in slice.iter_mut().enumerate() {
            let n = k * ni * nj + at;
            let near = (2.0 - d[n].abs() / sigma).min(1.0);
            if near <= 0.0 {
                continue;
            }
            let (voxel, size) = ([at % ni, at / ni, k], [ni, nj, nk]);
            for a in 0..3 {
                if voxel[a] >= reach[a] && voxel[a] + reach[a] < size[a] {
                    let step = reach[a] * stride[a];
                    *out += near * share[a] * (2.0 * d[n] - d[n - step] - d[n + step]);
                }
            }
        }
    });
    unbent
}

/// How far the voxels of a mask stand off its smooth boundary, in units of what voxels of a smooth
/// shape do: root mean square over the faces between voxels in and out of it.
///
/// The boundary of a smooth shape meets the line between two voxel centres anywhere with the same
/// likelihood, so that the middle lies off it by the way along the normal over sqrt 12.
fn roughness(kinds: &Volume<Kind>, mask: Kind, level: &Volume<f32>) -> f64 {
    let (grid, [ni, nj, nk]) = (kinds.grid(), kinds.grid().size());
    let (stride, s, data) = ([1, ni, ni * nj], grid.spacing(), kinds.data());
    let away = level.grid().origin() - grid.origin();
    let values = level.data().iter().map(|&v| [v]).collect();
    let low = grid.direction().tr_mul(&away);
    let level = Samples::new(level.grid().size(), level.grid().spacing(), low, values);
    let slice = |k: usize| {
        let (mut off, mut smooth) = (0.0, 0.0);
        for j in 1..nj.saturating_sub(2) {
            let start = (k * nj + j) * ni;
            for axis in 0..3 {
                for i in 1..ni.saturating_sub(2) {
                    let n = start + i;
                    if (data[n] == mask) == (data[n + stride[axis]] == mask) {
                        continue;
                    }
                    let mut middle = Vector::new(i as f64, j as f64, k as f64);
                    middle[axis] += 0.5;
                    let (value, slope) = level.value_gradient(0, &middle.component_mul(&s));
                    let steep = slope.norm();
                    if steep >= SPECK {
                        off += (value / steep).powi(2);
                        smooth += (slope[axis] / steep * s[axis]).powi(2) / 12.0;
                    }
                }
            }
        }
        (off, smooth)
    };
    let slices: Vec<(f64, f64)> = (1..nk.saturating_sub(2)).into_par_iter().map(slice).collect();
    let (off, smooth) = slices.iter().fold((0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1));
    if smooth > 0.0 { (off / smooth).sqrt() } else { 1.0 }
}

/// Levels of outside air and chest wall, positive inside them, mm: the distance to the known
/// surfaces, smoothed by `sigma` (mm), where those part the kinds of voxels, else to the middle
/// between voxels.
pub(crate) fn known_levels(kinds: &Volume<Kind>, surfaces: &Surfaces, sigma: f64) -> Levels {
    let voxels = kinds.grid();
    let step = [0, 1, 2].map(|a| ((KNOWN_APART_MM / voxels.spacing()[a]) as usize).max(1));
    let size = [0, 1, 2].map(|a| (voxels.size()[a] - 1) / step[a] + 1);
    let spacing = Vector::from_fn(|a, _| voxels.spacing()[a] * step[a] as f64);
    let grid = Grid::new(size, spacing, voxels.origin(), *voxels.direction())?;
    let whole = surfaces.skin.grid();
    let first = whole.index_from_patient(&voxels.origin()).map(|x| x.round() as usize);
    let place = |n: usize| {
        let v = grid.voxel(n);
        whole.offset([0, 1, 2].map(|a| v[a] * step[a] + first[a]))
    };
    let level = |mask: Kind, surface: &SignedDistance| {
        let inside =
            |n: usize| kinds.at(std::array::from_fn(|a| grid.voxel(n)[a] * step[a])) == mask;
        let crossing = |n, m| surface.crossing(place(n), place(m));
        let distance = SignedDistance::new(&grid, BAND_MM, inside, crossing);
        let per_mm = SignedDistance::PER_MM as f32;
        gaussian(&distance.values().map(|&d| -f32::from(d) / per_mm), [sigma; 3])
    };
    let (air, wall) = rayon::join(
        || level(Kind::Air, &surfaces.skin),
        || level(Kind::Wall, &surfaces.chest_wall),
    );
    Ok([air, wall])
}

/// Inverse of the error function for |x| < 1, to about 4e-7 relative.
///
/// Source: M. Giles, "Approximating the erfinv function", GPU Computing Gems 2 (2011), the
/// single-precision polynomials.
fn erf_inverse(x: f64) -> f64 {
    const CENTRAL: [f64; 9] = [
        2.810_226_36e-8,
        3.432_739_39e-7,
        -3.523_387_7e-6,
        -4.391_506_54e-6,
        0.000_218_580_87,
        -0.001_253_725_03,
        -0.004_177_681_64,
        0.246_640_727,
        1.501_409_41,
    ];
    const TAIL: [f64; 9] = [
        -0.000_200_214_257,
        0.000_100_950_558,
        0.001_349_343_22,
        -0.003_673_428_44,
        0.005_739_507_73,
        -0.007_622_461_3,
        0.009_438_870_47,
        1.001_674_06,
        2.832_976_82,
    ];
    let w = -((1.0 - x) * (1.0 + x)).ln();
    let (w, series) = if w < 5.0 { (w - 2.5, &CENTRAL) } else { (w.sqrt() - 3.0, &TAIL) };
    series.iter().fold(0.0, |sum, c| sum * w + c) * x
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point};

    #[test]
    fn the_inverse_error_function_is_right() {
        // erf(0.5), erf(1), erf(2)
        for (x, y) in [(0.520_499_877_8, 0.5), (0.842_700_792_9, 1.0), (0.995_322_265, 2.0)] {
            assert!((erf_inverse(x) - y).abs() < 2e-6, "{x}");
            assert!((erf_inverse(-x) + y).abs() < 2e-6, "{x}");
        }
    }

    fn grid(spacing: Vector) -> Grid {
        let size = [0, 1, 2].map(|a| (56.0 / spacing[a]) as usize);
        Grid::new(size, spacing, Point::new(-28.0, -28.0, -28.0), Matrix::identity()).unwrap()
    }

    /// The level of a ball of soft tissue in air is that of the ball, and not of a smaller one.
    #[test]
    fn smoothing_does_not_shrink_what_is_round() {
        let (grid, radius) = (grid(Vector::new(0.8, 0.8, 1.5)), 14.0);
        let kinds = Volume::from_fn(grid.clone(), |v| {
            if grid.centre(v).coords.norm() < radius { Kind::Soft } else { Kind::Air }
        });
        let blocks = Blocks::new(&grid, 2.0).unwrap();
        assert!(blocks.step == [2, 2, 1]);
        let level = smoothed_level(&kinds, Kind::Air, &blocks, 2.0).into_parts().1;
        let (mut sum, mut count) = (0.0, 0.0);
        for (n, &level) in level.iter().enumerate() {
            let off = blocks.grid.centre(blocks.grid.voxel(n)).coords.norm() - radius;
            if off.abs() < 0.7 {
                (sum, count) = (sum + f64::from(level) - off, count + 1.0);
            }
        }
        // sigma² / radius = 0.29 mm is what the Gaussian alone would shift it by.
        assert!((sum / count).abs() < 0.06, "{}", sum / count);
    }

    /// Clean voxels of any spacing are not rough; shaken ones are, as far as they are shaken.
    #[test]
    fn roughness_tells_clean_labels_from_shaken_ones() {
        let rough = |spacing: Vector, shake: f64| {
            let grid = grid(spacing);
            let normal = Vector::new(0.3, -0.8, 0.4).normalize();
            let mut seed = 1u32;
            let kinds = Volume::from_fn(grid.clone(), |v| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let random = f64::from(seed >> 8) / f64::from(1 << 24) - 0.5;
                let off = grid.centre(v).coords.dot(&normal) + shake * random;
                if off > 0.0 { Kind::Air } else { Kind::Soft }
            });
            let sigma = 1.5f64.max(0.9 * spacing.max());
            let blocks = Blocks::new(&grid, sigma).unwrap();
            let level = level_of(blocks.smoothed(&blocks.shares(&kinds, Kind::Air), sigma), sigma);
            roughness(&kinds, Kind::Air, &unbent(level, sigma, sigma))
        };
        let fine = Vector::new(0.8, 0.8, 1.5);
        for spacing in [fine, Vector::repeat(1.0), Vector::new(0.7, 0.7, 3.0)] {
            let clean = rough(spacing, 0.0);
            assert!((0.85..1.05).contains(&clean), "{spacing:?}: {clean}");
        }
        let (some, much) = (rough(fine, 1.5), rough(fine, 4.0));
        assert!(some > 1.2 && much > 1.4 * some, "{some} {much}");
    }
}

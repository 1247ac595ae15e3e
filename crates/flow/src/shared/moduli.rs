//! What tissue lies in each tetrahedron, and its modulus.

use crate::spec::{Stiffness, StiffnessMap};
use rayon::prelude::*;
use supine_mesh::TetMesh;
use supine_report::Moduli;
use supine_space::{Grid, Point};
use supine_volume::{Ct, LabelMap, label};

/// Samples of a tetrahedron: per voxel, and the fewest and most of one.
const PER_VOXEL: f64 = 8.0;
const SAMPLES: (u32, u32) = (64, 4096);

/// What tissue is read from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Map<'a> {
    /// The finer labels.
    pub(crate) labels: &'a LabelMap,
    /// The CT on the same grid, HU.
    pub(crate) ct: &'a Ct,
    /// Levels of fat and gland, HU; without gland all of it counts as fat.
    pub(crate) levels_hu: (f64, Option<f64>),
    /// Whether labels or HU tell fat from gland.
    pub(crate) kind: StiffnessMap,
}

/// Shares of fat, gland, skin and tumour in the soft tissue of each tetrahedron.
///
/// It is looked at in more places than it has voxels. What is not soft tissue does not count; soft
/// tissue that is none of these (implants) counts as fat, and a tetrahedron with nothing else takes
/// the mean of all.
pub(crate) fn shares(mesh: &TetMesh, map: &Map<'_>) -> Vec<[f64; 4]> {
    let count = mesh.tets().len();
    let means: Vec<Option<[f64; 4]>> =
        (0..count).into_par_iter().map(|t| mean(&mesh.corners(t), map)).collect();
    let (mut sum, mut whole) = ([0.0; 4], 0.0);
    for (tet, of) in means.iter().enumerate() {
        let Some(of) = of else { continue };
        let volume = mesh.volume(tet);
        (0..4).for_each(|k| sum[k] += of[k] * volume);
        whole += volume;
    }
    let all = if whole > 0.0 { sum.map(|part| part / whole) } else { [1.0, 0.0, 0.0, 0.0] };
    means.into_iter().map(|of| of.unwrap_or(all)).collect()
}

/// The moduli of the tetrahedra, kPa, and what a report tells of them.
///
/// A tetrahedron has the mean over its volume of the moduli of the tissues in it. The arithmetic
/// mean, because the energy is linear in the moduli: where the strain is uniform within the
/// tetrahedron, as in a linear one, it stores exactly what its tissues store.
pub(crate) fn moduli(
    mesh: &TetMesh,
    shares: &[[f64; 4]],
    stiffness: &Stiffness,
) -> (Vec<f64>, Moduli) {
    let unscaled = supine_personalise::moduli(shares, &stiffness.kpa);
    let (mut sum, mut whole) = (0.0, 0.0);
    for (tet, e) in unscaled.iter().enumerate() {
        let volume = mesh.volume(tet);
        sum += e * volume;
        whole += volume;
    }
    let all = sum / whole;
    let scale = stiffness.mean_kpa.map_or(1.0, |wanted| wanted / all);
    let moduli: Vec<f64> = unscaled.into_iter().map(|e| scale * e).collect();
    let [fat_kpa, gland_kpa, skin_kpa, tumour_kpa] = stiffness.kpa.map(|e| e * scale);
    let told = Moduli {
        map: stiffness.map.name().into(),
        fat_kpa,
        gland_kpa,
        skin_kpa,
        tumour_kpa,
        min_kpa: moduli.iter().copied().fold(f64::INFINITY, f64::min),
        mean_kpa: scale * all,
        max_kpa: moduli.iter().copied().fold(0.0, f64::max),
    };
    (moduli, told)
}

/// Shares of the tissues in a tetrahedron.
fn mean(corners: &[Point; 4], map: &Map<'_>) -> Option<[f64; 4]> {
    let (mut sum, mut count) = ([0.0; 4], 0.0);
    for p in samples(corners, map.labels.grid()) {
        let Some(voxel) = map.labels.grid().voxel_at(&p) else { continue };
        let label = map.labels.at(voxel);
        if label::is_soft_tissue(label) {
            let of = tissue(label, map, voxel);
            (0..4).for_each(|k| sum[k] += of[k]);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum.map(|part| part / count))
}

/// Shares of fat, gland, skin and tumour in a voxel.
fn tissue(label: u8, map: &Map<'_>, voxel: [usize; 3]) -> [f64; 4] {
    match (label, map.kind) {
        (label::SKIN, _) => [0.0, 0.0, 1.0, 0.0],
        (label::TUMOUR, _) => [0.0, 0.0, 0.0, 1.0],
        (label::GLAND, StiffnessMap::Labels) => [0.0, 1.0, 0.0, 0.0],
        (label::FAT | label::GLAND, StiffnessMap::Hounsfield) => {
            let (low, high) = map.levels_hu;
            let hu = f64::from(map.ct.at(voxel));
            let gland = high.map_or(0.0, |high| ((hu - low) / (high - low)).clamp(0.0, 1.0));
            [1.0 - gland, gland, 0.0, 0.0]
        }
        _ => [1.0, 0.0, 0.0, 0.0],
    }
}

/// Points spread evenly within a tetrahedron, [`PER_VOXEL`] for each voxel that fits into it.
///
/// The additive recurrence in three dimensions of Roberts (2018) with the powers of the root of g⁴
/// = g + 1, folded from the cube into the tetrahedron as by Rocchini and Cignoni (J. Graph. Tools
/// 5, 2000).
fn samples(corners: &[Point; 4], grid: &Grid) -> impl Iterator<Item = Point> {
    const STEPS: [f64; 3] =
        [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
    let [a, b, c, d] = *corners;
    let (u, v, w) = (b - a, c - a, d - a);
    let voxels = u.dot(&v.cross(&w)) / 6.0 / grid.voxel_volume();
    let count = ((PER_VOXEL * voxels).ceil() as u32).clamp(SAMPLES.0, SAMPLES.1);
    (0..count).map(move |n| {
        let [mut s, mut t, mut r] = STEPS.map(|step| (0.5 + f64::from(n) * step).fract());
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        if t + r > 1.0 {
            (t, r) = (1.0 - r, 1.0 - s - t);
        } else if s + t + r > 1.0 {
            (s, r) = (1.0 - t - r, s + t + r - 1.0);
        }
        a + u * s + v * t + w * r
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_mesh::{BoundaryFace, BoundaryTag, TET_FACES};
    use supine_space::Matrix;
    use supine_space::Vector;
    use supine_volume::Volume;

    fn corner() -> TetMesh {
        let points = [[0., 0., 0.], [12., 0., 0.], [0., 12., 0.], [0., 0., 12.]].map(Point::from);
        let faces = TET_FACES.map(|f| f.map(|c| c as u32));
        let boundary = faces.map(|points| BoundaryFace { points, tag: BoundaryTag::Skin }).to_vec();
        TetMesh::new(points.to_vec(), vec![[0, 1, 2, 3]], boundary).unwrap()
    }

    fn grid() -> Grid {
        let origin = Point::new(-2.0, -2.0, -2.0);
        Grid::new([20, 20, 20], Vector::repeat(1.0), origin, Matrix::identity()).unwrap()
    }

    fn stiffness(map: StiffnessMap) -> Stiffness {
        Stiffness { map, kpa: [1.0, 3.0, 20.0, 7.0], mean_kpa: None, given: true }
    }

    fn of(map: &Map<'_>, stiffness: &Stiffness) -> (Vec<f64>, Moduli) {
        let map = Map { kind: stiffness.map, ..*map };
        moduli(&corner(), &shares(&corner(), &map), stiffness)
    }

    /// Of the tetrahedron with its right corner at the origin the share (1 − t)³ lies beyond x = 12
    /// t.
    #[test]
    fn a_tetrahedron_has_the_mean_of_what_lies_in_it() {
        let labels = |of: &dyn Fn(&Point) -> u8| Volume::from_fn(grid(), |v| of(&grid().centre(v)));
        let ct = Volume::from_fn(grid(), |v| if grid().centre(v).x < 3.0 { -100 } else { 40 });
        let mixed = labels(&|p| if p.x < 3.5 { label::FAT } else { label::GLAND });
        let map = Map {
            labels: &mixed,
            ct: &ct,
            levels_hu: (-100.0, Some(60.0)),
            kind: StiffnessMap::Labels,
        };
        let beyond = (1.0f64 - 3.5 / 12.0).powi(3);
        let (found, told) = of(&map, &stiffness(StiffnessMap::Labels));
        assert!((found[0] - (1.0 + 2.0 * beyond)).abs() < 0.01, "{found:?}");
        assert_eq!((told.min_kpa, told.max_kpa), (found[0], found[0]));
        let (found, _) = of(&map, &stiffness(StiffnessMap::Hounsfield));
        let beyond = (1.0f64 - 2.5 / 12.0).powi(3);
        assert!((found[0] - (1.0 + 2.0 * 140.0 / 160.0 * beyond)).abs() < 0.01, "{found:?}");
        // Bone does not count, and where there is nothing else the mean stands in.
        let bony = labels(&|p| if p.x < 3.5 { label::BONE } else { label::TUMOUR });
        let map = Map { labels: &bony, ..map };
        assert!((of(&map, &stiffness(StiffnessMap::Labels)).0[0] - 7.0).abs() < 1e-12);
        let bone = labels(&|_| label::BONE);
        let map = Map { labels: &bone, ..map };
        assert_eq!(of(&map, &stiffness(StiffnessMap::Labels)).0, [1.0]);
    }

    #[test]
    fn samples_fill_the_tetrahedron_evenly() {
        let corners = corner().corners(0);
        let all: Vec<Point> = samples(&corners, &grid()).collect();
        assert_eq!(all.len(), 8 * 288);
        let sum: Vector = all.iter().map(|p| p.coords).sum();
        assert!((sum / all.len() as f64 - Vector::repeat(3.0)).norm() < 0.1);
        assert!(all.iter().all(|p| p.iter().all(|c| *c >= 0.0) && p.coords.sum() <= 12.0));
        for share in [0.2, 0.5, 0.8f64] {
            for axis in 0..3 {
                let beyond = all.iter().filter(|p| p[axis] > 12.0 * share).count();
                let off = beyond as f64 / all.len() as f64 - (1.0 - share).powi(3);
                assert!(off.abs() < 1e-2, "{share} along {axis}: {off}");
            }
        }
    }

    #[test]
    fn proportions_are_kept_under_a_wanted_mean() {
        let labels = Volume::from_fn(grid(), |v| if v[0] < 6 { label::FAT } else { label::SKIN });
        let ct = Volume::from_fn(grid(), |_| 0);
        let map =
            Map { labels: &labels, ct: &ct, levels_hu: (-100.0, None), kind: StiffnessMap::Labels };
        let wanted = Stiffness { mean_kpa: Some(0.609), ..stiffness(StiffnessMap::Labels) };
        let (found, told) = of(&map, &wanted);
        assert!((found[0] - 0.609).abs() < 1e-12 && (told.mean_kpa - 0.609).abs() < 1e-12);
        assert!((told.skin_kpa / told.fat_kpa - 20.0).abs() < 1e-12, "{told:?}");
        // No gland was found: grey values say nothing.
        let fat = Volume::from_fn(grid(), |_| label::GLAND);
        let map = Map { labels: &fat, ..map };
        assert_eq!(of(&map, &stiffness(StiffnessMap::Hounsfield)).0, [1.0]);
    }
}

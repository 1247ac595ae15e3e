//! Painted maps on the grid of the CT.

use rayon::prelude::*;
use std::ops::RangeInclusive;
use supine_space::{Grid, Vector};
use supine_volume::{SeedKind, Volume};

type Map = Volume<Option<SeedKind>>;

/// The first and the last voxel of a box.
#[derive(Clone, Copy)]
struct Extent {
    first: [usize; 3],
    last: [usize; 3],
}

/// The voxels of a grid that a map says something of: those whose centres lie in painted voxels,
/// and, where the map is finer, those that hold the centre of a painted voxel of one kind only.
pub(super) fn on_grid(grid: &Grid, map: &Map) -> Vec<(usize, SeedKind)> {
    let Some(painted) = extent(map) else { return Vec::new() };
    let Some(near) = corners(grid, map.grid(), painted) else { return Vec::new() };
    let Extent { first: low, last: high } = near;
    let mut voxels: Vec<(usize, SeedKind)> = (low[2]..high[2] + 1)
        .into_par_iter()
        .flat_map_iter(|k| {
            let rows = (low[1]..high[1] + 1).map(move |j| (j, k));
            rows.flat_map(|(j, k)| row(grid, map, low[0]..=high[0], j, k))
        })
        .collect();
    let coarse = grid.spacing().min();
    if map.grid().spacing().iter().any(|&s| s < 0.99 * coarse.max(grid.spacing().max())) {
        add_thin(grid, map, painted, &mut voxels);
    }
    voxels
}

/// First and last painted voxel along each axis.
fn extent(map: &Map) -> Option<Extent> {
    let [ni, nj, nk] = map.grid().size();
    let none = Extent { first: [usize::MAX; 3], last: [0; 3] };
    let join = |a: Extent, b: Extent| Extent {
        first: [0, 1, 2].map(|n| a.first[n].min(b.first[n])),
        last: [0, 1, 2].map(|n| a.last[n].max(b.last[n])),
    };
    let slice = |k: usize| {
        let mut out = none;
        for j in 0..nj {
            let row = &map.data()[(k * nj + j) * ni..][..ni];
            if let Some(i) = row.iter().position(Option::is_some) {
                let end = row.iter().rposition(Option::is_some).unwrap_or(i);
                out = join(out, Extent { first: [i, j, k], last: [end, j, k] });
            }
        }
        out
    };
    let all = (0..nk).into_par_iter().map(slice).reduce(|| none, join);
    (all.first[0] != usize::MAX).then_some(all)
}

/// The box of voxels of `grid` that holds a box of another grid.
fn corners(grid: &Grid, other: &Grid, Extent { first, last }: Extent) -> Option<Extent> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for n in 0..8 {
        let corner = [0, 1, 2]
            .map(|a| if n >> a & 1 == 0 { first[a] as f64 - 0.5 } else { last[a] as f64 + 0.5 });
        let at = grid.index_from_patient(&other.patient_from_index(corner));
        low = [0, 1, 2].map(|a| low[a].min(at[a]));
        high = [0, 1, 2].map(|a| high[a].max(at[a]));
    }
    let end = grid.size().map(|n| n as f64 - 1.0);
    let meets = (0..3).all(|a| high[a] >= 0.0 && low[a] <= end[a]);
    meets.then(|| {
        let inside = |x: f64, a: usize| x.clamp(0.0, end[a]) as usize;
        Extent {
            first: [0, 1, 2].map(|a| inside(low[a].floor(), a)),
            last: [0, 1, 2].map(|a| inside(high[a].ceil(), a)),
        }
    })
}

/// What the map says of the voxels of a row.
fn row(
    grid: &Grid,
    map: &Map,
    along: RangeInclusive<usize>,
    j: usize,
    k: usize,
) -> Vec<(usize, SeedKind)> {
    let size = map.grid().size();
    let from = Vector::from(map.grid().index_from_patient(&grid.centre([0, j, k])));
    let next = Vector::from(map.grid().index_from_patient(&grid.centre([1, j, k])));
    let step = next - from;
    let mut out = Vec::new();
    for i in along {
        // Grids that coincide must not fall to the neighbour by rounding.
        let at = (from + step * i as f64).map(|x| (x + 1e-6).round());
        if (0..3).all(|a| at[a] >= 0.0 && at[a] < size[a] as f64) {
            let voxel = [0, 1, 2].map(|a| at[a] as usize);
            if let Some(kind) = map.at(voxel) {
                out.push((grid.offset([i, j, k]), kind));
            }
        }
    }
    out
}

/// Adds the voxels that hold the centres of painted voxels of one kind, where nothing is said yet.
fn add_thin(
    grid: &Grid,
    map: &Map,
    Extent { first, last }: Extent,
    found: &mut Vec<(usize, SeedKind)>,
) {
    let mut thin: Vec<(usize, SeedKind)> = (first[2]..last[2] + 1)
        .into_par_iter()
        .flat_map_iter(|k| {
            let rows = (first[1]..last[1] + 1).map(move |j| (j, k));
            rows.flat_map(move |(j, k)| (first[0]..last[0] + 1).map(move |i| [i, j, k])).filter_map(
                |voxel| {
                    let kind = map.at(voxel)?;
                    let at = grid.voxel_at(&map.grid().centre(voxel))?;
                    Some((grid.offset(at), kind))
                },
            )
        })
        .collect();
    thin.sort_unstable();
    thin.dedup();
    found.sort_unstable();
    let told = |n: usize| found.binary_search_by_key(&n, |f| f.0).is_ok();
    let one_kind = |n: usize| {
        let same = |m: Option<&(usize, SeedKind)>| m.is_some_and(|m| m.0 == thin[n].0);
        !same(n.checked_sub(1).and_then(|n| thin.get(n))) && !same(thin.get(n + 1))
    };
    let more: Vec<_> =
        (0..thin.len()).filter(|&n| one_kind(n) && !told(thin[n].0)).map(|n| thin[n]).collect();
    found.extend(more);
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Matrix, Point};

    fn grid(size: [usize; 3], spacing: [f64; 3], origin: [f64; 3]) -> Grid {
        Grid::new(size, Vector::from(spacing), Point::from(origin), Matrix::identity()).unwrap()
    }

    #[test]
    fn a_cropped_map_finds_its_voxels() {
        let whole = grid([12, 10, 8], [0.7, 0.7, 2.5], [-166.0, -171.699_997, -340.0]);
        let part = whole.crop([3, 2, 1], [5, 4, 6]).unwrap();
        let map = Volume::from_fn(part.clone(), |[i, j, k]| {
            ((i + 2 * j + 3 * k) % 4 == 0).then_some(SeedKind::SoftTissue)
        });
        let mut got: Vec<usize> = on_grid(&whole, &map).into_iter().map(|v| v.0).collect();
        let mut want: Vec<usize> = (0..part.len())
            .map(|n| part.voxel(n))
            .filter(|&v| map.at(v).is_some())
            .map(|[i, j, k]| whole.offset([i + 3, j + 2, k + 1]))
            .collect();
        got.sort_unstable();
        want.sort_unstable();
        assert_eq!(got, want);
    }

    #[test]
    fn a_coarser_map_covers_every_voxel_and_a_finer_one_loses_no_stroke() {
        let ct = grid([20, 20, 6], [1.0, 1.0, 3.0], [0.0; 3]);
        let coarse = grid([5, 5, 3], [4.0, 4.0, 6.0], [1.5, 1.5, 1.5]);
        let all = on_grid(&ct, &Volume::from_fn(coarse, |_| Some(SeedKind::ChestWall)));
        assert_eq!(all.len(), ct.len());
        // A stroke one fine voxel thick between the centres of the CT's voxels.
        let fine = grid([80, 80, 6], [0.25, 0.25, 3.0], [-0.375, -0.375, 0.0]);
        let stroke =
            Volume::from_fn(fine, |[_, j, k]| (j == 19 && k == 2).then_some(SeedKind::Exclude));
        let got = on_grid(&ct, &stroke);
        assert_eq!(got.len(), 20, "{got:?}");
        let far = grid([4, 4, 4], [1.0; 3], [900.0; 3]);
        assert!(on_grid(&ct, &Volume::from_fn(far, |_| Some(SeedKind::Exclude))).is_empty());
    }
}

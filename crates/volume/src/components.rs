//! Connected components of a mask, by runs along the rows: a few bytes per run instead of per
//! voxel.

use crate::Volume;
use rayon::prelude::*;

/// A run of voxels along i.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Run {
    /// Place in memory of the first voxel.
    pub start: usize,
    /// Number of voxels.
    pub len: usize,
}

impl Run {
    /// Places in memory.
    pub fn voxels(self) -> std::ops::Range<usize> {
        self.start..self.start + self.len
    }

    /// The runs where `on` holds (place in memory) within some voxels of one row.
    pub fn within(voxels: std::ops::Range<usize>, on: impl Fn(usize) -> bool) -> Vec<Self> {
        let (mut runs, mut open) = (Vec::new(), None);
        let end = voxels.end;
        for n in voxels {
            match (on(n), open) {
                (true, None) => open = Some(n),
                (false, Some(from)) => {
                    runs.push(Self { start: from, len: n - from });
                    open = None;
                }
                _ => {}
            }
        }
        runs.extend(open.map(|from| Self { start: from, len: end - from }));
        runs
    }
}

/// The face-connected (6-neighbour) parts of a mask as runs.
#[derive(Clone, Debug)]
pub struct Parts {
    /// All runs in order of memory.
    pub runs: Vec<Run>,
    /// Part of each run, counted from 0 in order of first voxel.
    pub part: Vec<usize>,
    /// Voxels of each part.
    pub voxels: Vec<usize>,
}

impl Parts {
    /// The face-connected parts of the voxels where `on` holds (place in memory), in a volume of
    /// that size, i fastest in memory. The same for any number of threads.
    pub fn new(size: [usize; 3], on: impl Fn(usize) -> bool + Sync) -> Self {
        let plane = size[0] * size[1];
        Self::of_slices(size, |k, n| on(k * plane + n))
    }

    /// [`Self::new`] with `on(k, place within the slice k)`.
    pub fn of_slices(size: [usize; 3], on: impl Fn(usize, usize) -> bool + Sync) -> Self {
        let [ni, nj, nk] = size;
        let row = |row: usize| {
            let (k, first) = (row / nj, row % nj * ni);
            let runs = Run::within(first..first + ni, |n| on(k, n)).into_iter();
            runs.map(move |run| Run { start: run.start + k * ni * nj, ..run })
        };
        let runs = (0..nj * nk).into_par_iter().with_min_len(64).flat_map_iter(row).collect();
        Self::of_runs(size, runs)
    }

    /// The face-connected parts of runs in order of memory, each within one row.
    pub fn of_runs([ni, nj, nk]: [usize; 3], runs: Vec<Run>) -> Self {
        let mut first = Vec::with_capacity(nj * nk + 1);
        for row in 0..=nj * nk {
            let before = first.last().copied().unwrap_or(0);
            let here = runs[before..].iter().take_while(|run| run.start < row * ni).count();
            first.push(before + here);
        }
        let mut parent: Vec<usize> = (0..runs.len()).collect();
        for row in 0..nj * nk {
            if row % nj > 0 {
                join(&mut parent, &runs, &first, row, row - 1, ni);
            }
            if row >= nj {
                join(&mut parent, &runs, &first, row, row - nj, ni);
            }
        }
        let mut part = vec![usize::MAX; runs.len()];
        let mut voxels = Vec::new();
        for n in 0..runs.len() {
            let root = find(&mut parent, n);
            if part[root] == usize::MAX {
                part[root] = voxels.len();
                voxels.push(0);
            }
            part[n] = part[root];
            voxels[part[n]] += runs[n].len;
        }
        Self { runs, part, voxels }
    }

    /// The part with the most voxels, the first of equals.
    pub fn largest(&self) -> Option<usize> {
        (0..self.voxels.len()).max_by_key(|&n| (self.voxels[n], std::cmp::Reverse(n)))
    }

    /// Runs with their part.
    pub fn iter(&self) -> impl Iterator<Item = (Run, usize)> + '_ {
        self.runs.iter().copied().zip(self.part.iter().copied())
    }
}

/// The representative of a run, with the path to it halved.
fn find(parent: &mut [usize], mut n: usize) -> usize {
    while parent[n] != n {
        parent[n] = parent[parent[n]];
        n = parent[n];
    }
    n
}

/// Unites overlapping runs of two rows; the earlier one in memory represents both.
fn join(parent: &mut [usize], runs: &[Run], first: &[usize], a: usize, b: usize, ni: usize) {
    let (mut x, mut y) = (first[a], first[b]);
    while x < first[a + 1] && y < first[b + 1] {
        let (p, q) = (runs[x].start - a * ni, runs[y].start - b * ni);
        let (p_end, q_end) = (p + runs[x].len, q + runs[y].len);
        if p < q_end && q < p_end {
            let (s, t) = (find(parent, x), find(parent, y));
            parent[s.max(t)] = s.min(t);
        }
        if p_end < q_end { x += 1 } else { y += 1 }
    }
}

/// Face-connected components of a mask as a number per voxel.
#[derive(Clone, Debug)]
pub struct Components {
    /// Component of each voxel, counted from 1 in order of first voxel in memory; 0 outside.
    pub ids: Volume<u32>,
    /// Voxels of each component; entry 0 counts the outside.
    pub sizes: Vec<usize>,
}

impl Components {
    /// The component with the most voxels (the first of equals); `None` when the mask is empty.
    pub fn largest(&self) -> Option<u32> {
        let (id, _) = self
            .sizes
            .iter()
            .enumerate()
            .skip(1)
            .max_by_key(|&(id, &size)| (size, std::cmp::Reverse(id)))?;
        u32::try_from(id).ok()
    }

    /// The mask of one component.
    pub fn mask(&self, id: u32) -> Volume<bool> {
        self.ids.map(|&c| c == id)
    }
}

/// The face-connected (6-neighbour) components of `mask`.
pub fn components(mask: &Volume<bool>) -> Components {
    let grid = mask.grid();
    let parts = Parts::new(grid.size(), |n| mask.data()[n]);
    let mut ids = vec![0u32; grid.len()];
    for (run, part) in parts.iter() {
        ids[run.voxels()].fill(part as u32 + 1);
    }
    let outside = grid.len() - parts.voxels.iter().sum::<usize>();
    let sizes = std::iter::once(outside).chain(parts.voxels).collect();
    Components { ids: Volume::from_parts(grid.clone(), ids), sizes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};

    #[test]
    fn corners_do_not_connect_and_the_largest_is_found() {
        let g = Grid::new([4, 2, 1], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        // 1 0 1 1
        // 0 1 0 1
        let on = [true, false, true, true, false, true, false, true];
        let c = components(&Volume::new(g.unwrap(), on.to_vec()).unwrap());
        assert_eq!(c.sizes, vec![3, 1, 3, 1]);
        assert_eq!(c.largest(), Some(2));
        assert_eq!(c.mask(2).data().iter().filter(|&&m| m).count(), 3);
    }

    /// Against a flood from voxel to voxel.
    #[test]
    fn runs_give_what_a_flood_gives() {
        let g = Grid::new([9, 8, 7], Vector::repeat(1.0), Point::origin(), Matrix::identity());
        let g = g.unwrap();
        for (salt, dense) in [(1, 3), (2, 4), (3, 5), (4, 6)] {
            let mask = Volume::from_fn(g.clone(), |[i, j, k]| {
                (i * 7919 + j * 104_729 + k * 1_299_709 + salt * 15_485_863) / 13 % 10 < dense
            });
            let found = components(&mask);
            let mut ids = vec![0; g.len()];
            let mut sizes = vec![mask.data().iter().filter(|&&m| !m).count()];
            for seed in 0..g.len() {
                if !mask.data()[seed] || ids[seed] != 0 {
                    continue;
                }
                let id = sizes.len() as u32;
                sizes.push(0);
                let mut open = vec![g.voxel(seed)];
                while let Some(v) = open.pop() {
                    let n = g.offset(v);
                    if !mask.data()[n] || ids[n] != 0 {
                        continue;
                    }
                    ids[n] = id;
                    sizes[id as usize] += 1;
                    for a in 0..3 {
                        for step in [usize::MAX, 1] {
                            let mut w = v;
                            w[a] = w[a].wrapping_add(step);
                            open.extend((w[a] < g.size()[a]).then_some(w));
                        }
                    }
                }
            }
            assert!(sizes.len() > 4, "{salt}");
            assert_eq!((found.ids.data(), found.sizes), (&ids[..], sizes), "{salt}");
        }
    }
}

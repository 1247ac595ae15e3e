//! Connected parts of a mask, by runs along the rows: a few bytes per run instead of per voxel.

use rayon::prelude::*;

/// A run of voxels along i.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// Offset in memory of the first voxel.
    pub(crate) start: usize,
    /// Number of voxels.
    pub(crate) len: usize,
}

impl Run {
    /// Offsets in memory.
    pub(crate) fn voxels(self) -> std::ops::Range<usize> {
        self.start..self.start + self.len
    }
}

/// The face-connected parts of a mask.
#[derive(Debug)]
pub(crate) struct Parts {
    /// All runs in order of memory.
    pub(crate) runs: Vec<Run>,
    /// Part of each run, counted from 0 in order of first voxel.
    pub(crate) part: Vec<usize>,
    /// Voxels of each part.
    pub(crate) voxels: Vec<usize>,
}

impl Parts {
    /// The face-connected parts of the voxels where `on` holds (offset in memory).
    pub(crate) fn new(size: [usize; 3], on: impl Fn(usize) -> bool + Sync) -> Self {
        let [ni, nj, nk] = size;
        let rows: Vec<Vec<Run>> =
            (0..nj * nk).into_par_iter().map(|row| row_runs(row * ni, ni, &on)).collect();
        let mut first = Vec::with_capacity(rows.len() + 1);
        first.push(0);
        for row in &rows {
            first.push(first[first.len() - 1] + row.len());
        }
        let runs: Vec<Run> = rows.into_iter().flatten().collect();
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
    pub(crate) fn largest(&self) -> Option<usize> {
        (0..self.voxels.len()).max_by_key(|&n| (self.voxels[n], std::cmp::Reverse(n)))
    }

    /// Runs with their part.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (Run, usize)> + '_ {
        self.runs.iter().copied().zip(self.part.iter().copied())
    }
}

fn row_runs(start: usize, ni: usize, on: &(impl Fn(usize) -> bool + Sync)) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut open = None;
    for n in start..start + ni {
        match (on(n), open) {
            (true, None) => open = Some(n),
            (false, Some(from)) => {
                runs.push(Run { start: from, len: n - from });
                open = None;
            }
            _ => {}
        }
    }
    if let Some(from) = open {
        runs.push(Run { start: from, len: start + ni - from });
    }
    runs
}

fn find(parent: &mut [usize], mut n: usize) -> usize {
    while parent[n] != n {
        parent[n] = parent[parent[n]];
        n = parent[n];
    }
    n
}

/// Unites overlapping runs of two rows; the smaller index becomes the root.
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

#[cfg(test)]
mod tests {
    use super::*;
    use supine_space::{Grid, Matrix, Point, Vector};
    use supine_volume::{Volume, components};

    #[test]
    fn the_same_parts_as_a_flood_fill() {
        let size = [13, 11, 9];
        let g = Grid::new(size, Vector::repeat(1.0), Point::origin(), Matrix::identity()).unwrap();
        let mut state = 7u32;
        let mask = Volume::from_fn(g, |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 30 < 2
        });
        let flood = components(&mask);
        let parts = Parts::new(size, |n| mask.data()[n]);
        assert_eq!(parts.voxels.len() + 1, flood.sizes.len());
        assert!(parts.voxels.len() > 20);
        for (run, part) in parts.iter() {
            for n in run.voxels() {
                assert_eq!(flood.ids.data()[n] as usize, part + 1);
            }
        }
        assert_eq!(parts.voxels[..], flood.sizes[1..]);
    }
}

//! Connected components of a mask.

use crate::Volume;

/// Face-connected components of a mask.
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

/// Voxels of a mask that follow each other in a row of memory: from, until.
#[derive(Clone, Copy, Debug)]
struct Run {
    from: usize,
    until: usize,
}

/// The face-connected (6-neighbour) components of `mask`.
///
/// Runs along the rows are joined with those they touch in the rows before; a run's representative
/// is the earliest one in memory.
pub fn components(mask: &Volume<bool>) -> Components {
    let grid = mask.grid();
    let [ni, nj, nk] = grid.size();
    let (runs, rows) = runs(mask.data(), ni);
    let mut parent: Vec<u32> = (0..runs.len() as u32).collect();
    for row in 0..nj * nk {
        let before = [(row % nj > 0).then(|| row - 1), (row >= nj).then(|| row.wrapping_sub(nj))];
        for other in before.into_iter().flatten() {
            let shift = (row - other) * ni;
            join_rows(
                &runs,
                &mut parent,
                rows[row]..rows[row + 1],
                rows[other]..rows[other + 1],
                shift,
            );
        }
    }
    let mut ids = vec![0u32; grid.len()];
    let mut sizes = vec![0usize];
    let mut number = vec![0u32; runs.len()];
    for (n, run) in runs.iter().enumerate() {
        let root = find(&mut parent, n as u32) as usize;
        if root == n {
            number[n] = sizes.len() as u32;
            sizes.push(0);
        }
        let id = number[root];
        sizes[id as usize] += run.until - run.from;
        ids[run.from..run.until].fill(id);
    }
    sizes[0] = grid.len() - sizes.iter().sum::<usize>();
    Components { ids: Volume::from_parts(grid.clone(), ids), sizes }
}

/// The runs of a mask with rows of `ni` voxels, and the first run of each row (one more at the end).
fn runs(mask: &[bool], ni: usize) -> (Vec<Run>, Vec<usize>) {
    let mut runs = Vec::new();
    let mut rows = Vec::with_capacity(mask.len() / ni + 1);
    for (row, values) in mask.chunks(ni).enumerate() {
        rows.push(runs.len());
        let start = row * ni;
        let mut at = 0;
        while let Some(from) = values[at..].iter().position(|&m| m).map(|x| x + at) {
            at = values[from..].iter().position(|&m| !m).map_or(ni, |x| x + from);
            runs.push(Run { from: start + from, until: start + at });
        }
    }
    rows.push(runs.len());
    (runs, rows)
}

/// Joins the runs of a row with those of an earlier one, `shift` voxels before it, that they touch.
fn join_rows(
    runs: &[Run],
    parent: &mut [u32],
    here: std::ops::Range<usize>,
    there: std::ops::Range<usize>,
    shift: usize,
) {
    let (mut m, mut n) = (there.start, here.start);
    while m < there.end && n < here.end {
        let (other, run) = (runs[m], runs[n]);
        if other.from + shift < run.until && run.from < other.until + shift {
            let (a, b) = (find(parent, m as u32), find(parent, n as u32));
            parent[a.max(b) as usize] = a.min(b);
        }
        if other.until + shift < run.until { m += 1 } else { n += 1 }
    }
}

/// The representative of a run, with the path to it halved.
fn find(parent: &mut [u32], mut n: u32) -> u32 {
    while parent[n as usize] != n {
        parent[n as usize] = parent[parent[n as usize] as usize];
        n = parent[n as usize];
    }
    n
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

//! An order of tetrahedra in which neighbours follow each other, so that voxels near by are met
//! while they are in the cache.

use crate::predicate::Index;
use rayon::prelude::*;

/// Voxels along an edge of the cells within which the order does not matter.
const CELL: f64 = 8.0;
/// Cells that are told apart along each axis, as a power of two.
const BITS: u32 = 10;

/// Tetrahedra in that order, their vertices in the order in which they are met.
#[derive(Debug)]
pub(crate) struct Sorted {
    pub(crate) tets: Vec<[u32; 4]>,
    /// What each was before.
    pub(crate) ids: Vec<u32>,
    /// What each vertex was before.
    vertices: Vec<u32>,
}

impl Sorted {
    /// The first `count` of `tets` along a Morton curve through their centres, the others after
    /// them as they are.
    pub(crate) fn new(vertices: &[Index], tets: &[[u32; 4]], count: usize) -> Self {
        const NONE: u32 = u32::MAX;
        let mut ids = along_curve(vertices, &tets[..count]);
        ids.extend(count as u32..tets.len() as u32);
        let (mut met, mut numbers) =
            (Vec::with_capacity(vertices.len()), vec![NONE; vertices.len()]);
        let mut number = |vertex: u32| {
            let number = &mut numbers[vertex as usize];
            if *number == NONE {
                *number = met.len() as u32;
                met.push(vertex);
            }
            *number
        };
        let tets = ids.iter().map(|&tet| tets[tet as usize].map(&mut number)).collect();
        Self { tets, ids, vertices: met }
    }

    /// What belongs to vertices, in their order.
    pub(crate) fn of(&self, all: &[Index]) -> Vec<Index> {
        self.vertices.par_iter().with_min_len(4096).map(|&v| all[v as usize]).collect()
    }
}

/// `tets` along a Morton curve through their centres.
fn along_curve(vertices: &[Index], tets: &[[u32; 4]]) -> Vec<u32> {
    let place = |(tet, corners): (usize, &[u32; 4])| {
        let cell = [0, 1, 2].map(|a: usize| {
            let sum: f64 = corners.iter().map(|&v| vertices[v as usize][a]).sum();
            // Below 0 it is 0.
            ((0.25 / CELL * sum) as u32).min((1 << BITS) - 1)
        });
        (interleaved(cell), tet as u32)
    };
    let mut places: Vec<(u32, u32)> = tets.par_iter().enumerate().map(place).collect();
    places.par_sort_unstable();
    places.into_iter().map(|(_, tet)| tet).collect()
}

/// The bits of three numbers in turn.
fn interleaved(cell: [u32; 3]) -> u32 {
    let bit = |n: u32| (0..3).map(move |a| (cell[a as usize] >> n & 1) << (3 * n + a));
    (0..BITS).flat_map(bit).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_take_turns() {
        assert_eq!(interleaved([0b11, 0b01, 0b10]), 0b101_011);
        assert_eq!(interleaved([1023; 3]), (1 << 30) - 1);
    }

    #[test]
    fn neighbours_follow_each_other() {
        let corner =
            |x: f64, y: f64| [[x, y, 0.0], [x + 1.0, y, 0.0], [x, y + 1.0, 0.0], [x, y, 1.0]];
        let vertices: Vec<Index> =
            [(1.0, 1.0), (101.0, 101.0), (3.0, 2.0), (102.0, 99.0), (-9.0, 1.0)]
                .into_iter()
                .flat_map(|(x, y)| corner(x, y))
                .collect();
        let tets: Vec<[u32; 4]> = (0..5).map(|n| [0, 1, 2, 3].map(|c| 4 * n + c)).collect();
        assert_eq!(along_curve(&vertices, &tets), [0, 2, 4, 1, 3]);
        let sorted = Sorted::new(&vertices, &tets, 3);
        assert_eq!(sorted.ids, [0, 2, 1, 3, 4]);
        let places = sorted.of(&vertices);
        for (tet, id) in sorted.tets.iter().zip(&sorted.ids) {
            let (now, then) = (tet.map(|v| places[v as usize]), tets[*id as usize]);
            assert_eq!(now, then.map(|v| vertices[v as usize]));
        }
    }
}

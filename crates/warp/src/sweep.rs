//! The rows of one tetrahedron, eight at once, from where its faces cross them.

use crate::batch::Crossing;
use crate::kernel::{Ends, Kernel, LANES as ROWS};
use crate::rows::Span;
use std::ops::Range;

/// The box of a tetrahedron, as far as it lies in a slab.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    /// Its first voxel along i, j, k, within the slab.
    pub(crate) first: [usize; 3],
    /// Number of voxels along i, j, k, within the slab.
    pub(crate) count: [usize; 3],
    /// Slices of the box before the slab.
    pub(crate) before: usize,
}

impl Extent {
    /// Of the box that begins at `first` and has `count` voxels, in `slices`; `None` when it lies outside.
    #[inline(always)]
    pub(crate) fn new([first, count]: [[usize; 3]; 2], slices: &Range<usize>) -> Option<Self> {
        let (from, to) = (first[2].max(slices.start), (first[2] + count[2]).min(slices.end));
        (from < to).then(|| Self {
            first: [first[0], first[1], from],
            count: [count[0], count[1], to - from],
            before: from - first[2],
        })
    }

    /// Its rows j and slices k.
    pub(crate) fn rows(&self) -> Range<usize> {
        self.first[1]..self.first[1] + self.count[1]
    }

    pub(crate) fn slices(&self) -> Range<usize> {
        self.first[2]..self.first[2] + self.count[2]
    }
}

/// Adds the spans of the rows of `extent` to `spans`. Of blocks of rows in which a face passes too near to a
/// voxel centre, `unsure` is asked: rows j of slices k.
#[inline(always)]
pub(crate) fn sweep(
    kernel: Kernel,
    crossing: &Crossing,
    extent: &Extent,
    spans: &mut Vec<Span>,
    unsure: impl Fn(Range<usize>, Range<usize>, &mut Vec<Span>),
) {
    let Extent { first, count, before } = *extent;
    let [i, j, k] = [first[0] as u32, first[1] as u32, first[2] as u32];
    let mut ends = Ends::default();
    for slice in 0..count[2] {
        let z = (before + slice) as f32;
        let at = [at(&crossing.low, z), at(&crossing.high, z)];
        for row in (0..count[1]).step_by(ROWS) {
            let rows = ROWS.min(count[1] - row);
            if kernel.ends(crossing, &at, row as f32, &mut ends) {
                let mut some = ends.some & (u32::MAX >> (32 - rows));
                while some != 0 {
                    let r = some.trailing_zeros() as usize % ROWS;
                    let (from, to) = (i + ends.from[r], i + ends.to[r]);
                    spans.push(Span { j: j + (row + r) as u32, k: k + slice as u32, from, to });
                    some &= some - 1;
                }
            } else {
                let (j, k) = (first[1] + row, first[2] + slice);
                unsure(j..j + rows, k..k + 1, spans);
            }
        }
    }
}

/// Where faces cross the first row of slice z.
#[inline(always)]
fn at([constant, _, slope]: &[[f32; 4]; 3], z: f32) -> [f32; 4] {
    let mut at = *constant;
    for f in 0..4 {
        at[f] += z * slope[f];
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::predicate::Index;
    use crate::raster::{Raster, SLAB};
    use crate::rows::Rows;
    use proptest::prelude::*;

    /// Two slabs high.
    const SIZE: [usize; 3] = [21, 19, SLAB + 9];

    /// Corners anywhere, on voxel centres, nearly flat, or far beyond the grid.
    fn corners() -> impl Strategy<Value = [Index; 4]> {
        let free = prop::array::uniform4(prop::array::uniform3(-4.0..45.0f64));
        let whole = |all: [[i32; 3]; 4]| all.map(|c| c.map(f64::from));
        let centres = prop::array::uniform4(prop::array::uniform3(-2..42i32)).prop_map(whole);
        let flat = (prop::array::uniform4(prop::array::uniform2(0.0..20.0f64)), -1e-9..1e-9f64)
            .prop_map(|(all, up)| {
                let mut all = all.map(|[x, y]| [x, y, 7.0 + 0.25 * x]);
                all[0][2] += up;
                all
            });
        let far = prop::array::uniform4(prop::array::uniform3(-3e4..3e4f64));
        prop_oneof![free, centres, flat, far]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]
        #[test]
        fn spans_are_those_of_the_exact_rows(all in prop::collection::vec(corners(), 1..20)) {
            let vertices: Vec<Index> = all.iter().flatten().copied().collect();
            let tets: Vec<[u32; 4]> =
                (0..all.len() as u32).map(|n| [0, 1, 2, 3].map(|c| 4 * n + c)).collect();
            let raster = Raster::new(&vertices, &tets, SIZE);
            let mut found = vec![Vec::new(); all.len()];
            for slab in 0..SIZE[2].div_ceil(SLAB) {
                raster.scan(slab, &mut |tet: usize, spans: &[Span]| found[tet].extend_from_slice(spans));
            }
            for (corners, mut found) in all.into_iter().zip(found) {
                let mut exact = Vec::new();
                if let Some(rows) = Rows::new(corners, SIZE) {
                    let [_, (low_j, high_j), (low_k, high_k)] = rows.bounds;
                    for k in low_k..=high_k {
                        (low_j..=high_j).for_each(|j| rows.row(j, k, &mut exact));
                    }
                }
                found.sort_unstable_by_key(|s| (s.k, s.j));
                prop_assert_eq!(found, exact);
            }
        }
    }
}

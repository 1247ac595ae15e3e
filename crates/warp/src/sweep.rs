//! The rows of one tetrahedron within a slab, and what it owns of them.

use crate::rows::Span;
use std::ops::Range;
use supine_space::LANES;

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
    /// Of the box of a lane of `extents`, in `slices`; `None` when there is none or it lies
    /// outside.
    #[inline(always)]
    pub(crate) fn new(
        [first, count]: &[[[i32; LANES]; 3]; 2],
        lane: usize,
        slices: &Range<i32>,
    ) -> Option<Self> {
        let ([i, j, k], [ni, nj, nk]) = (first.map(|a| a[lane]), count.map(|a| a[lane]));
        let (from, to) = (k.max(slices.start), (k + nk).min(slices.end));
        (ni.min(nj).min(to - from) > 0).then(|| Self {
            first: [i, j, from].map(|n| n as usize),
            count: [ni, nj, to - from].map(|n| n as usize),
            before: (from - k) as usize,
        })
    }

    /// Its rows (j, k).
    pub(crate) fn rows(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Self { first, count, .. } = *self;
        let rows = (0..count[2]).flat_map(move |k| (0..count[1]).map(move |j| [j, k]));
        rows.map(move |[j, k]| [(first[1] + j) as u32, (first[2] + k) as u32])
    }
}

/// What the rows of a tetrahedron own.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Swept {
    /// Spans, at most one of each row.
    pub(crate) spans: Vec<Span>,
    /// Rows (j, k) in which a face passes so near to a voxel centre that only exact signs tell.
    pub(crate) unsure: Vec<[u32; 2]>,
}

impl Swept {
    /// Forgets all.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.spans.clear();
        self.unsure.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::{Batch, gathered};
    use crate::kernel::Kernel;
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

        #[test]
        fn every_kernel_sweeps_alike(corners in corners()) {
            let batch = Batch::new(gathered(&corners, &[[0, 1, 2, 3]], &[0; LANES]), SIZE);
            let (crossings, all) = (batch.crossings(), batch.extents());
            if !crossings.known(0) {
                return Ok(());
            }
            let slabs = (0..SIZE[2]).step_by(SLAB).map(|from| from as i32..(from + SLAB).min(SIZE[2]) as i32);
            for extent in slabs.filter_map(|slices| Extent::new(&all, 0, &slices)) {
                let mut plain = Swept::default();
                Kernel::Scalar.sweep(&crossings, 0, &extent, &mut plain);
                for kernel in Kernel::all() {
                    let mut swept = Swept::default();
                    kernel.sweep(&crossings, 0, &extent, &mut swept);
                    prop_assert_eq!(&swept, &plain);
                }
            }
        }
    }
}

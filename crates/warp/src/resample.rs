//! The CT carried by a map: the scalar kernel, in f64, against which others are to be held.

use crate::map::Map;
use crate::pullback::{Pullback, to_hu, trilinear};
use crate::raster::{Raster, SLAB, Span};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Stopped};

/// What is known of a voxel while its slab is worked on.
mod flag {
    /// Within the mesh or the collar in the CT.
    pub(super) const REST: u8 = 1;
    /// Within the deformed mesh.
    pub(super) const MESH: u8 = 2;
    /// Within the deformed mesh more than once.
    pub(super) const FOLDED: u8 = 4;
    /// Within the deformed collar alone.
    pub(super) const COLLAR: u8 = 8;
}

/// How many voxels were what.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counts {
    /// Sampled through the mesh.
    pub(crate) mesh: usize,
    /// Sampled through the collar.
    pub(crate) collar: usize,
    /// Turned to air.
    pub(crate) vacated: usize,
    /// Claimed by more than one tetrahedron of the mesh.
    pub(crate) folded: usize,
}

impl std::ops::Add for Counts {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            mesh: self.mesh + other.mesh,
            collar: self.collar + other.collar,
            vacated: self.vacated + other.vacated,
            folded: self.folded + other.folded,
        }
    }
}

/// The fixed part of a resampling.
#[derive(Debug)]
pub(crate) struct Resampling<'a> {
    pub(crate) map: &'a Map,
    pub(crate) source: &'a [i16],
    pub(crate) size: [usize; 3],
    pub(crate) air_hu: i16,
    /// Voxels of the CT at or above this, outside mesh and collar, are not the collar's to change.
    pub(crate) body_hu: i16,
}

impl Resampling<'_> {
    /// Changes `out`, a copy of the source (i fastest), and says what happened.
    pub(crate) fn run(&self, out: &mut [i16], progress: Progress<'_>) -> Result<Counts, Stopped> {
        let rest = Raster::new(&self.map.rest, &self.map.tets, self.size);
        let deformed = Raster::new(&self.map.deformed, &self.map.tets, self.size);
        let [ni, nj, nk] = self.size;
        let slabs = nk.div_ceil(SLAB);
        let done = AtomicUsize::new(0);
        let counts: Result<Vec<Counts>, Stopped> = out
            .par_chunks_mut(ni * nj * SLAB)
            .enumerate()
            .map(|(slab, out)| {
                let counts = self.slab(slab, &rest, &deformed, out);
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.at(done as f64 / slabs as f64)?;
                Ok(counts)
            })
            .collect();
        Ok(counts?.into_iter().fold(Counts::default(), |a, b| a + b))
    }

    fn slab(
        &self,
        slab: usize,
        rest: &Raster<'_>,
        deformed: &Raster<'_>,
        out: &mut [i16],
    ) -> Counts {
        if rest.is_empty(slab) && deformed.is_empty(slab) {
            return Counts::default();
        }
        let [ni, nj, _] = self.size;
        let row = |span: &Span| ((span.k - slab * SLAB) * nj + span.j) * ni;
        let mut flags = vec![0u8; out.len()];
        rest.scan(slab, |span| {
            let start = row(&span);
            flags[start + span.from..start + span.to].iter_mut().for_each(|f| *f |= flag::REST);
        });
        let mut current: Option<(usize, Pullback)> = None;
        deformed.scan(slab, |span| {
            let pullback = match current {
                Some((tet, pullback)) if tet == span.tet => pullback,
                _ => Pullback::new(deformed.corners(span.tet), rest.corners(span.tet)),
            };
            current = Some((span.tet, pullback));
            let mesh = span.tet < self.map.collar_from;
            let start = row(&span);
            for i in span.from..span.to {
                let n = start + i;
                if mesh {
                    let again = flags[n] & flag::MESH != 0;
                    flags[n] |= flag::MESH | if again { flag::FOLDED } else { 0 };
                } else if flags[n] & flag::REST != 0 || out[n] < self.body_hu {
                    flags[n] |= flag::COLLAR;
                } else {
                    continue;
                }
                let q = pullback.at([i as f64, span.j as f64, span.k as f64]);
                out[n] = to_hu(trilinear(self.source, self.size, q));
            }
        });
        let mut counts = Counts::default();
        for (value, flags) in out.iter_mut().zip(flags) {
            counts.folded += usize::from(flags & flag::FOLDED != 0);
            if flags & flag::MESH != 0 {
                counts.mesh += 1;
            } else if flags & flag::COLLAR != 0 {
                counts.collar += 1;
            } else if flags & flag::REST != 0 {
                *value = self.air_hu;
                counts.vacated += 1;
            }
        }
        counts
    }
}

//! The CT carried by a map.

use crate::coverage::Coverage;
use crate::filter::{self, Interpolation};
use crate::kernel::{Kernel, LANES, Local, Place, Source, prefetch};
use crate::map::Map;
use crate::predicate::Index;
use crate::pullback::Pullback;
use crate::raster::{Paint, Raster, SLAB};
use crate::rows::Span;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Stopped};

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

/// For each length of a short span, the bits of the voxels that are not in it.
const KEEP: [[i16; LANES]; LANES + 1] = {
    let mut keep = [[-1; LANES]; LANES + 1];
    let mut length = 0;
    while length <= LANES {
        let mut n = 0;
        while n < length {
            keep[length][n] = 0;
            n += 1;
        }
        length += 1;
    }
    keep
};

/// The fixed part of a resampling: a volume, and the shape in it that is carried.
#[derive(Debug)]
pub(crate) struct Resampling<'a> {
    source: Source<'a>,
    /// Voxels of the volume that is made.
    size: [usize; 3],
    rules: Rules,
    /// What is within mesh or collar in the CT, slab by slab.
    before: Vec<Coverage>,
}

/// What is done with voxels, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rules {
    /// Value of voxels that the tissue left.
    pub(crate) air_hu: i16,
    /// Voxels of the CT at or above this, outside mesh and collar, are not the collar's to change.
    pub(crate) body_hu: i16,
    pub(crate) kernel: Kernel,
    pub(crate) interpolation: Interpolation,
    /// Below this det F voxels are averages.
    pub(crate) supersample_below: f64,
}

/// What was written in each slab, and what it was.
pub(crate) type Written = (Vec<Coverage>, Counts);

impl<'a> Resampling<'a> {
    /// Of `source`, into volumes of `size` voxels, through maps that have the CT side of `map`.
    pub(crate) fn new(source: Source<'a>, size: [usize; 3], map: &Map, rules: Rules) -> Self {
        let raster = Raster::new(&map.before, &map.tets, size);
        let before = (0..size[2].div_ceil(SLAB)).into_par_iter().map(|slab| {
            let mut coverage = Coverage::new(raster.window(slab));
            raster.scan(slab, &mut |_, spans: &[Span]| {
                for span in spans {
                    coverage.mark(span);
                }
            });
            coverage
        });
        Self { source, size, rules, before: before.collect() }
    }

    /// Changes `out`, which holds the CT undeformed (i fastest), and says what happened.
    pub(crate) fn run(
        &self,
        map: &Map,
        out: &mut [i16],
        progress: Progress<'_>,
    ) -> Result<Written, Stopped> {
        let deformed = Raster::new(&map.deformed, &map.tets, self.size);
        let [ni, nj, _] = self.size;
        let slabs = self.before.len();
        let done = AtomicUsize::new(0);
        let written: Result<Vec<_>, Stopped> = out
            .par_chunks_mut(ni * nj * SLAB)
            .enumerate()
            .map(|(slab, out)| {
                let written = self.slab(slab, map, &deformed, out);
                let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                progress.at(done as f64 / slabs as f64)?;
                Ok(written)
            })
            .collect();
        let (written, counts): (Vec<_>, Vec<Counts>) = written?.into_iter().unzip();
        Ok((written, counts.into_iter().fold(Counts::default(), |a, b| a + b)))
    }

    fn slab(
        &self,
        slab: usize,
        map: &Map,
        deformed: &Raster<'_>,
        out: &mut [i16],
    ) -> (Coverage, Counts) {
        let before = &self.before[slab];
        let window = deformed.window(slab).with(before.window());
        let none = Coverage::new(window);
        if window.is_empty() {
            return (none, Counts::default());
        }
        let mut brush = Brush {
            resampling: self,
            map,
            first: slab * SLAB,
            before: before.within(window),
            mesh: none.clone(),
            collar: none,
            folded: None,
            out,
            strokes: Vec::new(),
            places: Vec::new(),
            values: Vec::new(),
            counts: Counts::default(),
        };
        deformed.scan(slab, &mut brush);
        brush.finish()
    }
}

/// Samples what is owned, slab by slab; each voxel once.
struct Brush<'a> {
    resampling: &'a Resampling<'a>,
    map: &'a Map,
    /// First slice of the slab.
    first: usize,
    /// Within mesh or collar in the CT.
    before: Coverage,
    /// Sampled through the mesh, and through the collar.
    mesh: Coverage,
    collar: Coverage,
    /// Claimed more than once.
    folded: Option<Coverage>,
    out: &'a mut [i16],
    /// Of one tetrahedron: the spans to be written, the voxels in them and their values.
    strokes: Vec<Span>,
    places: Vec<Place>,
    values: Vec<i16>,
    counts: Counts,
}

impl Paint for Brush<'_> {
    #[inline(always)]
    fn paint(&mut self, tet: usize, spans: &[Span]) {
        self.strokes.clear();
        if tet < self.map.collar_from {
            self.take_mesh(spans);
        } else {
            self.take_collar(spans);
        }
        if !self.strokes.is_empty() {
            self.sample(tet);
            self.write();
        }
    }
}

impl Brush<'_> {
    /// Takes the voxels that no tetrahedron before has.
    #[inline(always)]
    fn take_mesh(&mut self, spans: &[Span]) {
        for span in spans {
            if self.mesh.take(span) {
                self.counts.mesh += (span.to - span.from) as usize;
                prefetch(&self.out[self.at(span)..]);
                self.strokes.push(*span);
            } else {
                self.take_folded(span);
            }
        }
    }

    #[cold]
    fn take_folded(&mut self, span: &Span) {
        for one in span.voxels() {
            if self.mesh.mark(&one) == 0 {
                self.counts.mesh += 1;
                self.strokes.push(one);
            } else {
                let folded = self.folded.get_or_insert_with(|| self.mesh.none());
                self.counts.folded += 1 - folded.mark(&one);
            }
        }
    }

    /// Takes voxels outside the deformed mesh, unless they hold other tissue.
    fn take_collar(&mut self, spans: &[Span]) {
        for span in spans {
            for one in span.voxels() {
                let own = self.before.marked(&one) > 0;
                let free = own || self.out[self.at(&one)] < self.resampling.rules.body_hu;
                if free && self.mesh.marked(&one) == 0 && self.collar.mark(&one) == 0 {
                    self.counts.collar += 1;
                    self.strokes.push(one);
                }
            }
        }
    }

    /// Samples all voxels of the strokes.
    #[inline(always)]
    fn sample(&mut self, tet: usize) {
        let origin = self
            .strokes
            .iter()
            .fold([u32::MAX; 3], |o, s| [o[0].min(s.from), o[1].min(s.j), o[2].min(s.k)]);
        let count: usize = self.strokes.iter().map(|s| (s.to - s.from) as usize).sum();
        let whole = count.next_multiple_of(LANES);
        if self.places.len() < whole + LANES {
            self.places.resize(whole + LANES, Place::default());
            self.values.resize(whole + LANES, 0);
        }
        let mut at = 0;
        for span in &self.strokes {
            let first = Place::new([span.from - origin[0], span.j - origin[1], span.k - origin[2]]);
            for n in (0..span.to - span.from).step_by(LANES) {
                let places = &mut self.places[at + n as usize..][..LANES];
                for (place, lane) in places.iter_mut().zip(0..) {
                    *place = first.beside(n + lane);
                }
            }
            at += (span.to - span.from) as usize;
        }
        let (source, rules) = (&self.resampling.source, &self.resampling.rules);
        let [a, b, c, d] = self.map.tets[tet].map(|v| v as usize);
        let corners = |of: &[Index]| [of[a], of[b], of[c], of[d]];
        let pullback = Pullback::new(corners(&self.map.deformed), corners(&self.map.rest));
        // Beside the skin is air, and nothing to be averaged.
        let below = if tet < self.map.collar_from { rules.supersample_below } else { 0.0 };
        let samples = if below > 0.0 { filter::samples(pullback.det(), below) } else { 1 };
        if samples > 1 || rules.interpolation != Interpolation::Linear {
            return self.filter(&pullback, samples);
        }
        let local = Local::new(&pullback, origin, source);
        let (places, values) = (&self.places[..whole], &mut self.values[..whole]);
        rules.kernel.sample(source, &local, places, values);
    }

    /// Samples all voxels of the strokes one by one: `samples`³ values in each.
    #[cold]
    #[inline(never)]
    fn filter(&mut self, pullback: &Pullback, samples: usize) {
        let Resampling { source, rules, .. } = self.resampling;
        let voxels = self.strokes.iter().flat_map(Span::voxels);
        for (value, voxel) in self.values.iter_mut().zip(voxels) {
            let p = [voxel.from, voxel.j, voxel.k].map(f64::from);
            *value = filter::mean(source, rules.interpolation, pullback, p, samples);
        }
    }

    /// Writes the values to where the strokes are.
    #[inline(always)]
    fn write(&mut self) {
        let [ni, nj, _] = self.resampling.size;
        let mut values = &self.values[..];
        for span in &self.strokes {
            let length = (span.to - span.from) as usize;
            let at =
                ((span.k as usize - self.first) * nj + span.j as usize) * ni + span.from as usize;
            let out = &mut self.out[at..];
            match (out.first_chunk_mut::<LANES>(), values.first_chunk::<LANES>()) {
                // Short ones are written over what is there, all at once.
                (Some(out), Some(new)) if length <= LANES => {
                    let (old, keep) = (*out, KEEP[length]);
                    *out = std::array::from_fn(|n| new[n] & !keep[n] | old[n] & keep[n]);
                }
                _ => out[..length].copy_from_slice(&values[..length]),
            }
            values = &values[length..];
        }
    }

    /// Turns to air what the tissue left, and says what was written.
    fn finish(self) -> (Coverage, Counts) {
        let Self { before, mut mesh, collar, out, mut counts, first, resampling, .. } = self;
        mesh.add(&collar);
        let [ni, nj, _] = resampling.size;
        let air = resampling.rules.air_hu;
        counts.vacated =
            before.each_without(&mesh, |[i, j, k]| out[((k - first) * nj + j) * ni + i] = air);
        mesh.add(&before);
        (mesh, counts)
    }

    /// Where a span begins in the slab.
    #[inline(always)]
    fn at(&self, span: &Span) -> usize {
        let [ni, nj, _] = self.resampling.size;
        ((span.k as usize - self.first) * nj + span.j as usize) * ni + span.from as usize
    }
}

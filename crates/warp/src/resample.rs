//! The CT carried by a map.

use crate::batch::{Batch, gathered};
use crate::coverage::Coverage;
use crate::filter::{self, Interpolation};
use crate::kernel::{LANES, Locals, Near, Place, Source, Spots, prefetch, reach};
use crate::map::Map;
use crate::order::Sorted;
use crate::predicate::Index;
use crate::pullback::Pullback;
use crate::raster::{Item, Paint, Raster, SLAB};
use crate::rows::Span;
use crate::rules::{Counts, Rules};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use supine_space::{Progress, Stopped};

/// The fixed part of a resampling: the shape that is carried in a volume.
#[derive(Debug)]
pub(crate) struct Resampling {
    /// What of the volume is read.
    near: Option<Near>,
    /// Voxels of the volume that is made.
    size: [usize; 3],
    rules: Rules,
    /// What is within mesh or collar in the CT, slab by slab.
    before: Vec<Coverage>,
    /// The tetrahedra in the order in which they are worked on, those of the collar last, from this
    /// one on.
    sorted: Sorted,
    collar_from: usize,
    /// Their vertices in the CT, as its indices.
    rest: Vec<Index>,
}

/// Where the vertices are after deformation, and the tetrahedra there.
#[derive(Clone, Copy)]
struct Moved<'a> {
    deformed: &'a [Index],
    raster: &'a Raster<'a>,
    /// Which of them matter; all where that is not said.
    seen: Option<&'a [bool]>,
}

/// What was written in each slab, and what it was.
pub(crate) type Written = (Vec<Coverage>, Counts);

impl Resampling {
    /// Of `source`, into volumes of `size` voxels, through maps that have the CT side of `map`.
    pub(crate) fn new(source: &Source<'_>, size: [usize; 3], map: &Map, rules: Rules) -> Self {
        let raster = Raster::new(&map.before, &map.tets, size);
        let before = (0..size[2].div_ceil(SLAB)).into_par_iter().map(|slab| {
            let mut coverage = Coverage::new(raster.window(slab));
            raster.scan(slab, &mut |tet: usize, spans: &[Span]| {
                if map.stays.as_ref().is_some_and(|stays| stays[tet]) {
                    return;
                }
                for span in spans {
                    coverage.mark(span);
                }
            });
            coverage
        });
        let before = before.collect();
        let sorted = Sorted::new(&map.before, &map.tets, map.collar_from);
        let rest = sorted.of(&map.rest);
        let wide = usize::from(rules.interpolation == Interpolation::Cubic);
        let near = Near::new(source, reach(&rest, source.size(), wide));
        Self { near, size, rules, before, sorted, collar_from: map.collar_from, rest }
    }

    /// Changes `out`, which holds the CT undeformed (i fastest), and says what happened; `source`
    /// is the volume that this was made for.
    pub(crate) fn run(
        &self,
        source: Source<'_>,
        map: &Map,
        out: &mut [i16],
        progress: Progress<'_>,
    ) -> Result<Written, Stopped> {
        self.run_seen(source, (map, None), out, progress)
    }

    /// The same where only planes of the grid are seen (axis, number): elsewhere `out` then holds
    /// nothing of use.
    pub(crate) fn run_seen(
        &self,
        source: Source<'_>,
        (map, planes): (&Map, Option<&[(usize, usize)]>),
        out: &mut [i16],
        progress: Progress<'_>,
    ) -> Result<Written, Stopped> {
        let deformed = self.sorted.of(&map.deformed);
        let raster = Raster::new(&deformed, &self.sorted.tets, self.size);
        let seen = planes.map(|planes| touching(&deformed, &self.sorted.tets, planes));
        let seen = seen.as_deref();
        let [ni, nj, _] = self.size;
        let slabs = self.before.len();
        let done = AtomicUsize::new(0);
        let written: Result<Vec<_>, Stopped> = out
            .par_chunks_mut(ni * nj * SLAB)
            .enumerate()
            .map(|(slab, out)| {
                let moved = Moved { deformed: &deformed, raster: &raster, seen };
                let written = self.slab(source, slab, moved, out);
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
        source: Source<'_>,
        slab: usize,
        moved: Moved<'_>,
        out: &mut [i16],
    ) -> (Coverage, Counts) {
        let Moved { deformed, raster, seen } = moved;
        let before = &self.before[slab];
        let window = raster.window(slab).with(before.window());
        let none = Coverage::new(window);
        if window.is_empty() {
            return (none, Counts::default());
        }
        let mut brush = Brush {
            resampling: self,
            whole: source,
            source: self.near.as_ref().map_or(source, Near::source),
            deformed,
            first: slab * SLAB,
            before: before.within(window),
            mesh: none.clone(),
            collar: none,
            met: false,
            folded: None,
            out,
            locals: None,
            item: Item::default(),
            strokes: Vec::new(),
            spots: Spots::default(),
            values: Vec::new(),
            voxels: 0,
            places: Vec::new(),
            counts: Counts::default(),
        };
        let members = raster.members(slab);
        let some: Option<Vec<u32>> =
            seen.map(|seen| members.iter().copied().filter(|&t| seen[t as usize]).collect());
        let members = some.as_deref().unwrap_or(members);
        let collar = members.partition_point(|&tet| (tet as usize) < self.collar_from);
        let (mesh, collar) = members.split_at(collar);
        raster.scan_those(mesh, slab, &mut brush);
        if brush.met {
            // The lowest is to own; they came in another order.
            let mut mesh = mesh.to_vec();
            mesh.sort_unstable_by_key(|&tet| self.sorted.ids[tet as usize]);
            (brush.mesh, brush.folded) = (brush.mesh.none(), Some(brush.mesh.none()));
            brush.counts = Counts::default();
            raster.scan_those(&mesh, slab, &mut brush);
        }
        raster.scan_those(collar, slab, &mut brush);
        brush.finish()
    }
}

/// Whether each tetrahedron touches one of some planes of the grid.
fn touching(vertices: &[Index], tets: &[[u32; 4]], planes: &[(usize, usize)]) -> Vec<bool> {
    let touches = |tet: &[u32; 4]| {
        planes.iter().any(|&(axis, n)| {
            let at = tet.map(|v| vertices[v as usize][axis]);
            let (low, high) =
                at.iter().fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
            low <= n as f64 && n as f64 <= high
        })
    };
    tets.par_iter().map(touches).collect()
}

/// Samples what is owned, slab by slab; each voxel once.
struct Brush<'a> {
    resampling: &'a Resampling,
    /// The volume that is sampled, and the part of it that is read.
    whole: Source<'a>,
    source: Source<'a>,
    /// Vertices after deformation, as indices of the volume that is made.
    deformed: &'a [Index],
    /// First slice of the slab.
    first: usize,
    /// Within mesh or collar in the CT.
    before: Coverage,
    /// Sampled through the mesh, and through the collar.
    mesh: Coverage,
    collar: Coverage,
    /// Whether a voxel was claimed again.
    met: bool,
    /// Claimed more than once; while `None`, this is not looked at voxel by voxel.
    folded: Option<Coverage>,
    out: &'a mut [i16],
    /// The maps of the tetrahedra that are looked at, and the one that is worked on.
    locals: Option<Locals>,
    item: Item,
    /// Of the tetrahedra that are looked at: what is to be written, where its voxels lie in the CT,
    /// their values and their number.
    strokes: Vec<Stroke>,
    spots: Spots,
    values: Vec<i16>,
    voxels: usize,
    /// Of one tetrahedron: the voxels.
    places: Vec<Place>,
    counts: Counts,
}

/// Voxels in a row of a slab, that are to be written.
#[derive(Clone, Copy)]
struct Stroke {
    /// The first of them, within the slab.
    at: u32,
    length: u32,
    /// The first, in the box of its tetrahedron.
    place: Place,
}

impl Stroke {
    /// Its voxels, within the slab.
    #[inline(always)]
    fn range(&self) -> Range<usize> {
        self.at as usize..self.at as usize + self.length as usize
    }
}

impl Paint for Brush<'_> {
    #[inline(always)]
    fn next(&mut self, tets: &[u32; LANES], batch: &Batch, slices: &Range<usize>) {
        let rest = gathered(&self.resampling.rest, &self.resampling.sorted.tets, tets);
        self.locals = Some(Locals::new(batch, rest, slices.start, &self.source));
    }

    #[inline(always)]
    fn paint(&mut self, item: Item, spans: &[Span]) {
        self.item = item;
        let (strokes, before) = (self.strokes.len(), self.voxels);
        if item.tet < self.resampling.collar_from {
            self.take_mesh(spans);
            self.counts.mesh += self.voxels - before;
        } else {
            self.take_collar(spans);
            self.counts.collar += self.voxels - before;
        }
        if self.voxels > before {
            self.locate(strokes, before);
        }
    }

    #[inline(always)]
    fn done(&mut self) {
        let whole = self.voxels.next_multiple_of(LANES);
        if self.values.len() < whole + LANES {
            self.values.resize(2 * whole + LANES, 0);
        }
        let Rules { kernel, interpolation, .. } = self.resampling.rules;
        let values = &mut self.values[..whole];
        match interpolation {
            Interpolation::Cubic => kernel.cubic(&self.source, &self.spots, values),
            _ => kernel.blend(&self.source, &self.spots, values),
        }
        self.write();
        self.strokes.clear();
        self.spots.clear();
        self.voxels = 0;
    }
}

impl Brush<'_> {
    /// Takes the voxels of the mesh: all of them at first, and if it turns out that some are
    /// claimed again, those that no tetrahedron before has.
    #[inline(always)]
    fn take_mesh(&mut self, spans: &[Span]) {
        if self.folded.is_some() {
            return self.take_folded(spans);
        }
        self.met |= self.mesh.mark_all(spans);
        self.strokes(spans);
    }

    #[cold]
    fn take_folded(&mut self, spans: &[Span]) {
        for one in spans.iter().flat_map(Span::voxels) {
            if self.mesh.mark(&one) == 0 {
                self.strokes(&[one]);
            } else if let Some(folded) = &mut self.folded {
                self.counts.folded += 1 - folded.mark(&one);
            }
        }
    }

    /// Takes voxels outside the deformed mesh, unless they hold other tissue.
    fn take_collar(&mut self, spans: &[Span]) {
        for one in spans.iter().flat_map(Span::voxels) {
            let own = self.before.marked(&one) > 0;
            let free = own || self.out[self.at(&one)] < self.resampling.rules.body_hu;
            if free && self.mesh.marked(&one) == 0 && self.collar.mark(&one) == 0 {
                self.strokes(&[one]);
            }
        }
    }

    /// Adds what is to be written.
    #[inline(always)]
    fn strokes(&mut self, spans: &[Span]) {
        let ([ni, nj, _], first) = (self.resampling.size.map(|n| n as u32), self.first as u32);
        let [i, j, k] = self.item.first;
        let mut voxels = 0;
        self.strokes.extend(spans.iter().map(|span| {
            let at = ((span.k - first) * nj + span.j) * ni + span.from;
            let length = span.to - span.from;
            voxels += length;
            Stroke { at, length, place: Place::new([span.from - i, span.j - j, span.k - k]) }
        }));
        self.voxels += voxels as usize;
    }

    /// Finds in the CT what belongs to the strokes from number `first` on, whose voxels begin at
    /// number `before`.
    #[inline(always)]
    fn locate(&mut self, first: usize, before: usize) {
        let Some(locals) = &self.locals else { return };
        let rules = &self.resampling.rules;
        // Beside the skin is air, and nothing to be averaged.
        let tissue = self.item.tet < self.resampling.collar_from;
        let below = if tissue { rules.supersample_below } else { 0.0 };
        let det = locals.det(self.item.lane);
        let samples = if below > 0.0 { filter::samples(det, below) } else { 1 };
        let cubic = rules.interpolation == Interpolation::Cubic;
        if samples > 1 || rules.interpolation == Interpolation::Lanczos3 {
            return self.filter(samples, first, before);
        }
        let count = self.voxels - before;
        let whole = count.next_multiple_of(LANES);
        if self.places.len() < whole + LANES {
            self.places.resize(2 * whole + LANES, Place::default());
        }
        if self.spots.len() < before + whole + LANES {
            self.spots.grow(2 * (before + whole + LANES));
        }
        let mut at = 0;
        for stroke in &self.strokes[first..] {
            let (own, places) = (stroke.range(), &mut self.places[at..]);
            prefetch(&self.out[own.start..]);
            stroke.place.row(0, places);
            for n in (LANES..own.len()).step_by(LANES) {
                stroke.place.row(n as u32, &mut places[n..]);
            }
            at += own.len();
        }
        let spots = self.spots.some(before, whole);
        rules.kernel.locate(locals, self.item.lane, &self.places[..whole], spots);
        if cubic && !locals.within(self.item.lane, &self.source) {
            self.spots.near_edges(before..self.voxels);
        }
        let mut at = before;
        for stroke in &self.strokes[first..] {
            self.spots.prefetch(at, &self.source);
            at += stroke.length as usize;
        }
    }

    /// Writes the strokes from number `first` on, whose voxels begin at number `before`, and
    /// forgets them: the mean of `samples`³ values in each voxel.
    #[cold]
    #[inline(never)]
    fn filter(&mut self, samples: usize, first: usize, before: usize) {
        let Resampling { rules, sorted, rest, .. } = self.resampling;
        let Item { tet, first: origin, .. } = self.item;
        let tet = sorted.tets[tet].map(|v| v as usize);
        let corners = |of: &[Index]| tet.map(|v| of[v]);
        let pullback = Pullback::new(corners(self.deformed), corners(rest));
        for stroke in self.strokes.drain(first..) {
            let [i, j, k] = stroke.place.indices();
            let p = [origin[0] + i, origin[1] + j, origin[2] + k].map(f64::from);
            for (n, value) in self.out[stroke.range()].iter_mut().enumerate() {
                let p = [p[0] + n as f64, p[1], p[2]];
                *value = filter::mean(&self.whole, rules.interpolation, &pullback, p, samples);
            }
        }
        self.voxels = before;
    }

    /// Writes the values to where the strokes are.
    #[inline(always)]
    fn write(&mut self) {
        let mut values = &self.values[..];
        for stroke in &self.strokes {
            let length = stroke.length as usize;
            let (out, new) = (&mut self.out[stroke.range()], &values[..length]);
            // A few numbers of the same size each: to change more and keep the rest would wait for
            // what was written just before.
            match length {
                0..4 => [0, length / 2, length - 1].into_iter().for_each(|n| out[n] = new[n]),
                4..8 => [0, length - 4]
                    .into_iter()
                    .for_each(|n| out[n..n + 4].copy_from_slice(&new[n..n + 4])),
                _ => out.copy_from_slice(new),
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

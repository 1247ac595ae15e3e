//! Surfaces to labels, and labels to surfaces known between the voxels.

use crate::body::flag;
use crate::frame::Frame;
use crate::levels::Levels;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use rayon::prelude::*;
use std::ops::Range;
use supine_volume::{LabelMap, SignedDistance, Surfaces, label};

/// Distances to the surfaces are told this far, mm. Chosen, not measured.
const BAND_MM: f64 = 5.0;

/// Side of a tile, pixels: few are crossed by the surface, and few are to be looked at. Chosen, not
/// measured.
const TILE: usize = 8;
/// More than what rounding takes from a radius, mm.
const ROUNDING_MM: f32 = 0.01;

/// A square of pixels of a slice.
struct Tile {
    i: Range<usize>,
    j: Range<usize>,
    /// Its middle, mm, and the distance of the farthest centre of a pixel from it, mm.
    middle: [f32; 2],
    half_mm: f32,
}

/// The tiles of a slice.
fn tiles(frame: &Frame) -> impl Iterator<Item = Tile> {
    let Frame { size: [ni, nj, _], spacing: [si, sj, _], .. } = *frame;
    let tile = move |i0: usize, j0: usize| {
        let (i, j) = (i0..(i0 + TILE).min(ni), j0..(j0 + TILE).min(nj));
        let middle =
            |along: &Range<usize>, mm: f32| 0.5 * (along.start + along.end - 1) as f32 * mm;
        let half = |along: &Range<usize>, mm: f32| 0.5 * (along.len() - 1) as f32 * mm;
        let half_mm = half(&i, si).hypot(half(&j, sj));
        Tile { middle: [middle(&i, si), middle(&j, sj)], half_mm, i, j }
    };
    (0..nj).step_by(TILE).flat_map(move |j| (0..ni).step_by(TILE).map(move |i| tile(i, j)))
}

/// The outer surface of the chest wall as one radius per ray.
pub(crate) struct Outline<'a> {
    scan: Scan<'a>,
    /// Radius, mm.
    radius: RadialMap,
}

impl<'a> Outline<'a> {
    pub(crate) fn new(scan: Scan<'a>, radius: RadialMap) -> Self {
        Self { scan, radius }
    }

    pub(crate) fn scan(&self) -> Scan<'a> {
        self.scan
    }

    pub(crate) fn radius(&self) -> &RadialMap {
        &self.radius
    }

    pub(crate) fn into_radius(self) -> RadialMap {
        self.radius
    }

    /// How far a voxel (offset in memory) lies outside the surface along its ray, mm.
    #[inline]
    pub(crate) fn beyond(&self, n: usize) -> f32 {
        let Scan { frame, .. } = self.scan;
        self.seen(n / frame.plane(), frame.position(n % frame.plane())).1
    }

    /// The nearest ray to a position (mm) in a slice, counted over all slices, and how far it lies
    /// outside the surface, mm.
    #[inline]
    pub(crate) fn seen(&self, k: usize, position: [f32; 2]) -> (usize, f32) {
        let (r, turn) = self.scan.rays.polar(k, position);
        let p = (turn as usize).min(RAYS - 1);
        let t = turn - p as f32;
        let next = if p + 1 < RAYS { p + 1 } else { 0 };
        let surface = self.radius.at(k, p) * (1.0 - t) + self.radius.at(k, next) * t;
        // Half a turn between rays and more is nearer to the next one.
        (k * RAYS + if t < 0.5 { p } else { next }, r - surface)
    }

    /// The nearest ray to a voxel (offset in memory), counted over all slices.
    pub(crate) fn ray(&self, n: usize) -> usize {
        let Scan { frame, .. } = self.scan;
        self.seen(n / frame.plane(), frame.position(n % frame.plane())).0
    }

    /// Least and greatest radius in a slice, mm.
    pub(crate) fn extent(&self, k: usize) -> (f32, f32) {
        let radii = &self.radius.values[k * RAYS..(k + 1) * RAYS];
        radii.iter().fold((f32::INFINITY, 0.0), |(a, b), &r| (r.min(a), r.max(b)))
    }

    /// Labels of the voxels whose centres lie inside the body, inside or outside the wall.
    pub(crate) fn paint(&self) -> LabelMap {
        let Scan { ct, frame, body, .. } = self.scan;
        let mut labels = label::empty(ct.grid());
        let slices = labels.data_mut().par_chunks_mut(frame.plane()).enumerate();
        slices.for_each(|(k, out)| {
            let flags = body.flags_slice(frame, k);
            for tile in tiles(frame) {
                self.paint_tile(k, &tile, flags, out);
            }
        });
        labels
    }

    fn paint_tile(&self, k: usize, tile: &Tile, flags: &[u8], out: &mut [u8]) {
        let Frame { size: [ni, ..], spacing: [si, sj, _], .. } = *self.scan.frame;
        let side = self.side_of(k, tile);
        for j in tile.j.clone() {
            let (from, to) = (j * ni + tile.i.start, j * ni + tile.i.end);
            let pixels = tile.i.clone().zip(&mut out[from..to]).zip(&flags[from..to]);
            for ((i, out), _) in pixels.filter(|(_, flags)| *flags & flag::BODY != 0) {
                let position = || [i as f32 * si, j as f32 * sj];
                let wall = side.unwrap_or_else(|| self.seen(k, position()).1 < 0.0);
                *out = if wall { label::CHEST_WALL } else { label::SOFT_TISSUE };
            }
        }
    }

    /// Whether a tile lies inside the surface as a whole (true) or outside (false); `None` when it
    /// may cross it.
    fn side_of(&self, k: usize, tile: &Tile) -> Option<bool> {
        let (r, turn) = self.scan.rays.polar(k, tile.middle);
        let half = tile.half_mm;
        if r < 2.0 * half {
            return None;
        }
        // An arc sine is no more than its argument times a quarter turn.
        let rays = (0.25 * RAYS as f32 * half / r) as usize + 2;
        let first = turn as usize + RAYS - rays;
        let radii = (first..first + 2 * rays + 2).map(|p| self.radius.at(k, p % RAYS));
        let (low, high) =
            radii.fold((f32::INFINITY, 0.0f32), |(a, b), radius| (a.min(radius), b.max(radius)));
        let side = if r + half < low - ROUNDING_MM { Some(true) } else { None };
        if r - half > high + ROUNDING_MM { Some(false) } else { side }
    }

    /// Skin and chest wall of finished labels.
    ///
    /// The skin lies at `skin_hu` of the CT, the chest wall where the outline crosses, or, where
    /// the labels depart from it, at the half-way level of fat and muscle; half-way between two
    /// voxels where the CT does not show what the labels say (table or wire taken off, end of the
    /// field, a seed).
    pub(crate) fn surfaces(&self, labels: &LabelMap, skin_hu: f32, levels: Levels) -> Surfaces {
        let (grid, tissue) = (labels.grid(), labels.data());
        let skin = |n: usize, m: usize| {
            let seen = self.scan.body.field[m % self.scan.frame.plane()];
            if seen { self.hu_crossing(n, m, skin_hu) } else { 0.5 }
        };
        let wall = |n: usize, m: usize| {
            let (a, b) = (self.beyond(n), self.beyond(m));
            let share = if a < 0.0 && b >= 0.0 {
                a / (a - b)
            } else {
                self.hu_crossing(n, m, levels.middle())
            };
            if tissue[m] == label::OUTSIDE { share.min(skin(n, m)) } else { share }
        };
        let (skin, chest_wall) = rayon::join(
            || SignedDistance::new(grid, BAND_MM, |n| tissue[n] != label::OUTSIDE, skin),
            || SignedDistance::new(grid, BAND_MM, |n| label::is_chest_wall(tissue[n]), wall),
        );
        Surfaces { skin, chest_wall }
    }

    /// Where the CT falls through a level on the way from voxel n to m, as a share of it;
    /// half-way when it does not.
    fn hu_crossing(&self, n: usize, m: usize, level: f32) -> f32 {
        let hu = |n: usize| f32::from(self.scan.ct.data()[n].max(-1024));
        let (a, b) = (hu(n), hu(m));
        if a >= level && b < level { (a - level) / (a - b) } else { 0.5 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::radial_map::Rays;
    use supine_space::{Grid, Matrix, Point, Vector};
    use supine_volume::Volume;

    #[test]
    fn tiles_paint_what_each_voxel_says_for_itself() {
        // Neither side is a whole number of tiles, and the axis lies in the middle of one.
        let spacing = Vector::new(1.9, 2.3, 5.0);
        let grid = Grid::new([125, 91, 40], spacing, Point::origin(), Matrix::identity()).unwrap();
        let (frame, ct) = (Frame::new(&grid).unwrap(), Volume::from_fn(grid, |_| 0i16));
        let rays = Rays::new(&frame, vec![[118.0, 104.0]; 40]);
        let flags = vec![flag::BODY; ct.data().len()];
        let body = Body::new(&frame, flags, vec![true; frame.plane()], 3.0);
        let scan = Scan { ct: &ct, frame: &frame, body: &body, rays: &rays };
        // With a step at the end of the ring, near the axis and beyond the image.
        let wave = |k: usize, p: usize| (p as f32 / (9.0 + k as f32)).sin();
        let radius = RadialMap::from_fn(40, |k, p| (3.0 * k as f32 + 25.0 * wave(k, p)).max(1.0));
        let outline = Outline::new(scan, radius);
        let labels = outline.paint();
        for (n, &got) in labels.data().iter().enumerate() {
            let wall = outline.beyond(n) < 0.0;
            assert_eq!(got, if wall { label::CHEST_WALL } else { label::SOFT_TISSUE }, "{n}");
        }
        assert!(labels.data().contains(&label::CHEST_WALL));
    }
}

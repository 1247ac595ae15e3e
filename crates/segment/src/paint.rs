//! Surfaces to labels, and labels to surfaces known between the voxels.

use crate::body::flag;
use crate::levels::Levels;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use rayon::prelude::*;
use supine_volume::{LabelMap, SignedDistance, Surfaces, label};

/// Distances to the surfaces are told this far, mm. Chosen, not measured.
const BAND_MM: f64 = 5.0;

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
        let Scan { frame, rays, .. } = self.scan;
        let (k, pixel) = (n / frame.plane(), n % frame.plane());
        let (r, turn) = rays.polar(k, frame.position(pixel));
        let p = (turn as usize).min(RAYS - 1);
        let t = turn - p as f32;
        r - (self.radius.at(k, p) * (1.0 - t) + self.radius.at(k, (p + 1) % RAYS) * t)
    }

    /// The nearest ray to a voxel (offset in memory), counted over all slices.
    pub(crate) fn ray(&self, n: usize) -> usize {
        let Scan { frame, rays, .. } = self.scan;
        let k = n / frame.plane();
        let (_, turn) = rays.polar(k, frame.position(n % frame.plane()));
        k * RAYS + turn.round() as usize % RAYS
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
        let plane = frame.plane();
        labels.data_mut().par_chunks_mut(plane).enumerate().for_each(|(k, out)| {
            let (near, far) = self.extent(k);
            for (out, (n, flags)) in
                out.iter_mut().zip(body.flags_slice(frame, k).iter().enumerate())
            {
                if flags & flag::BODY != 0 {
                    let away = self.scan.rays.squared_radius(k, frame.position(n));
                    let wall =
                        away < near * near || away < far * far && self.beyond(k * plane + n) < 0.0;
                    *out = if wall { label::CHEST_WALL } else { label::SOFT_TISSUE };
                }
            }
        });
        labels
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

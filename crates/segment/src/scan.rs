//! The CT with what was found in it so far.

use crate::aggregate::Costs;
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::plane::bilinear;
use crate::radial_map::{RadialMap, Rays};
use supine_volume::Ct;

/// Places along a ray, counted from a surface.
#[derive(Clone, Copy)]
pub(crate) struct Heights {
    /// Height of the first, mm outside the surface.
    pub(crate) lowest_mm: f32,
    /// From each to the next, mm.
    pub(crate) step_mm: f32,
    /// How many.
    pub(crate) count: usize,
}

/// The CT, its patient and the rays from the axis of her thorax.
#[derive(Clone, Copy)]
pub(crate) struct Scan<'a> {
    pub(crate) ct: &'a Ct,
    pub(crate) frame: &'a Frame,
    pub(crate) body: &'a Body,
    pub(crate) rays: &'a Rays,
}

/// What counts as lung on a ray: a cushion beside the patient may hold as much air.
const LUNG: u8 = flag::LUNG | flag::BODY;
/// Step along a ray where lung is looked for, mm.
const LUNG_STEP_MM: f32 = 0.5;

impl Scan<'_> {
    /// Radius of the outermost lung on a ray between two radii, mm; `None` where there is none.
    pub(crate) fn outermost_lung(
        &self,
        (k, p): (usize, usize),
        [from, to]: [f32; 2],
    ) -> Option<f32> {
        let flags = self.body.flags_slice(self.frame, k);
        let is_lung = |r: &f32| {
            let at = self.rays.pixel(k, p, r.max(0.0));
            let share = bilinear(flags, self.frame.size[0], at, |f| f32::from(f & LUNG == LUNG));
            share.is_some_and(|share| share > 0.5)
        };
        let steps = ((to - from) / LUNG_STEP_MM).round() as usize;
        (0..=steps).map(|n| to - LUNG_STEP_MM * n as f32).find(is_lung)
    }

    /// `value(pixel)` along the rays of a slice at heights over a surface, height fastest; NaN
    /// where it has none.
    pub(crate) fn along(
        &self,
        k: usize,
        surface: &RadialMap,
        heights: Heights,
        out: &mut [f32],
        value: impl Fn([f32; 2]) -> Option<f32>,
    ) {
        let Heights { lowest_mm, step_mm, count } = heights;
        for (p, out) in out.chunks_exact_mut(count).enumerate() {
            for (level, out) in out.iter_mut().enumerate() {
                let r = surface.at(k, p) + lowest_mm + step_mm * level as f32;
                *out = value(self.rays.pixel(k, p, r.max(0.0))).unwrap_or(f32::NAN);
            }
        }
    }

    /// [`Self::along`] for every slice, with the image made per slice by `image(k)`.
    pub(crate) fn sample<I>(
        &self,
        surface: &RadialMap,
        heights: Heights,
        image: impl Fn(usize) -> I + Sync,
        value: impl Fn(&I, usize, [f32; 2]) -> Option<f32> + Sync,
    ) -> Costs {
        Costs::new(self.frame.size[2], heights.count, |k, out| {
            let image = image(k);
            self.along(k, surface, heights, out, |at| value(&image, k, at));
        })
    }
}

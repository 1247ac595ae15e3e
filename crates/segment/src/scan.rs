//! The CT with what was found in it so far.

use crate::aggregate::Costs;
use crate::body::Body;
use crate::frame::Frame;
use crate::sheet::{RAYS, Rays, Sheet};
use supine_volume::Ct;

/// The CT, its patient and the rays from the axis of her thorax.
#[derive(Clone, Copy)]
pub(crate) struct Scan<'a> {
    pub(crate) ct: &'a Ct,
    pub(crate) frame: &'a Frame,
    pub(crate) body: &'a Body,
    pub(crate) rays: &'a Rays,
}

impl Scan<'_> {
    /// `value(pixel)` along the rays of a slice, from `lowest` (mm) outside a surface in steps of
    /// `step` (mm), level fastest; NaN where it has none.
    pub(crate) fn along(
        &self,
        k: usize,
        surface: &Sheet,
        (lowest, step): (f32, f32),
        out: &mut [f32],
        value: impl Fn([f32; 2]) -> Option<f32>,
    ) {
        let levels = out.len() / RAYS;
        for (p, out) in out.chunks_exact_mut(levels).enumerate() {
            for (level, out) in out.iter_mut().enumerate() {
                let r = surface.at(k, p) + lowest + step * level as f32;
                *out = value(self.rays.pixel(k, p, r.max(0.0))).unwrap_or(f32::NAN);
            }
        }
    }

    /// [`Self::along`] for every slice, with the image made per slice by `image(k)`.
    pub(crate) fn sample<I>(
        &self,
        surface: &Sheet,
        grid: (f32, f32, usize),
        image: impl Fn(usize) -> I + Sync,
        value: impl Fn(&I, usize, [f32; 2]) -> Option<f32> + Sync,
    ) -> Costs {
        let (lowest, step, levels) = grid;
        Costs::new(self.frame.size[2], levels, |k, out| {
            let image = image(k);
            self.along(k, surface, (lowest, step), out, |at| value(&image, k, at));
        })
    }
}

//! What stands out of the wall in front and is no muscle: gland that touches the wall draws the
//! surface out into the breast. Grey-scale openings along lines tell it: a ridge of muscle, such as
//! its free border, is long in one direction at least.

use crate::band::FRONT;
use crate::radial_map::{RAYS, RadialMap};
use crate::scan::Scan;
use std::f32::consts::FRAC_PI_4;

// Lengths and heights were chosen. Measured with both: a strand that ended on the muscle drew the
// wall 3.09 mm out on one synthetic patient at most, now 2.45; dense gland 7.7 mm, now 5.3.
/// A muscle is at least twice this long along the body; what is shorter stands out no more than the
/// height, mm.
const SPIKE_MM: f32 = 8.0;
const SPIKE_HEIGHT_MM: f32 = 8.0;
/// A muscle is at least twice this long in one direction; what is shorter in all of them stands out
/// no more than the height, mm.
const NUB_MM: f32 = 7.0;
const NUB_HEIGHT_MM: f32 = 1.0;
/// Places on a line are no farther apart than this, mm.
const APART_MM: f32 = 1.25;

/// The surface (height above the shell, mm) without what stands out of it.
pub(crate) fn lowered(surface: &RadialMap, shell: &RadialMap, scan: Scan<'_>) -> RadialMap {
    let line = |reach_mm, angle| Line { reach_mm, angle, shell, slice_mm: scan.frame.spacing[2] };
    let along = line(SPIKE_MM, 2.0 * FRAC_PI_4).opened(surface);
    let any: Vec<RadialMap> =
        (0..4u8).map(|n| line(NUB_MM, f32::from(n) * FRAC_PI_4).opened(surface)).collect();
    RadialMap::from_fn(surface.slices(), |k, p| {
        let (h, along) = (surface.at(k, p), along.at(k, p));
        let any = any.iter().map(|map| map.at(k, p)).fold(f32::NEG_INFINITY, f32::max);
        if scan.rays.to_back[p] >= FRONT {
            h
        } else if h > along + SPIKE_HEIGHT_MM {
            along
        } else if h > any + NUB_HEIGHT_MM {
            any
        } else {
            h
        }
    })
}

/// A straight line on the shell, this far to both sides of its middle.
#[derive(Clone, Copy)]
struct Line<'a> {
    reach_mm: f32,
    /// From the direction of the rays to that of the slices, radians.
    angle: f32,
    shell: &'a RadialMap,
    slice_mm: f32,
}

impl Line<'_> {
    /// Lowers what holds no such line.
    fn opened(self, surface: &RadialMap) -> RadialMap {
        self.fold(&self.fold(surface, f32::INFINITY, f32::min), f32::NEG_INFINITY, f32::max)
    }

    fn fold(self, surface: &RadialMap, start: f32, with: fn(f32, f32) -> f32) -> RadialMap {
        let steps = (self.reach_mm / APART_MM).ceil() as i16;
        let (sin, cos) = self.angle.sin_cos();
        let along = |n: i16| f32::from(n) * self.reach_mm / f32::from(steps);
        let rows: Vec<isize> =
            (-steps..=steps).map(|n| rounded(along(n) * sin / self.slice_mm)).collect();
        let last = surface.slices() as isize - 1;
        RadialMap::from_fn(surface.slices(), |k, p| {
            let arc = self.shell.arc(k, p);
            let at = |(n, row): (i16, &isize)| {
                let row = (k as isize + row).clamp(0, last) as usize;
                let ray = p as isize + rounded(along(n) * cos / arc);
                surface.at(row, ray.rem_euclid(RAYS as isize) as usize)
            };
            (-steps..=steps).zip(&rows).map(at).fold(start, with)
        })
    }
}

/// The nearest whole number, as `f32::round`, which is a call on machines without an instruction
/// for it.
#[inline]
fn rounded(x: f32) -> isize {
    // In double precision the half is added exactly.
    let x = f64::from(x);
    (x + 0.5f64.copysign(x)) as i32 as isize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slices of 2.5 mm, rays 1.75 mm apart.
    const SLICE_MM: f32 = 2.5;
    const RADIUS_MM: f32 = 100.0;

    /// The flat surface, with what `height(along, across)` (mm from the middle) says on top, opened
    /// by the four lines.
    fn opened(height: impl Fn(f32, f32) -> f32 + Sync) -> (RadialMap, RadialMap) {
        let shell = RadialMap::new(41, RADIUS_MM);
        let surface = RadialMap::from_fn(41, |k, p| {
            height((k as f32 - 20.0) * SLICE_MM, (p as f32 - 100.0) * shell.arc(k, p))
        });
        let line = |n: u8| Line {
            reach_mm: NUB_MM,
            angle: f32::from(n) * FRAC_PI_4,
            shell: &shell,
            slice_mm: SLICE_MM,
        };
        let lines: Vec<RadialMap> = (0..4).map(|n| line(n).opened(&surface)).collect();
        let most = RadialMap::from_fn(41, |k, p| {
            lines.iter().map(|l| l.at(k, p)).fold(f32::NEG_INFINITY, f32::max)
        });
        (surface, most)
    }

    #[test]
    fn a_nub_is_lowered_whatever_its_height() {
        for high in [2.0, 6.0, 20.0] {
            let (_, opened) = opened(|z, x| if z.hypot(x) < 4.0 { high } else { 0.0 });
            assert!(opened.values.iter().all(|&h| h == 0.0), "{high} mm");
        }
    }

    #[test]
    fn a_ridge_is_kept_whichever_way_it_runs() {
        for n in 0..4u8 {
            let (sin, cos) = (f32::from(n) * FRAC_PI_4).sin_cos();
            let across = |z: f32, x: f32| z * cos - x * sin;
            let (surface, opened) = opened(|z, x| if across(z, x).abs() < 4.0 { 9.0 } else { 0.0 });
            let inner = (8..33).flat_map(|k| (80..120).map(move |p| (k, p)));
            let lost = inner.clone().filter(|&(k, p)| opened.at(k, p) < surface.at(k, p)).count();
            let ridge = inner.filter(|&(k, p)| surface.at(k, p) > 0.0).count();
            assert!(ridge > 50 && 20 * lost <= ridge, "{n}: {lost} of {ridge}");
        }
    }

    #[test]
    fn a_slope_and_its_foot_stay_where_they_are() {
        let (surface, opened) = opened(|z, x| (0.8 * x + 0.3 * z).clamp(0.0, 25.0));
        let off = |(a, b): (&f32, &f32)| a - b;
        let most = surface.values.iter().zip(&opened.values).map(off).fold(0.0, f32::max);
        assert!(most <= NUB_HEIGHT_MM, "{most}");
    }
}

//! The levels of fat and muscle in this scan.

use crate::Error;
use crate::band::{Band, height};
use crate::body::{Body, flag};
use crate::frame::Frame;
use crate::histogram::Histogram;
use crate::radial_map::{RAYS, Rays};
use crate::smoothing::{SMOOTH_MM, smoothed_rows};
use rayon::prelude::*;
use std::ops::Range;
use supine_volume::Ct;

/// Search ranges of the two modes, HU. Measured: fat -97 to -111, muscle 46 to 54, 32 beside an
/// effusion (docs/SEGMENTATION.md, step 5 and Traps).
const FAT_HU: Range<f32> = -160.0..-50.0;
const MUSCLE_HU: Range<f32> = 15.0..110.0;
/// Before any surface is known, muscle is looked for this deep under the skin of the back and fat
/// below the skin, mm, in slices so far apart. Measured: within 4 HU of what is found later outside
/// the ribs.
const BACK_MM: Range<f32> = 8.0..25.0;
const SKIN_MM: f32 = 4.0;
const APART_MM: f32 = 10.0;
/// Least difference that allows to tell them apart, HU. Chosen, not measured.
pub(crate) const MIN_CONTRAST_HU: f32 = 60.0;

/// No muscle is denser than its mode by more than this, HU (docs/SEGMENTATION.md, step 6).
const DENSEST_HU: f32 = 60.0;

/// From muscle to gland, HU (the same).
const SPAN_HU: f32 = 10.0;
/// Tissue nearer to muscle than this share of the way from fat is not fat in part. Measured: at 0.5
/// a thin pectoralis counts as gland, at 0.9 gland as muscle.
const DENSE_SHARE: f32 = 0.8;

/// Levels of this scan, HU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Levels {
    pub(crate) fat: f32,
    pub(crate) muscle: f32,
}

impl Levels {
    /// The levels before any surface is known: the mode of fat in the body, and that of muscle not
    /// far under the skin of the back.
    pub(crate) fn of_body(ct: &Ct, frame: &Frame, body: &Body) -> Self {
        let apart = ((APART_MM / frame.spacing[2]) as usize).max(1);
        let none = || [FAT_HU, MUSCLE_HU].map(|range| Histogram::new(&range));
        let count = |mut counted: [Histogram; 2], k: usize| {
            let image = smoothed_rows(ct, frame, (k, body.rows(frame, k)), SMOOTH_MM);
            let middle = middle_to_back(frame, body, k);
            let [fat, muscle] = &mut counted;
            for (n, &hu) in image.iter().enumerate() {
                let depth = body.depth_mm(k * frame.plane() + n);
                if depth > SKIN_MM {
                    fat.add(hu);
                }
                if BACK_MM.contains(&depth) && to_back(frame, n) > middle {
                    muscle.add(hu);
                }
            }
            counted
        };
        let slices = (0..frame.size[2]).into_par_iter().step_by(apart);
        let [fat, muscle] =
            slices.fold(none, count).reduce(none, |[a, b], [c, d]| [a.with(c), b.with(d)]);
        Self { fat: fat.mode(), muscle: muscle.mode() }
    }

    /// Fat: mode in front of the shell. Muscle: mode of the back muscles, for in front thin muscle
    /// and effusion drag the mode down.
    pub(crate) fn measure(band: &Band, rays: &Rays) -> Result<Self, Error> {
        let pick = |wanted: &(dyn Fn(usize, f32, f32) -> bool + Sync), range: Range<f32>| {
            let none = || Histogram::new(&range);
            let levels = band.levels();
            let count = |mut counted: Histogram, (n, (hu, depth)): (usize, (&[f32], &[f32]))| {
                for (level, (&hu, &depth)) in hu.iter().zip(depth).enumerate() {
                    if wanted(n % RAYS, height(level), depth) {
                        counted.add(hu);
                    }
                }
                counted
            };
            let (hu, depth) = (&band.hu.values, &band.depth.values);
            let rays = hu.par_chunks(levels).zip(depth.par_chunks(levels)).enumerate();
            rays.fold(none, count).reduce(none, Histogram::with).mode()
        };
        let front = |p: usize, _h: f32, depth: f32| rays.to_back[p] < 0.1 && depth > 4.0;
        let back = |p: usize, h: f32, depth: f32| {
            rays.to_back[p] > 0.5 && h > 0.0 && h < 25.0 && depth > 6.0
        };
        let levels = Self { fat: pick(&front, FAT_HU), muscle: pick(&back, MUSCLE_HU) };
        if levels.muscle - levels.fat < MIN_CONTRAST_HU {
            return Err(Error::NoContrast {
                fat_hu: levels.fat.into(),
                muscle_hu: levels.muscle.into(),
            });
        }
        Ok(levels)
    }

    /// Half-way between fat and muscle, HU.
    pub(crate) fn middle(self) -> f32 {
        self.at(0.5)
    }

    /// At a share of the way from fat to muscle, HU.
    pub(crate) fn at(self, share: f32) -> f32 {
        self.fat + share * (self.muscle - self.fat)
    }

    /// 0 for fat, 1 for muscle, linear between.
    pub(crate) fn likeness(self, hu: f32) -> f32 {
        ((hu - self.fat) / (self.muscle - self.fat)).clamp(0.0, 1.0)
    }

    /// HU of dense soft tissue: no bone, and no fat in part.
    pub(crate) fn dense(self) -> Range<i16> {
        let least = self.at(DENSE_SHARE);
        least as i16..(self.muscle + DENSEST_HU) as i16
    }

    /// Whether tissue of this mean HU is muscle: 1 within `below`..+60 HU of the muscle, falling to
    /// 0 at 10 HU less.
    pub(crate) fn true_muscle(self, hu: f32, below: f32) -> f32 {
        if hu < self.muscle + DENSEST_HU {
            ((hu - self.muscle + below) / SPAN_HU + 1.0).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    /// Whether it is gland: what is too soft for muscle.
    pub(crate) fn gland(self, hu: f32, below: f32) -> f32 {
        ((self.muscle - below - hu) / SPAN_HU).clamp(0.0, 1.0)
    }
}

/// Coordinate of a pixel towards the back, mm.
fn to_back(frame: &Frame, n: usize) -> f32 {
    let [x, y] = frame.position(n);
    x * frame.back[0] + y * frame.back[1]
}

/// Coordinate towards the back of the middle of the body in a slice, mm.
fn middle_to_back(frame: &Frame, body: &Body, k: usize) -> f32 {
    let flags = body.flags_slice(frame, k);
    let inside = (0..flags.len()).filter(|&n| flags[n] & flag::BODY != 0);
    let (front, back) = inside.fold((f32::INFINITY, f32::NEG_INFINITY), |(front, back), n| {
        let at = to_back(frame, n);
        (front.min(at), back.max(at))
    });
    0.5 * (front + back)
}

/// Mode of the fat among the values (HU) whose place `counts`.
pub(crate) fn fat_mode(values: &[i16], counts: impl Fn(usize) -> bool + Sync) -> f32 {
    Histogram::of(values, &FAT_HU, counts).mode()
}

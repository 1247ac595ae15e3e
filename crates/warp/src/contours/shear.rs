//! The solid between two planes whose contours lie side by side more than upon each other.
//!
//! Interpolating signed distances (Raya and Udupa, IEEE Trans. Med. Imaging 9, 1990) needs outlines
//! that overlap: of a band 3 mm wide that moves on by 5 mm from plane to plane nothing is left
//! half-way. So one outline is shifted towards the other, on the way between their middles, as they
//! too propose for objects that are displaced.

use super::Plane;
use crate::outline::{Pixels, signed_distance};
use supine_volume::Outlines;

/// Shifted outlines must cover this share of the smaller one more than the outlines as they lie.
const BETTER: f64 = 0.1;
/// Most layers between two planes.
const MAX_LAYERS: usize = 64;

/// Layers to be put between two planes, ascending: their level and signed distances, mm. None where
/// the outlines lie upon each other well enough as they are.
pub(super) fn layers(
    pixels: &Pixels,
    planes: [&Plane; 2],
    distances: [&Vec<f32>; 2],
) -> Vec<(f64, Vec<f32>)> {
    let Some(shift) = shift(pixels, distances) else { return vec![] };
    let [low, high] = planes;
    // From layer to layer the outline moves on by a pixel.
    let count = ((shift[0].hypot(shift[1]) / pixels.step).ceil() as usize).clamp(2, MAX_LAYERS);
    let layer = |n: usize| {
        let t = n as f64 / count as f64;
        let from = signed_distance(pixels, &moved(low, shift, t));
        let to = signed_distance(pixels, &moved(high, shift, t - 1.0));
        let mixed = from.iter().zip(to).map(|(a, b)| a + (b - a) * t as f32);
        (low.level + (high.level - low.level) * t, mixed.collect())
    };
    (1..count).map(layer).collect()
}

fn moved(plane: &Plane, shift: [f64; 2], share: f64) -> Outlines {
    plane.outlines.moved(shift.map(|mm| mm * share))
}

/// The way between the middles of two outlines, mm, when they cover each other better along it.
fn shift(pixels: &Pixels, [low, high]: [&Vec<f32>; 2]) -> Option<[f64; 2]> {
    let ([x, y], [nx, ny]) = (middle(pixels, low)?, pixels.size);
    let [to_x, to_y] = middle(pixels, high)?;
    let way = [to_x - x, to_y - y].map(|pixels| pixels.round() as isize);
    let covered = |[di, dj]: [isize; 2]| {
        let both = (0..low.len()).filter(|&n| {
            let (i, j) = ((n % nx) as isize + di, (n / nx) as isize + dj);
            let within = (0..nx as isize).contains(&i) && (0..ny as isize).contains(&j);
            low[n] < 0.0 && within && high[j as usize * nx + i as usize] < 0.0
        });
        both.count() as f64
    };
    let inside = |values: &[f32]| values.iter().filter(|d| **d < 0.0).count();
    let smaller = inside(low).min(inside(high)) as f64;
    let better = covered(way) - covered([0, 0]) > BETTER * smaller;
    better.then(|| [to_x - x, to_y - y].map(|n| n * pixels.step))
}

/// The middle of the pixels inside, in pixels.
fn middle(pixels: &Pixels, distances: &[f32]) -> Option<[f64; 2]> {
    let inside = (0..distances.len()).filter(|&n| distances[n] < 0.0);
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for n in inside {
        sum[0] += (n % pixels.size[0]) as f64;
        sum[1] += (n / pixels.size[0]) as f64;
        count += 1.0;
    }
    (count > 0.0).then(|| sum.map(|s| s / count))
}

//! One voxel after the other: what the others are tested against.

use super::{Local, Place, Source};

pub(super) fn sample(source: &Source<'_>, local: &Local, places: &[Place], values: &mut [i16]) {
    for (value, place) in values.iter_mut().zip(places) {
        *value = one(source, local, *place);
    }
}

fn one(source: &Source<'_>, local: &Local, place: Place) -> i16 {
    let p = place.indices().map(|n| n as f32);
    let (mut cell, mut t) = ([0i32; 3], [0f32; 3]);
    for a in 0..3 {
        let [x, y, z] = local.slopes[a];
        let q = p[2].mul_add(z, p[1].mul_add(y, p[0].mul_add(x, local.constant[a])));
        // In this order NaN, which a flat tetrahedron gives, comes to the lower end.
        let q = if q > local.low[a] { q } else { local.low[a] };
        let q = if q < local.high[a] { q } else { local.high[a] };
        cell[a] = (q as i32).min(local.last[a]);
        t[a] = q - cell[a] as f32;
    }
    let [row, slice] = local.steps;
    let at = local.start + (cell[0] + cell[1] * row + cell[2] * slice) as usize;
    let between = |a: f32, b: f32, t: f32| t.mul_add(b - a, a);
    let along = |n: usize| between(f32::from(source.data[n]), f32::from(source.data[n + 1]), t[0]);
    let (row, slice) = (row as usize, slice as usize);
    let plane = |n: usize| between(along(n), along(n + row), t[1]);
    between(plane(at), plane(at + slice), t[2]).round_ties_even() as i16
}

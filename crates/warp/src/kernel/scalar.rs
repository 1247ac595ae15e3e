//! One after the other: what the others are tested against.

use super::{Locals, Place, Source, Spots, SpotsMut};
use crate::batch::Crossings;
use crate::rows::Span;
use crate::sweep::{Extent, Swept};
use std::ops::Range;

pub(super) fn sweep(crossings: &Crossings, lane: usize, extent: &Extent, swept: &mut Swept) {
    let (last, blur) = (crossings.last[lane], crossings.blur[lane]);
    let [i, j, k] = extent.first.map(|n| n as u32);
    for [j_at, k_at] in extent.rows() {
        let (y, z) = ((j_at - j) as f32, (k_at - k + extent.before as u32) as f32);
        let (mut from, mut to) = (-0.5f32, last + 0.5);
        for (f, face) in crossings.faces.iter().enumerate() {
            let [constant, y_slope, z_slope] = face.map(|term| term[lane]);
            let at = y.mul_add(y_slope, z.mul_add(z_slope, constant));
            from = from.max(at + crossings.low[f][lane]);
            to = to.min(at + crossings.high[f][lane]);
        }
        // Beyond the box it does not matter how far.
        let (from, to) = (from.min(last + 0.5), to.max(-0.5));
        let (first, end) = (from.ceil(), to.floor() + 1.0);
        // How far the crossings are above the whole number before.
        let above = [from - (first - 1.0), to - (end - 1.0)];
        if above.into_iter().any(|above| !(above > blur && above < 1.0 - blur)) {
            swept.unsure.push([j_at, k_at]);
        } else if first < end {
            let (from, to) = (i + first as u32, i + end as u32);
            swept.spans.push(Span { j: j_at, k: k_at, from, to });
        }
    }
}

pub(super) fn locate(locals: &Locals, lane: usize, places: &[Place], spots: SpotsMut<'_>) {
    let SpotsMut { cells, within: [x, y, z] } = spots;
    for (n, place) in places.iter().enumerate() {
        (cells[n], [x[n], y[n], z[n]]) = find(locals, lane, *place);
    }
}

fn find(locals: &Locals, lane: usize, place: Place) -> (u32, [f32; 3]) {
    let p = place.indices().map(|n| n as f32);
    let (mut cell, mut t) = ([0i32; 3], [0f32; 3]);
    for a in 0..3 {
        let [x, y, z] = [0, 1, 2].map(|b: usize| locals.slopes[a][b][lane]);
        let q = p[0].mul_add(x, locals.constant[a][lane]);
        let q = p[2].mul_add(z, p[1].mul_add(y, q));
        let (low, high) = (locals.low[a][lane], locals.high[a][lane]);
        // In this order NaN, which a flat tetrahedron gives, comes to the lower end.
        let q = if q > low { q } else { low };
        let q = if q < high { q } else { high };
        cell[a] = (q as i32).min(locals.last[a][lane]);
        t[a] = q - cell[a] as f32;
    }
    let [row, slice] = locals.steps;
    (locals.start[lane] + (cell[0] + cell[1] * row + cell[2] * slice) as u32, t)
}

pub(super) fn blend(source: &Source<'_>, spots: &Spots, values: &mut [i16]) {
    for (n, value) in values.iter_mut().enumerate() {
        let within = [spots.within[0][n], spots.within[1][n], spots.within[2][n]];
        *value = one(source, spots.cells[n], within);
    }
}

fn one(source: &Source<'_>, cell: u32, t: [f32; 3]) -> i16 {
    let cell = (cell as usize).min(source.last_cell());
    let [_, row, slice] = source.steps;
    let between = |a: f32, b: f32, t: f32| t.mul_add(b - a, a);
    let along = |n: usize| between(f32::from(source.data[n]), f32::from(source.data[n + 1]), t[0]);
    let plane = |n: usize| between(along(n), along(n + row), t[1]);
    between(plane(cell), plane(cell + slice), t[2]).round_ties_even() as i16
}

/// By cubic convolution, held within the voxels it is of; beyond the edges of the volume the
/// outermost go on.
pub(super) fn cubic(source: &Source<'_>, spots: &Spots, range: Range<usize>, values: &mut [i16]) {
    for n in range {
        let within = [spots.within[0][n], spots.within[1][n], spots.within[2][n]];
        values[n] = one_cubic(source, spots.cells[n], within);
    }
}

fn one_cubic(source: &Source<'_>, cell: u32, t: [f32; 3]) -> i16 {
    let places = around(source, cell as usize);
    let weights = t.map(keys);
    let (mut low, mut high) = (i16::MAX, i16::MIN);
    // First along j, in each of the four slices, at each of the four voxels of a row.
    let mut sums = [[0f32; 4]; 4];
    for (sums, k) in sums.iter_mut().zip(places[2]) {
        for (sum, i) in sums.iter_mut().zip(places[0]) {
            for (weight, j) in weights[1].iter().zip(places[1]) {
                let value = source.data[i + j + k];
                *sum = weight.mul_add(f32::from(value), *sum);
                (low, high) = (low.min(value), high.max(value));
            }
        }
    }
    // Then along i, by pairs, and along k.
    let mut pairs = [[0f32; 2]; 4];
    let [x, _, z] = weights;
    for ((pairs, [a, b, c, d]), z) in pairs.iter_mut().zip(sums).zip(z) {
        *pairs = [b.mul_add(x[1], a * x[0]) * z, d.mul_add(x[3], c * x[2]) * z];
    }
    let along = |n: usize| (pairs[0][n] + pairs[2][n]) + (pairs[1][n] + pairs[3][n]);
    // Both are whole: it does not matter which is done first, rounding or holding.
    ((along(0) + along(1)).round_ties_even() as i16).max(low).min(high)
}

/// Where the four voxels along each axis around a cell are; what the source holds ends where the
/// volume does, or beyond what is asked for.
fn around(source: &Source<'_>, cell: usize) -> [[usize; 4]; 3] {
    let [_, row, slice] = source.steps;
    let cell = [cell % slice % row, cell % slice / row, cell / slice];
    [0, 1, 2].map(|a: usize| {
        let last = source.count[a] - 1;
        [0, 1, 2, 3].map(|n: usize| (cell[a] + n).saturating_sub(1).min(last) * source.steps[a])
    })
}

/// Weights of the four voxels around a place `t` after the second.
fn keys(t: f32) -> [f32; 4] {
    let square = t * t;
    [
        t * t.mul_add(t.mul_add(-0.5, 1.0), -0.5),
        square.mul_add(t.mul_add(1.5, -2.5), 1.0),
        t * t.mul_add(t.mul_add(-1.5, 2.0), 0.5),
        square * t.mul_add(0.5, -0.5),
    ]
}

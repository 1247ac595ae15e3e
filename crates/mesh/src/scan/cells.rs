//! Points sorted into the cells of a grid.

use rayon::prelude::*;
use supine_space::Point;

/// Bits of a cell's place along an axis. What lies farther out than they reach shares the outermost
/// cells.
const BITS: u32 = 21;
/// So many points tell the middle.
const SAMPLE: usize = 1000;

/// The cell and the index of each point: cell by cell, by index within one.
pub(super) fn cells(points: &[Point], size_mm: f64) -> Vec<(u64, u32)> {
    let middle = middle(points);
    let cell = |p: &Point| {
        let half = 1i64 << (BITS - 1);
        let places = ((p - middle) / size_mm).map(|c| (c.floor() as i64).clamp(-half, half - 1));
        key(places.map(|c| c + half).into())
    };
    let mut cells: Vec<(u64, u32)> =
        points.par_iter().enumerate().map(|(n, p)| (cell(p), n as u32)).collect();
    cells.par_sort_unstable();
    cells
}

/// The cells that touch a cell and come after it in the order of their keys.
pub(super) fn after(cell: u64) -> impl Iterator<Item = u64> {
    let mask = (1 << BITS) - 1;
    let place = [cell & mask, cell >> BITS & mask, cell >> (2 * BITS)].map(|c| c as i64);
    (14..27).filter_map(move |n| {
        let beside = [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1];
        let other = [0, 1, 2].map(|axis| place[axis] + beside[axis]);
        other.iter().all(|&c| c >= 0 && c <= mask as i64).then(|| key(other))
    })
}

fn key([x, y, z]: [i64; 3]) -> u64 {
    (z << (2 * BITS) | y << BITS | x) as u64
}

/// The median along each axis: far-off points do not move it.
fn middle(points: &[Point]) -> Point {
    let step = points.len().div_ceil(SAMPLE).max(1);
    let median = |axis: usize| {
        let mut values: Vec<f64> = points.iter().step_by(step).map(|p| p[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    [0, 1, 2].map(median).into()
}

/// For each cell of a grid of this spacing (mm) the point nearest to the mean of those in it, by
/// ascending index.
pub fn representatives(points: &[Point], spacing_mm: f64) -> Vec<u32> {
    let cells = cells(points, spacing_mm);
    let shares: Vec<&[(u64, u32)]> = cells.chunk_by(|a, b| a.0 == b.0).collect();
    let of_cell = |same: &&[(u64, u32)]| {
        let at = |n: u32| points[n as usize].coords;
        let mean = same.iter().map(|s| at(s.1)).sum::<supine_space::Vector>() / same.len() as f64;
        let away = |n: u32| (at(n) - mean).norm_squared();
        // The first of several equally near.
        same.iter().map(|s| s.1).reduce(|a, b| if away(b) < away(a) { b } else { a })
    };
    let mut kept: Vec<u32> = shares.par_iter().filter_map(of_cell).collect();
    kept.par_sort_unstable();
    kept
}

//! Operations within one slice.

use supine_volume::Parts;

/// Squared distance (mm²) of every pixel centre to the nearest one where `on` holds; infinite where
/// that is farther than `reach` (mm).
///
/// Exact: the distance along the row, then the smallest over the rows within reach.
pub(crate) fn squared_distance(on: &[bool], ni: usize, spacing: [f32; 2], reach: f32) -> Vec<f32> {
    let mut along = vec![f32::INFINITY; on.len()];
    let mut seen = Vec::with_capacity(on.len() / ni);
    let squares = squares(ni, spacing[0]);
    for (row, out) in on.chunks_exact(ni).zip(along.chunks_exact_mut(ni)) {
        seen.push(row.contains(&true));
        if seen[seen.len() - 1] {
            distance_in_row(row, &squares, out);
        }
    }
    let rows = (reach / spacing[1]) as usize;
    let lowest = lowest_of_blocks(&along, ni);
    let mut out = along.clone();
    for (j, out) in out.chunks_exact_mut(ni).enumerate() {
        // Between the first and the last pixel that is off.
        let off = |&on: &bool| !on;
        let here = &on[j * ni..(j + 1) * ni];
        let Some(first) = here.iter().position(off) else { continue };
        let last = here.iter().rposition(off).unwrap_or(first);
        let near = Rows { along: &along, lowest: &lowest, seen: &seen, step: spacing[1] };
        for (block, out) in out.chunks_mut(BLOCK).enumerate() {
            if block * BLOCK <= last && first < block * BLOCK + out.len() {
                near.lower(j, block, rows, reach * reach, out);
            }
        }
        // Beyond the reach a row may have been left out that is nearer.
        let limit = reach * reach;
        out.iter_mut().for_each(|o| *o = if *o <= limit { *o } else { f32::INFINITY });
    }
    out
}

/// Pixels of a row that are looked at together. Chosen, not measured.
const BLOCK: usize = 32;
/// Rows after which the highest value of a block is looked for again: that takes as long as a row.
/// Chosen, not measured.
const LOOK_AGAIN: usize = 6;

/// The smallest value of each block of each row.
fn lowest_of_blocks(values: &[f32], ni: usize) -> Vec<f32> {
    let blocks = values.chunks_exact(ni).flat_map(|row| row.chunks(BLOCK));
    blocks.map(|block| block.iter().copied().fold(f32::INFINITY, lower)).collect()
}

/// The squared distances along the rows of a slice, mm².
struct Rows<'a> {
    along: &'a [f32],
    /// The smallest of each block.
    lowest: &'a [f32],
    /// Rows with anything on.
    seen: &'a [bool],
    /// From row to row, mm.
    step: f32,
}

impl Rows<'_> {
    /// Lowers a block of row `j` to what the rows around it, `reach` to both sides, say; nearer
    /// rows first, and none that can lower nothing or say no less than `limit`, mm².
    fn lower(&self, j: usize, block: usize, reach: usize, limit: f32, out: &mut [f32]) {
        let ni = self.along.len() / self.seen.len();
        let blocks = ni.div_ceil(BLOCK);
        let mut highest = highest(out, limit);
        for d in 1..=reach {
            let across = (d as f32 * self.step).powi(2);
            if across >= highest {
                break;
            }
            for row in [j.wrapping_sub(d), j + d] {
                let useful = |row: usize| self.lowest[row * blocks + block] + across < highest;
                if row >= self.seen.len() || !self.seen[row] || !useful(row) {
                    continue;
                }
                let source = &self.along[row * ni + block * BLOCK..];
                out.iter_mut().zip(source).for_each(|(o, a)| *o = lower(*o, a + across));
            }
            if d % LOOK_AGAIN == 0 {
                highest = self::highest(out, limit);
            }
        }
    }
}

/// What a value must be below to matter: the highest of these, or just above `limit`.
fn highest(values: &[f32], limit: f32) -> f32 {
    let higher = |a: &mut f32, b: &f32| *a = if *b > *a { *b } else { *a };
    let mut lanes = [0.0f32; 8];
    let eights = values.chunks_exact(lanes.len());
    let mut highest = eights.remainder().iter().copied().fold(0.0, f32::max);
    eights.for_each(|eight| lanes.iter_mut().zip(eight).for_each(|(a, b)| higher(a, b)));
    lanes.iter().for_each(|lane| higher(&mut highest, lane));
    lower(highest, limit.next_up())
}

/// The lower of two numbers that are not NaN: one instruction where `f32::min` is three.
#[inline]
fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Whether each pixel lies within `reach` (mm) of one where `on` holds, centre to centre.
pub(crate) fn near(on: &[bool], ni: usize, spacing: [f32; 2], reach: f32) -> Vec<bool> {
    squared_distance(on, ni, spacing, reach).iter().map(|d| d.is_finite()).collect()
}

/// The squares of 0, 1, 2 ... steps, mm².
fn squares(count: usize, step: f32) -> Vec<f32> {
    let ways = std::iter::successors(Some(0.0f32), |way| Some(way + step));
    ways.take(count).map(|way| way * way).collect()
}

/// Squared distance to the nearest pixel of a row that is on, looked up in `squares`; any is on.
fn distance_in_row(on: &[bool], squares: &[f32], out: &mut [f32]) {
    let mut from = 0;
    for run in on.chunk_by(|a, b| a == b) {
        let (len, to) = (run.len(), from + run.len());
        let out = &mut out[from..to];
        if run[0] {
            out.fill(0.0);
        } else {
            // To the pixel before the run up to its middle, to the one after it from there on.
            let half = match (from > 0, to < on.len()) {
                (true, true) => len.div_ceil(2),
                (before, _) => {
                    if before {
                        len
                    } else {
                        0
                    }
                }
            };
            let (left, right) = out.split_at_mut(half);
            left.copy_from_slice(&squares[1..half + 1]);
            right.iter_mut().rev().zip(&squares[1..]).for_each(|(out, square)| *out = *square);
        }
        from = to;
    }
}

/// Sets every hole (off pixels that no path of off pixels joins to the border).
pub(crate) fn fill_holes(mask: &mut [bool], ni: usize) {
    let nj = mask.len() / ni;
    let off = Parts::new([ni, nj, 1], |n| !mask[n]);
    let mut open = vec![false; off.voxels.len()];
    for (run, part) in off.iter() {
        let (i, j) = (run.start % ni, run.start / ni);
        open[part] |= i == 0 || i + run.len == ni || j == 0 || j + 1 == nj;
    }
    for (run, part) in off.iter() {
        if !open[part] {
            mask[run.voxels()].fill(true);
        }
    }
}

/// Keeps of a mask what ways of at most `reach` (mm) along its pixels join to `from`; steps lead to
/// the eight neighbours.
pub(crate) fn keep_joined(
    mask: &mut [bool],
    from: &[bool],
    ni: usize,
    [si, sj]: [f32; 2],
    reach: f32,
) {
    let nj = mask.len() / ni;
    let steps = [0, 1, 2].map(|dj: usize| {
        [0, 1, 2].map(|di: usize| (di.abs_diff(1) as f32 * si).hypot(dj.abs_diff(1) as f32 * sj))
    });
    let mut way: Vec<f32> = from.iter().map(|&f| if f { 0.0 } else { f32::INFINITY }).collect();
    let inner = |n: usize| {
        let beside = [n.wrapping_sub(ni), n.wrapping_sub(1), n + 1, n + ni];
        beside.iter().all(|&m| from.get(m) == Some(&true))
    };
    let mut front: Vec<usize> = (0..mask.len()).filter(|&n| from[n] && !inner(n)).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for n in front {
            let (i, j) = (n % ni, n / ni);
            for (di, dj) in [0, 1, 2].into_iter().flat_map(|dj| [0, 1, 2].map(|di| (di, dj))) {
                if !(1..=ni).contains(&(i + di)) || !(1..=nj).contains(&(j + dj)) {
                    continue;
                }
                let m = (j + dj - 1) * ni + i + di - 1;
                let step = steps[dj][di];
                if mask[m] && way[n] + step < way[m].min(reach) {
                    way[m] = way[n] + step;
                    next.push(m);
                }
            }
        }
        front = next;
    }
    mask.iter_mut().zip(way).for_each(|(m, w)| *m &= w.is_finite());
}

/// Bilinear sample of an image at (x, y) pixels; `None` off the image.
#[inline]
pub(crate) fn bilinear<T: Copy>(
    image: &[T],
    ni: usize,
    at: [f32; 2],
    value: impl Fn(T) -> f32,
) -> Option<f32> {
    Some(Between::new([ni, image.len() / ni], at)?.sample(image, value))
}

/// A place between four pixels, for samples of several images.
#[derive(Clone, Copy)]
pub(crate) struct Between {
    n: usize,
    ni: usize,
    /// Share of the way to the next pixel and to the next row.
    share: [f32; 2],
}

impl Between {
    /// (x, y) pixels of an image of that size; `None` off it.
    #[inline]
    pub(crate) fn new([ni, nj]: [usize; 2], [x, y]: [f32; 2]) -> Option<Self> {
        if !(x >= 0.0 && y >= 0.0 && x < (ni - 1) as f32 && y < (nj - 1) as f32) {
            return None;
        }
        let (i, j) = (x as u32, y as u32);
        let share = [x - i as f32, y - j as f32];
        Some(Self { n: j as usize * ni + i as usize, ni, share })
    }

    /// Bilinear sample.
    #[inline]
    pub(crate) fn sample<T: Copy>(self, image: &[T], value: impl Fn(T) -> f32) -> f32 {
        let Self { n, ni, share: [s, t] } = self;
        let (top, bottom) = (&image[n..n + 2], &image[n + ni..n + ni + 2]);
        let top = value(top[0]) * (1.0 - s) + value(top[1]) * s;
        let bottom = value(bottom[0]) * (1.0 - s) + value(bottom[1]) * s;
        top * (1.0 - t) + bottom * t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_equals_brute_force() {
        let (ni, nj, s) = (17, 12, [0.7f32, 1.3]);
        let on: Vec<bool> = (0..ni * nj).map(|n| n * 37 % 29 == 0).collect();
        let reach = 2.0;
        let got = squared_distance(&on, ni, s, reach);
        for n in 0..ni * nj {
            let want = (0..ni * nj)
                .filter(|&m| on[m])
                .map(|m| {
                    let dx = (m % ni).abs_diff(n % ni) as f32 * s[0];
                    let dy = (m / ni).abs_diff(n / ni) as f32 * s[1];
                    dx * dx + dy * dy
                })
                .fold(f32::INFINITY, f32::min);
            let want = if want <= reach * reach { want } else { f32::INFINITY };
            assert!(got[n] == want || (got[n] - want).abs() < 1e-3, "{n}: {} {want}", got[n]);
        }
        assert!(got.iter().any(|d| d.is_infinite()) && got.iter().any(|d| (1.0..4.0).contains(d)));
        assert!(squared_distance(&[false; 6], 3, s, 100.0).iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn only_closed_holes_are_filled() {
        let picture = ["#####", "#..##", "#.#.#", "###..", "#.###"];
        let mut mask: Vec<bool> = picture.concat().chars().map(|c| c == '#').collect();
        fill_holes(&mut mask, 5);
        let shown: String = mask.iter().map(|&m| if m { '#' } else { '.' }).collect();
        assert_eq!(shown, ["#####", "#####", "###.#", "###..", "#.###"].concat());
    }
}

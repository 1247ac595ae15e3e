//! Closed contours of one plane: signed distances.

use rayon::prelude::*;
use supine_volume::Outlines;

/// Pixel centres of a plane: `low + step * (i, j)`, mm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pixels {
    pub(crate) low: [f64; 2],
    pub(crate) step: f64,
    pub(crate) size: [usize; 2],
}

impl Pixels {
    /// Pixels that hold contours with two more on each side.
    pub(crate) fn around(corners: impl Iterator<Item = [f64; 2]>, step: f64) -> Self {
        let mut reach = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for corner in corners {
            for a in 0..2 {
                reach[a] = [reach[a][0].min(corner[a]), reach[a][1].max(corner[a])];
            }
        }
        let low = reach.map(|[low, _]| low - 2.0 * step);
        let size = [0, 1].map(|a| ((reach[a][1] - low[a]) / step).ceil() as usize + 3);
        Self { low, step, size }
    }

    fn len(&self) -> usize {
        self.size[0] * self.size[1]
    }

    fn centre(&self, n: usize) -> [f64; 2] {
        let at = [n % self.size[0], n / self.size[0]];
        [0, 1].map(|a| self.low[a] + self.step * at[a] as f64)
    }
}

type Segment = [[f64; 2]; 2];

/// Distance of each pixel centre from the edge of what contours hold, mm, negative inside.
///
/// The nearest segment of each pixel is handed on from pixel to pixel, forwards and backwards, as
/// in Danielsson's sequential distance map (Comput. Graph. Image Process. 14, 1980), and from there
/// to the segments before and after it: exact beside the contours, elsewhere wrong by up to a fifth
/// of a pixel.
pub(crate) fn signed_distance(pixels: &Pixels, outlines: &Outlines) -> Vec<f32> {
    let segments = edge(outlines, pixels.step);
    let mut nearest = vec![(u32::MAX, f64::INFINITY); pixels.len()];
    let offer = |slot: &mut (u32, f64), n: usize, number: u32| {
        let Some(segment) = segments.get(number as usize) else { return };
        let square = square_distance(pixels.centre(n), segment);
        if square < slot.1 {
            *slot = (number, square);
        }
    };
    let [ni, nj] = pixels.size;
    for (number, [a, b]) in segments.iter().enumerate() {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let steps = (2.0 * length / pixels.step).ceil().max(1.0) as usize;
        for n in 0..=steps {
            let t = n as f64 / steps as f64;
            let index = [0, 1].map(|c| (a[c] + (b[c] - a[c]) * t - pixels.low[c]) / pixels.step);
            for corner in 0..4 {
                let i = index[0] as usize + (corner & 1);
                let j = index[1] as usize + (corner >> 1);
                if i < ni && j < nj {
                    offer(&mut nearest[j * ni + i], j * ni + i, number as u32);
                }
            }
        }
    }
    let sweep = |nearest: &mut Vec<(u32, f64)>, n: usize| {
        let (i, j) = ((n % ni) as isize, (n / ni) as isize);
        for (di, dj) in NEIGHBOURS {
            let (i, j) = (i + di, j + dj);
            if (0..ni as isize).contains(&i) && (0..nj as isize).contains(&j) {
                let number = nearest[j as usize * ni + i as usize].0;
                offer(&mut nearest[n], n, number);
            }
        }
        let number = nearest[n].0;
        offer(&mut nearest[n], n, number.wrapping_sub(1));
        offer(&mut nearest[n], n, number.wrapping_add(1));
    };
    (0..pixels.len()).for_each(|n| sweep(&mut nearest, n));
    (0..pixels.len()).rev().for_each(|n| sweep(&mut nearest, n));
    let inside = inside(pixels, outlines);
    let pairs = nearest.iter().zip(inside);
    let signed = |(&(_, square), inside): (&(u32, f64), bool)| {
        square.sqrt() * if inside { -1.0 } else { 1.0 }
    };
    pairs.map(|pair| signed(pair) as f32).collect()
}

const NEIGHBOURS: [(isize, isize); 8] =
    [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)];

fn square_distance(p: [f64; 2], [a, b]: &Segment) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = along[0] * along[0] + along[1] * along[1];
    let t = (to[0] * along[0] + to[1] * along[1]) / square;
    // A segment without length is a point.
    let t = if t.is_finite() { t.clamp(0.0, 1.0) } else { 0.0 };
    let off = [to[0] - t * along[0], to[1] - t * along[1]];
    off[0] * off[0] + off[1] * off[1]
}

/// The segments that have inside and outside beside them: of contours that cross or lie upon each
/// other, pieces of at most a pixel.
fn edge(outlines: &Outlines, step: f64) -> Vec<Segment> {
    let contours = outlines.contours().iter();
    let segments = contours.flat_map(|c| (0..c.len()).map(|n| [c[n], c[(n + 1) % c.len()]]));
    if !outlines.overlap() {
        return segments.collect();
    }
    let pieces = segments.flat_map(|[a, b]| {
        let count = ((b[0] - a[0]).hypot(b[1] - a[1]) / step).ceil().max(1.0);
        let at = move |n: f64| [0, 1].map(|c| a[c] + (b[c] - a[c]) * n / count);
        (0..count as usize).map(move |n| [at(n as f64), at(n as f64 + 1.0)])
    });
    pieces.filter(|piece| is_edge(outlines, piece, ASIDE * step)).collect()
}

/// How far beside a segment it is looked whether there is inside, pixels.
const ASIDE: f64 = 0.05;

fn is_edge(outlines: &Outlines, [a, b]: &Segment, aside: f64) -> bool {
    let (middle, along) = ([0, 1].map(|c| f64::midpoint(a[c], b[c])), [b[0] - a[0], b[1] - a[1]]);
    let length = along[0].hypot(along[1]);
    if length == 0.0 {
        return false;
    }
    let off = [-along[1] / length * aside, along[0] / length * aside];
    let holds = |sign: f64| {
        let [x, y] = [0, 1].map(|c| middle[c] + sign * off[c]);
        outlines.line(y).iter().any(|[from, to]| *from <= x && x < *to)
    };
    holds(1.0) != holds(-1.0)
}

/// Which pixel centres lie inside.
fn inside(pixels: &Pixels, outlines: &Outlines) -> Vec<bool> {
    let [ni, _] = pixels.size;
    let mut inside = vec![false; pixels.len()];
    inside.par_chunks_mut(ni).enumerate().for_each(|(j, row)| {
        for line in outlines.line(pixels.low[1] + pixels.step * j as f64) {
            let column = |x: f64| ((x - pixels.low[0]) / pixels.step).ceil().clamp(0.0, ni as f64);
            let [first, end] = line.map(|x| column(x) as usize);
            row[first..end.max(first)].fill(true);
        }
    });
    inside
}

#[cfg(test)]
mod tests {
    use super::*;
    use supine_volume::Rule;

    #[test]
    fn a_ring_has_the_known_distance() {
        let circle = |radius: f64| -> Vec<[f64; 2]> {
            let at = |n: usize| (n as f64 * std::f64::consts::TAU / 256.0).sin_cos();
            (0..256).map(|n| [radius * at(n).1, radius * at(n).0]).collect()
        };
        // Near-equal contours are one region, so the larger of two is the edge of what they hold.
        let drawn: [(&[f64], f64); 3] =
            [(&[20.0, 8.0], 8.0), (&[20.0, 8.0, 20.0, 8.0, 8.3], 8.3), (&[8.0, 19.6, 20.0], 8.0)];
        for (radii, hole) in drawn {
            a_ring(radii.iter().copied().map(circle).collect(), hole);
        }
    }

    fn a_ring(contours: Vec<Vec<[f64; 2]>>, hole: f64) {
        let outlines = Outlines::new(contours, [1.0, 1.0], Rule::Joined);
        let pixels = Pixels::around(outlines.contours().iter().flatten().copied(), 0.7);
        for (n, &found) in signed_distance(&pixels, &outlines).iter().enumerate() {
            let [x, y] = pixels.centre(n);
            let radius = x.hypot(y);
            let want = (radius - 20.0).max(hole - radius);
            // Beside a contour only its corners keep it from the circle.
            let bound = if want.abs() < pixels.step { 0.003 } else { 0.2 * pixels.step };
            assert!((f64::from(found) - want).abs() < bound, "{found} for {want} at {x} {y}");
        }
    }
}

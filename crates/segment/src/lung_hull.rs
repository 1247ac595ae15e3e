//! The convex hull of the lungs in a slice: what lies in it is no breast, and nothing under the
//! skin.

use crate::body::flag;
use crate::frame::Frame;

/// The convex hull of the lungs in a slice.
pub(crate) struct Hull {
    /// Whether each pixel lies in it.
    pub(crate) inside: Vec<bool>,
    /// Its pixels.
    pub(crate) area: usize,
    /// Middle of the hull towards the back, mm.
    pub(crate) middle: f32,
}

impl Hull {
    /// The hull in a slice of these flags; `None` without lung.
    pub(crate) fn new(frame: &Frame, flags: &[u8]) -> Option<Self> {
        let ni = frame.size[0];
        let mut corners = Vec::new();
        for (j, row) in flags.chunks_exact(ni).enumerate() {
            let lung = |f: &u8| f & flag::LUNG != 0;
            if let (Some(a), Some(b)) = (row.iter().position(lung), row.iter().rposition(lung)) {
                corners.extend([[a as i64, j as i64], [b as i64, j as i64]]);
            }
        }
        let (first, last) = (corners.first()?[1], corners.last()?[1]);
        // Rows run in order, so each side of the hull is one chain.
        let left = chain(corners.iter().step_by(2).copied(), -1);
        let right = chain(corners.iter().skip(1).step_by(2).copied(), 1);
        let mut inside = vec![false; flags.len()];
        let (mut area, mut back) = (0, 0.0f64);
        for j in first..=last {
            let (a, b) = (crossing(&left, j).ceil() as usize, crossing(&right, j).floor() as usize);
            for n in j as usize * ni + a..=j as usize * ni + b {
                inside[n] = true;
                area += 1;
                back += f64::from(to_back(frame, n));
            }
        }
        Some(Self { inside, area, middle: (back / area as f64) as f32 })
    }
}

/// One side of the hull of points in order of their rows; `side` 1 bends it to higher i.
fn chain(points: impl Iterator<Item = [i64; 2]>, side: i64) -> Vec<[i64; 2]> {
    let mut hull: Vec<[i64; 2]> = Vec::new();
    for p in points {
        while let [.., a, b] = hull[..] {
            let turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            if turn * side > 0 {
                break;
            }
            hull.pop();
        }
        hull.push(p);
    }
    hull
}

/// Where a chain crosses a row, pixels.
fn crossing(chain: &[[i64; 2]], row: i64) -> f64 {
    let after = chain.partition_point(|p| p[1] < row).min(chain.len() - 1);
    let ([x1, y1], [x0, y0]) = (chain[after], chain[after.saturating_sub(1)]);
    if y1 == y0 {
        return x1 as f64;
    }
    x0 as f64 + (x1 - x0) as f64 * (row - y0) as f64 / (y1 - y0) as f64
}

/// Distance of a pixel towards the back, mm.
pub(crate) fn to_back(frame: &Frame, n: usize) -> f32 {
    let [x, y] = frame.position(n);
    x * frame.back[0] + y * frame.back[1]
}

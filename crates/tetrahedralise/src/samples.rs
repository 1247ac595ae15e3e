//! Functions known at the points of a box.

use supine_space::Vector;

/// Values at the points of a box, N at each, trilinear between them and constant beyond the box.
#[derive(Debug)]
pub(crate) struct Samples<const N: usize> {
    size: [usize; 3],
    /// Offset in memory to the next point along each axis; 0 where there is none.
    stride: [usize; 3],
    spacing: Vector,
    low: Vector,
    values: Vec<[f32; N]>,
}

/// Where a place lies between the points.
struct Cell {
    base: usize,
    /// Share of the way to the next point along each axis.
    t: [f64; 3],
    /// Whether the place lies in the box, along each axis.
    inside: [bool; 3],
}

impl<const N: usize> Samples<N> {
    /// Points from `low` on, `spacing` apart (mm), the first axis fastest.
    pub(crate) fn new(
        size: [usize; 3],
        spacing: Vector,
        low: Vector,
        values: Vec<[f32; N]>,
    ) -> Self {
        debug_assert_eq!(values.len(), size.iter().product::<usize>());
        let stride = [1, size[0], size[0] * size[1]];
        let stride = [0, 1, 2].map(|a| if size[a] > 1 { stride[a] } else { 0 });
        Self { size, stride, spacing, low, values }
    }

    #[inline]
    fn cell(&self, p: &Vector) -> Cell {
        let mut cell = Cell { base: 0, t: [0.0; 3], inside: [false; 3] };
        for a in 0..3 {
            let raw = (p[a] - self.low[a]) / self.spacing[a];
            let q = raw.clamp(0.0, (self.size[a] - 1) as f64);
            let at = (q as usize).min(self.size[a].saturating_sub(2));
            cell.base += at * self.stride[a];
            cell.t[a] = q - at as f64;
            cell.inside[a] = (q - raw).abs() <= 0.0 && self.stride[a] > 0;
        }
        cell
    }

    /// One of the values at the corners of a cell, first axis fastest.
    #[inline]
    fn corners(&self, cell: &Cell, which: usize) -> [f64; 8] {
        let [i, j, k] = self.stride;
        let at = [0, i, j, i + j, k, i + k, j + k, i + j + k];
        at.map(|offset| f64::from(self.values[cell.base + offset][which]))
    }

    /// One of the values at `p`.
    #[inline]
    pub(crate) fn value(&self, which: usize, p: &Vector) -> f64 {
        let cell = self.cell(p);
        self.mixed(&cell, which).0
    }

    /// One of the values at `p`, and its gradient per mm.
    #[inline]
    pub(crate) fn value_gradient(&self, which: usize, p: &Vector) -> (f64, Vector) {
        let cell = self.cell(p);
        let (value, rise) = self.mixed(&cell, which);
        let slope = |a: usize| if cell.inside[a] { rise[a] / self.spacing[a] } else { 0.0 };
        (value, Vector::new(slope(0), slope(1), slope(2)))
    }

    /// One of the values in a cell, and its rise per step along each axis.
    #[inline]
    fn mixed(&self, cell: &Cell, which: usize) -> (f64, [f64; 3]) {
        let (c, t) = (self.corners(cell, which), cell.t);
        let rise = |n: usize| c[n + 1] - c[n];
        let (d0, d2, d4, d6) = (rise(0), rise(2), rise(4), rise(6));
        let (x0, x2) = (c[0] + d0 * t[0], c[2] + d2 * t[0]);
        let (x4, x6) = (c[4] + d4 * t[0], c[6] + d6 * t[0]);
        let (y0, y4) = (x0 + (x2 - x0) * t[1], x4 + (x6 - x4) * t[1]);
        let (e0, e4) = (d0 + (d2 - d0) * t[1], d4 + (d6 - d4) * t[1]);
        let along = (x2 - x0) + ((x6 - x4) - (x2 - x0)) * t[2];
        (y0 + (y4 - y0) * t[2], [e0 + (e4 - e0) * t[2], along, y4 - y0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is linear in each coordinate is met exactly, with its gradient; beyond it is constant.
    #[test]
    fn a_product_of_coordinates_is_met_exactly() {
        let (size, spacing) = ([4, 3, 5], Vector::new(0.5, 2.0, 1.0));
        let low = Vector::new(-1.0, 1.0, 3.0);
        let f = |p: &Vector| 2.0 * p.x * p.y - p.z + p.x * p.y * p.z;
        let mut values = Vec::new();
        for n in 0..60 {
            let at = [n % 4, n / 4 % 3, n / 12];
            let p = low + Vector::from_fn(|a, _| at[a] as f64 * spacing[a]);
            values.push([0.0, f(&p) as f32]);
        }
        let samples = Samples::new(size, spacing, low, values);
        let p = Vector::new(-0.3, 2.7, 5.2);
        let (value, slope) = samples.value_gradient(1, &p);
        let want = Vector::new(2.0 * p.y + p.y * p.z, 2.0 * p.x + p.x * p.z, p.x * p.y - 1.0);
        assert!((value - f(&p)).abs() < 1e-5 && (slope - want).norm() < 1e-4, "{value} {slope}");
        assert!((samples.value(1, &p) - value).abs() < 1e-12);
        let (value, slope) = samples.value_gradient(1, &Vector::new(9.0, 2.0, 4.0));
        assert!((value - f(&Vector::new(0.5, 2.0, 4.0))).abs() < 1e-5, "{value}");
        assert!(slope.x == 0.0 && slope.y != 0.0, "{slope}");
    }
}

//! Functions known at the points of a box.

use supine_space::Vector;
use supine_volume::Cell;

/// Values at the points of a box, N at each, trilinear between them and constant beyond the box.
#[derive(Debug)]
pub(crate) struct Samples<const N: usize> {
    size: [usize; 3],
    spacing: Vector,
    low: Vector,
    values: Vec<[f32; N]>,
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
        Self { size, spacing, low, values }
    }

    /// A place as a continuous index.
    #[inline]
    fn index(&self, p: &Vector) -> [f64; 3] {
        [0, 1, 2].map(|a| (p[a] - self.low[a]) / self.spacing[a])
    }

    /// One of the values at an index, and its rise per step along each axis.
    #[inline]
    fn mixed(&self, index: [f64; 3], which: usize) -> (f64, [f64; 3]) {
        let cell = Cell::new(self.size, index);
        cell.mix_with_rise(&cell.corners().map(|n| f64::from(self.values[n][which])))
    }

    /// One of the values at `p`.
    #[inline]
    pub(crate) fn value(&self, which: usize, p: &Vector) -> f64 {
        self.mixed(self.index(p), which).0
    }

    /// One of the values at `p`, and its gradient per mm.
    #[inline]
    pub(crate) fn value_gradient(&self, which: usize, p: &Vector) -> (f64, Vector) {
        let index = self.index(p);
        let (value, rise) = self.mixed(index, which);
        let slope = |a: usize| {
            let within = (0.0..=(self.size[a] - 1) as f64).contains(&index[a]);
            if within && self.size[a] > 1 { rise[a] / self.spacing[a] } else { 0.0 }
        };
        (value, Vector::new(slope(0), slope(1), slope(2)))
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

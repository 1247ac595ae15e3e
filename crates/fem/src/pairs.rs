//! What the last corrections say of the tissue's tangent beyond a kept factor of it, in closed
//! form.
//!
//! With steps S, changes of the forces Y over them and H₀ the inverse that the factor gives, the
//! L-BFGS inverse is H = H₀ + W M Wᵀ, W = [S, H₀ Y] (Byrd, Nocedal and Schnabel, Math. Program. 63,
//! 1994, eq. 3.1 with any H₀). In this form its blocks between a few nodes cost as little as those
//! of H₀.

use crate::quasi_newton::dot;
use nalgebra::{DMatrix, DVector};

/// Pairs kept.
const PAIRS: usize = 8;
/// A pair counts when the cosine of step and change is above this: else it says that the energy is
/// not convex there, or is rounding.
const MIN_COSINE: f64 = 1e-6;

/// A step, the change of the forces over it, and H₀ times that.
#[derive(Debug)]
pub(crate) struct Pair {
    pub(crate) step: Vec<f64>,
    pub(crate) change: Vec<f64>,
    pub(crate) undone: Vec<f64>,
}

/// The last pairs.
#[derive(Debug, Default)]
pub(crate) struct Pairs {
    pairs: Vec<Pair>,
    /// M.
    middle: DMatrix<f64>,
}

impl Pairs {
    /// Keeps a pair if it is of use.
    pub(crate) fn keep(&mut self, pair: Pair) {
        let along = dot(&pair.step, &pair.change);
        let lengths = (dot(&pair.step, &pair.step) * dot(&pair.change, &pair.change)).sqrt();
        if !(along > MIN_COSINE * lengths && along.is_finite()) {
            return;
        }
        if self.pairs.len() == PAIRS {
            self.pairs.remove(0);
        }
        self.pairs.push(pair);
        match self.between() {
            Some(middle) => self.middle = middle,
            None => self.forget(),
        }
    }

    /// Forgets all pairs: H is H₀.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// M = [R⁻ᵀ (D + Yᵀ H₀ Y) R⁻¹, −R⁻ᵀ; −R⁻¹, 0], R the upper triangle of Sᵀ Y and D its diagonal.
    fn between(&self) -> Option<DMatrix<f64>> {
        let (all, n) = (&self.pairs, self.pairs.len());
        let upper = |i: usize, k: usize| {
            if i <= k { dot(&all[i].step, &all[k].change) } else { 0.0 }
        };
        let r = DMatrix::from_fn(n, n, upper);
        let inverse = r.clone().try_inverse()?;
        let own = |i: usize, k: usize| {
            let one = dot(&all[i].change, &all[k].undone);
            let mean = 0.5 * (one + dot(&all[k].change, &all[i].undone));
            if i == k { r[(i, i)] + mean } else { mean }
        };
        let own = DMatrix::from_fn(n, n, own);
        let mut middle = DMatrix::zeros(2 * n, 2 * n);
        middle.view_mut((0, 0), (n, n)).copy_from(&(inverse.transpose() * own * &inverse));
        middle.view_mut((0, n), (n, n)).copy_from(&-inverse.transpose());
        middle.view_mut((n, 0), (n, n)).copy_from(&-inverse);
        middle.iter().all(|v| v.is_finite()).then_some(middle)
    }

    /// The columns of W.
    fn columns(&self) -> impl Iterator<Item = &[f64]> {
        let steps = self.pairs.iter().map(|pair| &pair.step[..]);
        steps.chain(self.pairs.iter().map(|pair| &pair.undone[..]))
    }

    /// M.
    pub(crate) fn middle(&self) -> &DMatrix<f64> {
        &self.middle
    }

    /// The rows of W at unknowns that begin, three each, at `rows`.
    pub(crate) fn local(&self, rows: &[usize]) -> DMatrix<f64> {
        let own = |column: &[f64]| -> Vec<f64> {
            rows.iter().flat_map(|&row| [column[row], column[row + 1], column[row + 2]]).collect()
        };
        let entries: Vec<f64> = self.columns().flat_map(own).collect();
        DMatrix::from_vec(3 * rows.len(), 2 * self.pairs.len(), entries)
    }

    /// Adds W M Wᵀ x to `to`: with H₀ x it is H x.
    pub(crate) fn add(&self, x: &[f64], to: &mut [f64]) {
        if self.pairs.is_empty() {
            return;
        }
        let parts: Vec<f64> = self.columns().map(|column| dot(column, x)).collect();
        let weights = &self.middle * DVector::from_vec(parts);
        for (column, weight) in self.columns().zip(weights.iter()) {
            to.iter_mut().zip(column).for_each(|(to, c)| *to += weight * c);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MATRIX: [[f64; 3]; 3] = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];

    fn times(x: &[f64]) -> Vec<f64> {
        MATRIX.iter().map(|row| dot(row, x)).collect()
    }

    /// H₀ is any: here a diagonal.
    fn undone(x: &[f64]) -> Vec<f64> {
        x.iter().zip([0.3, 0.2, 0.7]).map(|(x, d)| x * d).collect()
    }

    fn inverse(pairs: &Pairs, x: &[f64]) -> Vec<f64> {
        let mut found = undone(x);
        pairs.add(x, &mut found);
        found
    }

    fn keep(pairs: &mut Pairs, step: &[f64]) {
        let change = times(step);
        pairs.keep(Pair { step: step.to_vec(), undone: undone(&change), change });
    }

    #[test]
    fn the_last_change_is_undone_and_a_whole_basis_gives_the_inverse() {
        let mut pairs = Pairs::default();
        // Steps conjugate to each other.
        let first = [1.0, 0.0, 0.0];
        let second = [-0.25, 1.0, 0.0];
        let bend = dot(&second, &times(&[0.0, 0.0, 1.0])) / dot(&second, &times(&second));
        let third: Vec<f64> = [-0.125 + 0.25 * bend, -bend, 1.0].to_vec();
        assert!(dot(&third, &times(&first)).abs() < 1e-12);
        for step in [&first[..], &second, &third] {
            keep(&mut pairs, step);
            let back = inverse(&pairs, &times(step));
            assert!(back.iter().zip(step).all(|(a, b)| (a - b).abs() < 1e-12), "{back:?}");
        }
        let x = [0.7, -0.2, 1.3];
        let back = inverse(&pairs, &times(&x));
        assert!(back.iter().zip(x).all(|(a, b)| (a - b).abs() < 1e-12), "{back:?}");
    }

    #[test]
    fn blocks_are_those_of_the_whole() {
        let mut pairs = Pairs::default();
        keep(&mut pairs, &[0.3, -1.0, 0.4]);
        keep(&mut pairs, &[0.5, 0.2, -0.9]);
        let w = pairs.local(&[0]);
        let block = &w * pairs.middle() * w.transpose();
        for k in 0..3 {
            let unit: Vec<f64> = (0..3).map(|i| f64::from(u8::from(i == k))).collect();
            let mut column = vec![0.0; 3];
            pairs.add(&unit, &mut column);
            (0..3).for_each(|i| assert!((column[i] - block[(i, k)]).abs() < 1e-12));
        }
    }

    #[test]
    fn a_pair_against_convexity_is_not_kept_and_old_ones_go() {
        let mut pairs = Pairs::default();
        let bad = Pair { step: vec![1.0; 3], change: vec![-1.0; 3], undone: vec![-1.0; 3] };
        pairs.keep(bad);
        assert!(pairs.pairs.is_empty() && inverse(&pairs, &[1.0; 3]) == undone(&[1.0; 3]));
        (0..2 * PAIRS).for_each(|k| keep(&mut pairs, &[1.0, 0.1 * k as f64, -0.3]));
        assert_eq!(pairs.pairs.len(), PAIRS);
        pairs.forget();
        assert_eq!(inverse(&pairs, &[1.0; 3]), undone(&[1.0; 3]));
    }
}

//! Dense symmetric matrices of some hundred rows.

use crate::analysis::buffer;
use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::{factor, solve};
use faer::{MatMut, MatRef, Par, Spec};
use nalgebra::DMatrix;

/// The Cholesky factor of a positive definite matrix. The same bytes on any number of threads.
pub(crate) struct Positive(DMatrix<f64>);

impl Positive {
    /// `None` when the matrix, of which the lower triangle is read, is not positive definite, or
    /// memory is short.
    pub(crate) fn new(mut matrix: DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let params = Spec::default();
        let mut work =
            buffer(factor::cholesky_in_place_scratch::<f64>(n, Par::Seq, params)).ok()?;
        let own = MatMut::from_column_major_slice_mut(matrix.as_mut_slice(), n, n);
        let stack = MemStack::new(&mut work);
        factor::cholesky_in_place(own, Default::default(), Par::Seq, stack, params).ok()?;
        matrix.iter().all(|v| v.is_finite()).then_some(Self(matrix))
    }

    /// The matrix's inverse times `right`.
    pub(crate) fn solve(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let (n, columns) = right.shape();
        let mut solution = right.clone();
        let own = MatRef::from_column_major_slice(self.0.as_slice(), n, n);
        let all = MatMut::from_column_major_slice_mut(solution.as_mut_slice(), n, columns);
        // It asks for no work space.
        solve::solve_in_place(own, all, Par::Seq, MemStack::new(&mut []));
        solution
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_inverse_and_only_of_positive_definite_matrices() {
        for n in [0, 1, 7, 130] {
            let root = DMatrix::from_fn(n, n, |i, k| ((7 * i + 3 * k * k) % 11) as f64 - 5.0);
            let matrix = &root * root.transpose() + DMatrix::identity(n, n);
            let right = DMatrix::from_fn(n, 5, |i, k| (i as f64 - 2.0 * k as f64).sin());
            let found = Positive::new(matrix.clone()).unwrap().solve(&right);
            assert!((&matrix * &found - &right).iter().all(|v| v.abs() < 1e-9), "{n}");
            let other = nalgebra::Cholesky::new(matrix.clone());
            assert!(n == 0 || (other.unwrap().solve(&right) - found).amax() < 1e-9);
            if n > 0 {
                assert!(Positive::new(matrix - DMatrix::identity(n, n) * 1e6).is_none());
            }
        }
        assert!(Positive::new(DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }
}

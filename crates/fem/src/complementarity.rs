//! Linear complementarity: λ ≥ 0, w = Q λ + b ≥ 0, λ · w = 0 with Q symmetric and positive
//! definite.
//!
//! Block principal pivoting (Júdice and Pires, Comput. Oper. Res. 21, 1994): the set of the λ that
//! are not zero is guessed, the guess is corrected at all indices that contradict it, and, where
//! that no longer lessens their number, at the last one alone (Murty, Opsearch 11, 1974), which
//! ends after finitely many changes.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Changes of the whole set without gain before single ones.
const PATIENCE: usize = 5;
/// Changes per unknown before it is given up. Only rounding can lead there.
const CHANGES: usize = 30;
/// Share by which the diagonal of Q is raised: rows that are the same, as of a node that touches
/// two surfaces of the same normal, then have one solution, the sum shared.
const RAISED: f64 = 1e-9;
/// What is negative by less, as a share of the largest b, is rounding.
const ROUNDING: f64 = 1e-11;

/// The solution λ; `start` guesses which are not zero. Same input, same bytes, and the same set
/// from any guess where the solution is strictly complementary.
///
/// `None` when Q is not positive definite or a number is not finite.
pub(crate) fn complementary(
    q: &DMatrix<f64>,
    b: &DVector<f64>,
    start: &[bool],
) -> Option<DVector<f64>> {
    let n = b.len();
    if !b.iter().all(|b| b.is_finite()) {
        return None;
    }
    let largest = b.amax();
    let low = -ROUNDING * largest;
    let mut active = start.to_vec();
    active.resize(n, false);
    let (mut fewest, mut patience) = (n + 1, PATIENCE);
    for _ in 0..CHANGES * (n + 1) {
        let lambda = balanced(q, b, &active)?;
        let w = q * &lambda + b;
        // Both in the unit of w.
        let wrong = |i: usize| {
            if active[i] { lambda[i] * q[(i, i)] < low } else { w[i] < low }
        };
        let wrong: Vec<usize> = (0..n).filter(|&i| wrong(i)).collect();
        let Some(&last) = wrong.last() else {
            return Some(lambda.map(|l| l.max(0.0)));
        };
        let all = wrong.len() < fewest || patience > 0;
        if wrong.len() < fewest {
            (fewest, patience) = (wrong.len(), PATIENCE);
        } else {
            patience = patience.saturating_sub(1);
        }
        let changed = if all { &wrong[..] } else { std::slice::from_ref(&last) };
        changed.iter().for_each(|&i| active[i] = !active[i]);
    }
    None
}

/// λ with w = 0 where it is `active`, zero elsewhere.
fn balanced(q: &DMatrix<f64>, b: &DVector<f64>, active: &[bool]) -> Option<DVector<f64>> {
    let set: Vec<usize> = (0..b.len()).filter(|&i| active[i]).collect();
    let mut lambda = DVector::zeros(b.len());
    if set.is_empty() {
        return Some(lambda);
    }
    let raised = |i: usize, k: usize| {
        let entry = q[(set[i], set[k])];
        if i == k { entry * (1.0 + RAISED) } else { entry }
    };
    let own = DMatrix::from_fn(set.len(), set.len(), raised);
    let right = DVector::from_fn(set.len(), |i, _| -b[set[i]]);
    let solution = Cholesky::new(own)?.solve(&right);
    set.iter().zip(solution.iter()).for_each(|(&i, l)| lambda[i] = *l);
    lambda.iter().all(|l| l.is_finite()).then_some(lambda)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The solution among all sets, by trying each.
    fn by_trial(q: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
        let n = b.len();
        let low = -1e-9 * b.amax().max(1.0);
        (0..1usize << n).find_map(|bits| {
            let active: Vec<bool> = (0..n).map(|i| bits >> i & 1 == 1).collect();
            let lambda = balanced(q, b, &active)?;
            let w = q * &lambda + b;
            let fits = |i: usize| if active[i] { lambda[i] >= low } else { w[i] >= low };
            (0..n).all(fits).then_some(lambda)
        })
    }

    proptest! {
        #[test]
        fn it_is_the_one_found_by_trying_every_set(
            n in 1usize..=8,
            entries in proptest::collection::vec(-1.0f64..1.0, 64),
            right in proptest::collection::vec(-1.0f64..1.0, 8),
            guess in proptest::collection::vec(any::<bool>(), 8),
        ) {
            let factor = DMatrix::from_fn(n, n, |i, k| entries[8 * i + k]);
            let q = &factor * factor.transpose() + DMatrix::identity(n, n) * 0.05;
            let b = DVector::from_fn(n, |i, _| right[i]);
            let found = complementary(&q, &b, &guess[..n]).unwrap();
            let tried = by_trial(&q, &b).unwrap();
            prop_assert!((&found - &tried).amax() < 1e-6, "{found} {tried}");
            prop_assert_eq!(found, complementary(&q, &b, &guess[..n]).unwrap());
        }
    }

    #[test]
    fn equal_rows_share_their_force() {
        let q = DMatrix::from_row_slice(3, 3, &[2.0, 2.0, 0.5, 2.0, 2.0, 0.5, 0.5, 0.5, 1.0]);
        let b = DVector::from_row_slice(&[-1.0, -1.0, 3.0]);
        for start in [[false; 3], [true; 3], [true, false, true], [false, true, false]] {
            let found = complementary(&q, &b, &start).unwrap();
            assert!((found[0] + found[1] - 0.5).abs() < 1e-8, "{found}");
            assert!((found[0] - found[1]).abs() < 1e-6 && found[2] == 0.0, "{found}");
        }
    }

    #[test]
    fn what_just_touches_has_no_force() {
        let q = DMatrix::from_row_slice(2, 2, &[1.0, -0.9, -0.9, 1.0]);
        let zero = DVector::zeros(2);
        assert_eq!(complementary(&q, &zero, &[true, false]).unwrap(), zero);
        let apart = DVector::from_row_slice(&[0.0, 2.0]);
        assert_eq!(complementary(&q, &apart, &[true, true]).unwrap(), zero);
    }

    #[test]
    fn what_is_no_problem_has_no_solution() {
        let q = DMatrix::from_row_slice(2, 2, &[1.0, 3.0, 3.0, 1.0]);
        let b = DVector::from_row_slice(&[-1.0, -1.0]);
        assert!(complementary(&q, &b, &[true, true]).is_none());
        let b = DVector::from_row_slice(&[f64::NAN, -1.0]);
        assert!(complementary(&DMatrix::identity(2, 2), &b, &[false; 2]).is_none());
        let none = DVector::zeros(0);
        assert_eq!(complementary(&DMatrix::zeros(0, 0), &none, &[]).unwrap(), none);
    }
}

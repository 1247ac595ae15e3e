//! Medians and other quantiles.

use std::cmp::Ordering;

/// A number with a total order.
pub trait Ordered: Copy {
    /// The order of the library's `total_cmp`.
    fn order(&self, other: &Self) -> Ordering;
}

impl Ordered for f32 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

impl Ordered for f64 {
    fn order(&self, other: &Self) -> Ordering {
        self.total_cmp(other)
    }
}

/// The value that `rank` others do not exceed; `None` when there are not so many. Puts the values
/// in another order.
pub fn ranked<T: Ordered>(values: &mut [T], rank: usize) -> Option<T> {
    (rank < values.len()).then(|| *values.select_nth_unstable_by(rank, T::order).1)
}

/// The median, the upper one of two; `None` of nothing. Puts the values in another order.
pub fn median<T: Ordered>(values: &mut [T]) -> Option<T> {
    ranked(values, values.len() / 2)
}

/// The value of the rank `share` (0..=1) of the last, rounded down; `None` of nothing. Puts the
/// values in another order.
pub fn quantile<T: Ordered>(values: &mut [T], share: f64) -> Option<T> {
    let last = values.len().checked_sub(1)?;
    ranked(values, (last as f64 * share) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_those_of_the_sorted_values() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0, 0.0f32];
        let of = |share| quantile(&mut values.to_vec(), share);
        assert_eq!([0.0, 0.5, 0.99, 1.0].map(of), [0.0, 2.0, 4.0, 5.0].map(Some));
        assert_eq!(
            (median(&mut values.to_vec()), ranked(&mut values.to_vec(), 6)),
            (Some(3.0), None)
        );
        assert_eq!((median::<f64>(&mut []), quantile::<f64>(&mut [], 0.5)), (None, None));
    }
}

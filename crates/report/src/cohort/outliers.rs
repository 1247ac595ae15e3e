//! What lies apart from the others: Tukey's fences, one and a half times the quartiles' distance
//! beyond them.

/// Fewer figures have no quartiles worth the name.
const FEWEST: usize = 5;
const FENCE: f64 = 1.5;

/// Quartiles of some figures, and beyond where one lies apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spread {
    pub(super) low: f64,
    pub(super) median: f64,
    pub(super) high: f64,
    /// None where there are too few figures to tell.
    pub(super) fences: Option<[f64; 2]>,
}

impl Spread {
    /// That of some figures; none of none.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len().checked_sub(1)?;
        // Linear between the figures on both sides.
        let at = |share: f64| {
            let place = share * last as f64;
            let (below, above) = (place.floor() as usize, place.ceil() as usize);
            sorted[below] + (sorted[above] - sorted[below]) * (place - place.floor())
        };
        let (low, median, high) = (at(0.25), at(0.5), at(0.75));
        let room = FENCE * (high - low);
        let fences = (sorted.len() >= FEWEST).then_some([low - room, high + room]);
        Some(Self { low, median, high, fences })
    }

    /// Whether a figure lies apart.
    pub(super) fn is_apart(&self, x: f64) -> bool {
        self.fences.is_some_and(|[low, high]| x < low || x > high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_far_off_lies_apart_and_few_tell_nothing() {
        let spread = Spread::of([3.0, 1.0, 2.0, 4.0, 20.0].into_iter()).unwrap();
        assert_eq!((spread.low, spread.median, spread.high), (2.0, 3.0, 4.0));
        assert!(spread.is_apart(20.0) && !spread.is_apart(7.0) && spread.is_apart(-1.1));
        let few = Spread::of([1.0, 2.0, 90.0].into_iter()).unwrap();
        assert!(!few.is_apart(90.0));
        assert_eq!(Spread::of(std::iter::empty()), None);
        let one = Spread::of([5.0; 6].into_iter()).unwrap();
        assert!(one.is_apart(5.1) && !one.is_apart(5.0));
    }
}

//! How often each HU occurs.

use rayon::prelude::*;

/// Voxels that one thread counts at a time.
const PART: usize = 1 << 20;

/// Number of voxels of each HU from -32768 to 32767.
pub(super) struct Histogram(Vec<usize>);

impl Histogram {
    /// Counts all values.
    pub(super) fn of(hu: &[i16]) -> Self {
        let none = || vec![0; 1 << 16];
        let count = |mut counts: Vec<usize>, part: &[i16]| {
            part.iter().for_each(|&v| counts[bin(v)] += 1);
            counts
        };
        let join = |mut a: Vec<usize>, b: Vec<usize>| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
            a
        };
        Self(hu.par_chunks(PART).fold(none, count).reduce(none, join))
    }

    /// The numbers of the HU from `low` to `high`.
    pub(super) fn between(&self, low: i16, high: i16) -> &[usize] {
        &self.0[bin(low)..=bin(high)]
    }

    fn values(&self) -> impl Iterator<Item = (i64, usize)> {
        self.0.iter().enumerate().map(|(at, &n)| (at as i64 + i64::from(i16::MIN), n))
    }

    fn len(&self) -> usize {
        self.0.iter().sum()
    }

    /// Lowest and highest HU that occur; `None` of no voxels.
    pub(super) fn range(&self) -> Option<[i16; 2]> {
        let mut there = self.values().filter(|(_, n)| *n > 0).map(|(v, _)| v as i16);
        let low = there.next()?;
        Some([low, there.last().unwrap_or(low)])
    }

    fn sum(&self) -> i64 {
        self.values().map(|(v, n)| v * n as i64).sum()
    }

    /// Lower quartile, median and mean.
    pub(super) fn summary(&self) -> [f64; 3] {
        let rank = |rank: usize| {
            let mut seen = 0;
            let at = self.values().find(|(_, n)| {
                seen += n;
                seen > rank
            });
            at.map_or(0.0, |(v, _)| v as f64)
        };
        let count = self.len();
        [rank(count / 4), rank(count / 2), self.sum() as f64 / count.max(1) as f64]
    }

    /// Mean and standard deviation.
    pub(super) fn moments(&self) -> [f64; 2] {
        let count = self.len() as f64;
        let squares: i64 = self.values().map(|(v, n)| v * v * n as i64).sum();
        let mean = self.sum() as f64 / count;
        [mean, (squares as f64 / count - mean * mean).max(0.0).sqrt()]
    }
}

fn bin(hu: i16) -> usize {
    (i32::from(hu) - i32::from(i16::MIN)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_counted_is_what_is_there() {
        let hu = [-1000, -1000, -1000, 40, 60, 60, 1000, i16::MAX];
        let counted = Histogram::of(&hu);
        assert_eq!(counted.range(), Some([-1000, i16::MAX]));
        assert_eq!(counted.summary()[..2], [-1000.0, 60.0]);
        let mean = hu.iter().map(|&v| f64::from(v)).sum::<f64>() / 8.0;
        assert_eq!(counted.moments()[0], mean);
        assert_eq!(counted.between(40, 60).iter().sum::<usize>(), 3);
        assert_eq!(Histogram::of(&[]).range(), None);
    }
}

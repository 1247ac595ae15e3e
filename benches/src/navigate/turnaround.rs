//! When each pose was sent, and how long its answer took.

use serde_json::{Value, json};
use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Steps of the histogram in a decade, and the decades, as powers of ten of a ms.
const STEPS: i32 = 10;
const DECADES: std::ops::Range<i32> = -2..4;

/// Times under way, by stamp. Shared by the threads that send and receive.
#[derive(Debug, Default)]
pub(crate) struct Turnaround {
    sent: Mutex<HashMap<u64, Instant>>,
    answered: Mutex<HashMap<u64, Duration>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Turnaround {
    /// A pose goes out now. Of several with one stamp the first counts: that is the one which is
    /// followed.
    pub(crate) fn sends(&self, stamp: u64) {
        lock(&self.sent).entry(stamp).or_insert_with(Instant::now);
    }

    /// An answer was read now; a later one with the same stamp does not count.
    pub(crate) fn answers(&self, stamp: u64) {
        let Some(sent) = self.sent(stamp) else { return };
        lock(&self.answered).entry(stamp).or_insert_with(|| sent.elapsed());
    }

    /// When a pose was sent.
    pub(crate) fn sent(&self, stamp: u64) -> Option<Instant> {
        lock(&self.sent).get(&stamp).copied()
    }

    /// All times, ms.
    pub(crate) fn times_ms(&self) -> Vec<f64> {
        lock(&self.answered).values().map(|took| took.as_secs_f64() * 1e3).collect()
    }
}

/// Number, quantiles (nearest rank) and histogram of times, ms. The histogram: of each bin its
/// middle and its share of all.
pub(crate) fn summary(mut times_ms: Vec<f64>) -> Value {
    times_ms.sort_by(f64::total_cmp);
    let rank = |share: f64| {
        let n = (share * times_ms.len() as f64).ceil() as usize;
        times_ms.get(n.saturating_sub(1)).copied()
    };
    json!({
        "n": times_ms.len(),
        "median_ms": rank(0.5),
        "p95_ms": rank(0.95),
        "p99_ms": rank(0.99),
        "p999_ms": rank(0.999),
        "largest_ms": times_ms.last(),
        "histogram": histogram(&times_ms),
    })
}

/// Middles of bins that are equally wide on a logarithmic axis, ms, and the share of the times in
/// each, where there are any.
fn histogram(times_ms: &[f64]) -> Vec<[f64; 2]> {
    let mut counts = vec![0_usize; (DECADES.len() as i32 * STEPS) as usize];
    let last = counts.len() - 1;
    for ms in times_ms {
        let bin = (ms.log10() - f64::from(DECADES.start)) * f64::from(STEPS);
        // Casting takes what is below the first into it.
        counts[(bin as usize).min(last)] += 1;
    }
    let middle = |bin: usize| (bin as f64 + 0.5) / f64::from(STEPS) + f64::from(DECADES.start);
    let found = counts.iter().enumerate().filter(|(_, count)| **count > 0);
    found
        .map(|(bin, count)| [10f64.powf(middle(bin)), *count as f64 / times_ms.len() as f64])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_of_the_nearest_rank_and_the_histogram_holds_all() {
        let told = summary((1..=1000).rev().map(f64::from).collect());
        let of = |key: &str| told[key].as_f64().unwrap();
        assert_eq!([of("n"), of("median_ms"), of("p95_ms")], [1000.0, 500.0, 950.0]);
        assert_eq!([of("p99_ms"), of("p999_ms"), of("largest_ms")], [990.0, 999.0, 1000.0]);
        let bins = told["histogram"].as_array().unwrap();
        let sum: f64 = bins.iter().map(|bin| bin[1].as_f64().unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        assert!(summary(vec![])["median_ms"].is_null());
    }

    #[test]
    fn times_beyond_the_axis_are_in_its_first_and_last_bin() {
        let bins = histogram(&[1e-9, 1e9, 1e9]);
        assert_eq!(bins.len(), 2);
        assert!(bins[0][0] < 0.02 && bins[1][0] > 5000.0, "{bins:?}");
    }

    #[test]
    fn an_answer_counts_once_and_only_for_a_pose_that_was_sent() {
        let turnaround = Turnaround::default();
        turnaround.sends(7);
        turnaround.answers(7);
        turnaround.answers(7);
        turnaround.answers(8);
        assert_eq!(turnaround.times_ms().len(), 1);
    }
}

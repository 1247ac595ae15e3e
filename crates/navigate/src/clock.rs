//! How old a pose is, by two clocks that do not agree.
//!
//! The tracker's clock and ours differ by an unknown offset. The difference of arrival and stamp is
//! that offset plus the time under way; its minimum over a while belongs to the quickest message.
//! What a message took longer than that is added to the stated latency of the tracker: so much the
//! pose is older than it seems. The time under way of the quickest message itself cannot be told
//! from the offset.

use std::collections::VecDeque;
use std::time::Duration;

/// The minimum is taken over so long, ns. Clocks that drift by 50 ppm part by 0.5 ms meanwhile.
const WINDOW_NS: i64 = 10_000_000_000;
/// Differences that come closer together than this, ns, are as one: so no stream, however fast,
/// fills the memory.
const APART_NS: i64 = 10_000_000;
/// A change of the minimum above this is reported, ns.
const STEP_NS: i64 = 20_000_000;
/// Stamps that stay older than the newest for so long, ns, are of a clock that was set back: a
/// delay keeps the order.
const BACK_NS: i64 = 1_000_000_000;

/// Follows the offset between a device's clock and ours.
///
/// A step forwards of the device's clock shows at once. A step backwards shows after 1 s if its
/// stamps are older than the newest for so long, else when the window has passed; until then ages
/// are too great, not too small.
#[derive(Clone, Debug)]
pub struct Clock {
    latency: Duration,
    /// Differences that can still become the minimum: both times and differences grow from front to
    /// back.
    window: VecDeque<Seen>,
    minimum: Option<i64>,
    /// Arrival last, ns.
    now: i64,
    /// Newest stamp, ns.
    newest: Option<i64>,
    /// Since when all stamps are older than that, ns by arrival.
    behind: Option<i64>,
}

/// A message's arrival and the difference of arrival and stamp, ns.
#[derive(Clone, Copy, Debug)]
struct Seen {
    at: i64,
    difference: i64,
}

/// How old a pose is when it arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Age {
    /// Age, s; the stated latency alone when the message has no stamp.
    pub age_s: f64,
    /// Change of the minimum, s, if it is above 20 ms: above 0 when the device's clock was set back
    /// or all messages are slower than they were, below 0 when it was set forward or all are
    /// quicker. To be reported.
    pub step_s: Option<f64>,
    /// Whether the message had a stamp.
    pub stamped: bool,
}

impl Clock {
    /// A clock that knows nothing yet. `latency`: what the maker of the tracker states from
    /// measurement to sending.
    pub fn new(latency: Duration) -> Self {
        let window = VecDeque::new();
        Self { latency, window, minimum: None, now: i64::MIN, newest: None, behind: None }
    }

    /// Takes a message. To be called for each that has a stamp, also when its pose is not taken.
    ///
    /// `stamp`: device time, seconds in the upper 32 bits and 2^-32 s in the lower, 0 if there is
    /// none. `arrival`: time since any fixed moment, by a clock that is never set back.
    pub fn arrived(&mut self, stamp: u64, arrival: Duration) -> Age {
        let latency_s = self.latency.as_secs_f64();
        if stamp == 0 {
            return Age { age_s: latency_s, step_s: None, stamped: false };
        }
        let now = i64::try_from(arrival.as_nanos()).unwrap_or(i64::MAX).max(self.now);
        let stamp = nanoseconds(stamp);
        self.now = now;
        self.forget_clock_before(stamp, now);
        let seen = Seen { at: now, difference: now.saturating_sub(stamp) };
        self.take(seen);
        let minimum = self.window.front().map_or(seen.difference, |first| first.difference);
        let step = minimum.saturating_sub(self.minimum.unwrap_or(minimum));
        self.minimum = Some(minimum);
        let age_s = seconds(seen.difference.saturating_sub(minimum)) + latency_s;
        let step_s = (step.saturating_abs() > STEP_NS).then(|| seconds(step));
        Age { age_s, step_s, stamped: true }
    }

    /// Begins anew with the next message, as when it is known that the device's clock was set. A
    /// step is still reported.
    pub fn restart(&mut self) {
        self.window.clear();
        (self.newest, self.behind) = (None, None);
    }

    /// Forgets what was before the device's clock was set back, when that is clear.
    fn forget_clock_before(&mut self, stamp: i64, now: i64) {
        if self.newest.is_none_or(|newest| stamp >= newest) {
            (self.newest, self.behind) = (Some(stamp), None);
            return;
        }
        let since = *self.behind.get_or_insert(now);
        if now.saturating_sub(since) >= BACK_NS {
            self.drop_before(since);
            (self.newest, self.behind) = (Some(stamp), None);
        }
    }

    /// Takes a difference into the window, and what is too long ago out of it.
    fn take(&mut self, seen: Seen) {
        self.drop_before(seen.at.saturating_sub(WINDOW_NS));
        while self.window.back().is_some_and(|last| last.difference >= seen.difference) {
            self.window.pop_back();
        }
        if self.window.back().is_none_or(|last| seen.at.saturating_sub(last.at) >= APART_NS) {
            self.window.push_back(seen);
        }
    }

    fn drop_before(&mut self, at: i64) {
        while self.window.front().is_some_and(|first| first.at < at) {
            self.window.pop_front();
        }
    }
}

/// A time stamp in ns: at most 2^32 s, which fits.
fn nanoseconds(stamp: u64) -> i64 {
    const SECOND: u64 = 1_000_000_000;
    let whole = (stamp >> 32) * SECOND;
    let part = ((stamp & u64::from(u32::MAX)) * SECOND) >> 32;
    i64::try_from(whole + part).unwrap_or(i64::MAX)
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{Phase, SplitMix, Trajectory};

    const EPOCH: f64 = 1e9;

    fn stamp(seconds: f64) -> u64 {
        let whole = (EPOCH + seconds).floor();
        ((whole as u64) << 32) + ((EPOCH + seconds - whole) * (1_u64 << 32) as f64) as u64
    }

    fn after(seconds: f64) -> Duration {
        Duration::from_secs_f64(seconds)
    }

    fn clock() -> Clock {
        Clock::new(Duration::ZERO)
    }

    #[test]
    fn a_stamp_is_read_to_the_nanosecond() {
        assert_eq!(nanoseconds(0x6553_F100_4000_0000), 1_700_000_000_250_000_000);
        assert_eq!(nanoseconds(u64::MAX), 4_294_967_295_999_999_999);
        assert_eq!(nanoseconds(1 << 31), 500_000_000);
    }

    #[test]
    fn the_age_is_what_a_message_took_longer_than_the_quickest() {
        let mut clock = Clock::new(Duration::from_millis(14));
        let messages = [(1.0, 0.005), (1.1, 0.002), (1.2, 0.030), (1.3, 0.002)];
        let ages = messages.map(|(t, delay)| clock.arrived(stamp(t), after(t + delay)).age_s);
        let expected = [0.014, 0.014, 0.042, 0.014];
        assert!(ages.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{ages:?}");
        let none = clock.arrived(0, after(40.0));
        assert_eq!(none, Age { age_s: 0.014, step_s: None, stamped: false });
    }

    #[test]
    fn the_minimum_is_that_of_ten_seconds() {
        let mut draws = SplitMix::new(2);
        let mut clock = clock();
        let mut seen: Vec<(i64, i64)> = Vec::new();
        for k in 0..3_000 {
            let t = f64::from(k) / 60.0;
            // Delays that rise and fall slowly, so that the quickest changes.
            let delay = 0.01 + 0.004 * (t / 7.0).sin() + 0.002 * draws.even();
            let (device, arrival) = (stamp(t), after(t + delay));
            let now = arrival.as_nanos() as i64;
            seen.push((now, now - nanoseconds(device)));
            let within = seen.iter().filter(|(at, _)| *at >= now - WINDOW_NS);
            let least = within.map(|(_, difference)| *difference).min().unwrap();
            let age = clock.arrived(device, arrival);
            let expected = seconds(now - nanoseconds(device) - least);
            assert_eq!((age.age_s, age.step_s), (expected, None), "{k}");
        }
    }

    /// Ages at 60 Hz for a minute with delays of 5 to 9 ms, of a clock that is ahead by `ahead(t)`
    /// s; and the steps with their times.
    fn minute(ahead: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<(f64, f64)>) {
        let (mut draws, mut clock) = (SplitMix::new(4), clock());
        let (mut ages, mut steps) = (Vec::new(), Vec::new());
        for k in 0..3_600 {
            let t = f64::from(k) / 60.0;
            let delay = 0.005 + 0.004 * draws.even();
            let age = clock.arrived(stamp(t + ahead(t)), after(t + delay));
            ages.push(age.age_s);
            steps.extend(age.step_s.map(|step| (t, step)));
        }
        (ages, steps)
    }

    #[test]
    fn a_clock_that_drifts_is_followed_without_a_step() {
        for drift in [50e-6, -50e-6] {
            let (ages, steps) = minute(|t| drift * t);
            assert!(steps.is_empty(), "{steps:?}");
            assert!(ages.iter().all(|age| (0.0..0.0046).contains(age)), "{ages:?}");
        }
    }

    #[test]
    fn a_clock_that_is_set_forward_shows_at_once() {
        let (ages, steps) = minute(|t| if t < 30.0 { 0.0 } else { 3600.0 });
        let [(t, step)] = steps[..] else { panic!("{steps:?}") };
        assert!((t - 30.0).abs() < 0.02 && (step + 3600.0).abs() < 0.005, "{t} {step}");
        assert!(ages.iter().all(|age| (0.0..0.0041).contains(age)));
    }

    #[test]
    fn a_clock_that_is_set_back_far_shows_after_a_second() {
        let (ages, steps) = minute(|t| if t < 30.0 { 0.0 } else { -3600.0 });
        let [(t, step)] = steps[..] else { panic!("{steps:?}") };
        assert!((t - 31.0).abs() < 0.05 && (step - 3600.0).abs() < 0.005, "{t} {step}");
        let wrong = ages.iter().filter(|age| **age > 0.0041).count();
        assert!((58..=62).contains(&wrong), "{wrong}");
    }

    #[test]
    fn a_clock_that_is_set_back_a_little_shows_when_the_window_has_passed() {
        let (ages, steps) = minute(|t| if t < 30.0 { 0.0 } else { -0.1 });
        let [(t, step)] = steps[..] else { panic!("{steps:?}") };
        assert!((39.0..40.1).contains(&t) && (step - 0.1).abs() < 0.005, "{t} {step}");
        assert!(ages.iter().all(|age| (0.0..0.105).contains(age)), "too great, never too small");
    }

    #[test]
    fn after_a_restart_the_ages_are_right_and_the_step_is_still_reported() {
        let mut clock = clock();
        for k in 0..100 {
            let t = f64::from(k) * 0.1;
            clock.arrived(stamp(t), after(t));
        }
        clock.restart();
        let age = clock.arrived(stamp(-600.0), after(10.0));
        assert!(age.age_s.abs() < 1e-6 && (age.step_s.unwrap() - 610.0).abs() < 1e-6, "{age:?}");
    }

    #[test]
    fn the_steps_of_the_trajectory_are_found() {
        let mut clock = clock();
        let mut steps = Vec::new();
        for row in Trajectory::long().rows() {
            let age = clock.arrived(row.stamp(1_700_000_000), after(row.t_send_s));
            steps.extend(age.step_s.map(|step| (row.phase, step)));
            // 2 ms of jitter to either side; samples with old stamps, and 0.12 s until the step
            // back shows.
            let most = match row.phase {
                Phase::Stamps => 0.070,
                Phase::Withdraw => 0.130,
                _ => 0.0056,
            };
            assert!((0.0..most).contains(&age.age_s), "{age:?} {row:?}");
        }
        let [(Phase::Clock, ahead), (Phase::Withdraw, back)] = steps[..] else {
            panic!("{steps:?}")
        };
        assert!((ahead + 0.12).abs() < 0.003 && (back - 0.1215).abs() < 0.003, "{steps:?}");
    }

    #[test]
    fn a_flood_does_not_fill_the_memory() {
        let mut clock = clock();
        for k in 0..200_000_u64 {
            // Differences that only grow: each could become the minimum.
            clock.arrived(stamp(0.0), Duration::from_micros(100 * k));
            assert!(clock.window.len() <= 1_001);
        }
        assert!(clock.window.len() > 50);
    }

    #[test]
    fn any_times_get_an_age() {
        let mut draws = SplitMix::new(6);
        let mut clock = clock();
        let arrivals = [0, 1, 5_000_000_000, 1 << 40, u64::MAX];
        for _ in 0..20_000 {
            let stamp = [1, 1 << 33, u64::MAX, 0, 77 << 32][(draws.even() * 5.0) as usize];
            let arrival = arrivals[(draws.even() * 5.0) as usize];
            let arrival = [Duration::from_nanos(arrival), Duration::from_secs(arrival)];
            let age = clock.arrived(stamp, arrival[(draws.even() * 2.0) as usize]);
            assert!(age.age_s.is_finite() && age.age_s >= 0.0);
        }
    }
}

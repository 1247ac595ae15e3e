//! Time stamps.

use std::time::Duration;

/// A time as the protocol has it: seconds since 1970-01-01 UTC in the high 32 bits, 2^-32 s in the
/// low ones.
///
/// 0 says that there is none. The seconds begin again at 0 in February 2106.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Stamp(pub u64);

impl Stamp {
    /// No time.
    pub const NONE: Self = Self(0);

    /// Whether there is no time.
    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// The stamp nearest to a time since 1970: at most 2^-33 s (0.12 ns) off.
    /// [`Stamp::since_1970`] gives the same nanosecond back.
    pub fn from_since_1970(time: Duration) -> Self {
        let seconds = time.as_secs() & u64::from(u32::MAX);
        let fraction = ((u64::from(time.subsec_nanos()) << 32) + NANOS / 2) / NANOS;
        Self(seconds << 32 | fraction)
    }

    /// The time since 1970 to the nearest nanosecond; `None` where there is none.
    pub fn since_1970(self) -> Option<Duration> {
        let fraction = self.0 & u64::from(u32::MAX);
        // Rounding may give a whole second, which Duration carries over.
        let nanos = u32::try_from((fraction * NANOS + (1 << 31)) >> 32).unwrap_or(0);
        (!self.is_none()).then(|| Duration::new(self.0 >> 32, nanos))
    }
}

/// Nanoseconds in a second.
const NANOS: u64 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_times_have_known_bits() {
        let quarter = Duration::new(1_700_000_000, 250_000_000);
        assert_eq!(Stamp::from_since_1970(quarter), Stamp(0x6553_F100_4000_0000));
        let odd = Duration::new(1_700_000_000, 123_456_789);
        assert_eq!(Stamp::from_since_1970(odd), Stamp(0x6553_F100_1F9A_DD37));
    }

    #[test]
    fn zero_is_no_time() {
        assert_eq!(Stamp::NONE.since_1970(), None);
        assert_eq!(Stamp(1).since_1970(), Some(Duration::ZERO));
    }

    #[test]
    fn the_last_fraction_carries_into_the_next_second() {
        let last = Stamp(u64::MAX).since_1970();
        assert_eq!(last, Some(Duration::new(1 << 32, 0)));
    }

    proptest! {
        #[test]
        fn a_nanosecond_comes_back(seconds in 1..=u32::MAX, nanos in 0..1_000_000_000_u32) {
            let time = Duration::new(u64::from(seconds), nanos);
            prop_assert_eq!(Stamp::from_since_1970(time).since_1970(), Some(time));
        }

        #[test]
        fn a_stamp_moves_by_less_than_a_nanosecond(bits in 1_u64 << 32..u64::MAX / 2) {
            let time = Stamp(bits).since_1970().expect("not zero");
            prop_assert!(Stamp::from_since_1970(time).0.abs_diff(bits) <= 3);
        }
    }
}

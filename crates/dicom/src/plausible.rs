//! Whether values can be HU of a patient in air.

use crate::error::Error;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// What the values of a volume are, counted slice by slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tally {
    low: i16,
    high: i16,
    voxels: usize,
    air: usize,
    soft: usize,
}

/// HU of air, with the noise of a scanner. These ranges and the share are chosen, not measured:
/// wide enough for any patient in air, which wrong rescales and signs still miss.
const AIR: RangeInclusive<i16> = -1100..=-600;
/// HU of fat, muscle and water.
const SOFT: RangeInclusive<i16> = -300..=300;
/// Refuses values that cannot be HU of a patient in air; the CT may have come in any format.
///
/// # Errors
/// [`Error::NotHounsfield`].
pub fn refuse_implausible(hu: &[i16]) -> Result<(), Error> {
    Tally::of(hu).plausible().map(|_| ())
}

/// Values that are counted at a time.
const PART: usize = 1 << 15;
/// Share of the voxels that each must have.
const SHARE: f64 = 1e-3;

impl Default for Tally {
    fn default() -> Self {
        Self { low: i16::MAX, high: i16::MIN, voxels: 0, air: 0, soft: 0 }
    }
}

impl Tally {
    /// The values of a slice or a volume.
    pub(crate) fn of(hu: &[i16]) -> Self {
        let join = |mut a: Self, b: Self| {
            a.join(b);
            a
        };
        hu.par_chunks(PART).map(Self::part).reduce(Self::default, join)
    }

    /// Of [`PART`] values at most: counters of 16 bits are counted several at a time.
    fn part(hu: &[i16]) -> Self {
        let count = |range: RangeInclusive<i16>| {
            let within = hu.iter().map(|v| u16::from(range.contains(v)));
            usize::from(within.fold(0, u16::wrapping_add))
        };
        Self {
            low: hu.iter().copied().fold(i16::MAX, i16::min),
            high: hu.iter().copied().fold(i16::MIN, i16::max),
            voxels: hu.len(),
            air: count(AIR),
            soft: count(SOFT),
        }
    }

    /// Adds what another tally counted.
    pub(crate) fn join(&mut self, other: Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.voxels += other.voxels;
        self.air += other.air;
        self.soft += other.soft;
    }

    /// Lowest and highest HU.
    pub(crate) fn range(self) -> [i16; 2] {
        [self.low, self.high]
    }

    /// Lowest and highest HU; an error when they cannot be HU of a patient in air.
    pub(crate) fn plausible(self) -> Result<[i16; 2], Error> {
        let Self { low, high, voxels, air, soft } = self;
        let few = |count: usize| (count as f64) < SHARE * voxels as f64;
        let fail = |what: &str| {
            let reason = format!(
                "hardly any voxel is {what}; the values range from {low} to {high}: wrong rescale, \
                 sign or byte order of the stored values"
            );
            Err(Error::NotHounsfield { reason })
        };
        if few(air) {
            return fail("air (-1000 HU)");
        }
        if few(soft) {
            return fail("soft tissue (about 0 HU)");
        }
        Ok([low, high])
    }
}

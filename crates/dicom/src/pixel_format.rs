//! How the values of a slice are stored, and how they become HU.

/// Layout of the stored values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PixelFormat {
    pub(crate) rows: u16,
    pub(crate) columns: u16,
    pub(crate) bits_allocated: u16,
    pub(crate) bits_stored: u16,
    pub(crate) signed: bool,
}

impl PixelFormat {
    /// Samples in the slice.
    pub(crate) fn len(self) -> usize {
        usize::from(self.rows) * usize::from(self.columns)
    }

    /// Bytes of the native slice.
    pub(crate) fn bytes(self) -> usize {
        self.len() * usize::from(self.bits_allocated / 8)
    }

    /// The number that an attribute of 16 bits says in the Pixel Representation.
    pub(crate) fn as_number(self, bits: u16) -> i32 {
        if self.signed { i32::from(bits.cast_signed()) } else { bits.into() }
    }

    /// The values that Bits Stored can hold.
    pub(crate) fn range(self) -> std::ops::RangeInclusive<i32> {
        let bits = u32::from(self.bits_stored);
        if self.signed { -(1 << (bits - 1))..=(1 << (bits - 1)) - 1 } else { 0..=(1 << bits) - 1 }
    }

    /// The lower Bits Stored of a sample.
    #[inline]
    pub(crate) fn pattern(self, sample: u16) -> usize {
        usize::from(sample) & ((1 << self.bits_stored) - 1)
    }

    /// The stored value in the lower Bits Stored of a sample: what stands above is masked, the sign
    /// extended (PS3.5 8.1.1).
    #[inline]
    pub(crate) fn stored(self, sample: u16) -> i32 {
        let bits = u32::from(self.bits_stored);
        let value = self.pattern(sample) as i32;
        if self.signed && value >= 1 << (bits - 1) { value - (1 << bits) } else { value }
    }
}

/// HU = slope * stored value + intercept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rescale {
    pub(crate) slope: f64,
    pub(crate) intercept: f64,
}

impl Rescale {
    pub(crate) fn hu(self, stored: i32) -> f64 {
        f64::from(stored) * self.slope + self.intercept
    }

    /// HU of every pattern of Bits Stored bits, rounded half to even, clipped to 16 bits.
    pub(crate) fn table(self, format: PixelFormat) -> Vec<i16> {
        let hu = |pattern: u32| self.hu(format.stored(pattern as u16)).round_ties_even() as i16;
        (0..1u32 << format.bits_stored).map(hu).collect()
    }
}

/// One of the frames of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frame {
    /// Counted from 0.
    pub(crate) index: usize,
    /// How many the file holds.
    pub(crate) count: usize,
}

impl Frame {
    /// Of a file that holds no other.
    pub(crate) const ONLY: Self = Self { index: 0, count: 1 };
}

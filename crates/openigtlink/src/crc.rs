//! The checksum of a body: CRC-64/ECMA-182.
//!
//! Polynomial 0x42F0E1EBA9EA3693, initial value 0, not reflected, nothing added at the end.

use ::crc::{CRC_64_ECMA_182, Crc, Table};

/// Takes sixteen bytes at once.
static CRC: Crc<u64, Table<16>> = Crc::<u64, Table<16>>::new(&CRC_64_ECMA_182);

/// The checksum of these bytes.
pub fn of(bytes: &[u8]) -> u64 {
    CRC.checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::of;

    #[test]
    fn the_check_value_is_that_of_the_catalogue() {
        assert_eq!(of(b"123456789"), 0x6C40_DF5F_0B49_7347);
        assert_eq!(of(b""), 0);
    }
}

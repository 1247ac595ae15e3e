//! SENSOR: u8 number of values, u8 0, u64 unit, f64 values.

use crate::error::Refusal;
use crate::reader::Reader;

/// The unit millinewton.
pub const MILLINEWTON: u64 = 0xB2C4_0000_0000_0000;

/// Bytes with as many values as there can be.
pub(crate) const MOST_BYTES: usize = 10 + 8 * u8::MAX as usize;

/// Values of a sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Unit: 4 bits of prefix, then six times 6 bits of unit and 4 of exponent.
    pub unit: u64,
    /// The values; 255 at most are written.
    pub values: Vec<f64>,
}

impl Sensor {
    /// Reads a SENSOR.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, Refusal> {
        let mut reader = Reader::new(
            bytes,
            "a SENSOR has u8 number of values, u8 0, u64 unit and f64 for each value",
        );
        let [number, _] = *reader.array()?;
        let unit = reader.u64()?;
        let (values, _) = reader.take(8 * u64::from(number))?.as_chunks();
        reader.end()?;
        Ok(Self { unit, values: values.iter().map(|bytes| f64::from_be_bytes(*bytes)).collect() })
    }

    /// Adds it as it goes over the wire.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let number = u8::try_from(self.values.len()).unwrap_or(u8::MAX);
        out.extend_from_slice(&[number, 0]);
        out.extend_from_slice(&self.unit.to_be_bytes());
        for value in self.values.iter().take(usize::from(number)) {
            out.extend_from_slice(&value.to_be_bytes());
        }
    }
}

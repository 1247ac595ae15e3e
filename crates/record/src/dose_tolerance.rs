//! A tolerance of the tumour's place, asked as dose.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// By how much the dose may be off because a place lies elsewhere.
///
/// The dose of a kilovoltage source falls as 1/r³ with the distance r from the centre of the
/// applicator. Source: Radiation Oncology 2 (2007) 11.
#[derive(Serialize, Deserialize, JsonSchema, Clone, Copy, Debug, PartialEq)]
pub struct DoseTolerance {
    /// Percent of the dose.
    pub percent: f64,
    /// Where: distance from the centre of the applicator, mm.
    pub at_mm: f64,
}

impl DoseTolerance {
    /// How far the place may lie off, mm: straight towards the applicator, where the dose changes
    /// most.
    pub fn mm(&self) -> f64 {
        self.at_mm * (1.0 - (1.0 + self.percent / 100.0).powf(-1.0 / 3.0))
    }
}

#[cfg(test)]
mod tests {
    use super::DoseTolerance;

    #[test]
    fn the_dose_there_is_off_by_what_is_asked() {
        for (percent, at_mm) in [(10.0, 17.5), (30.0, 25.0), (1.0, 17.5)] {
            let nearer = at_mm - DoseTolerance { percent, at_mm }.mm();
            let more = (at_mm / nearer).powi(3) - 1.0;
            assert!((100.0 * more - percent).abs() < 1e-9, "{percent} {at_mm}");
        }
        // 17 % per mm at the surface of a sphere of 35 mm.
        let one = DoseTolerance { percent: 18.9, at_mm: 17.5 }.mm();
        assert!((one - 0.98).abs() < 0.01, "{one}");
    }
}

//! Parameters of the warp.

use crate::{Error, Interpolation};

/// How the CT is carried.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Width over which the displacement fades towards the cut, mm; 0 switches the fade off;
    /// `None` chooses it so that det F > 0.
    pub fade_mm: Option<f64>,
    /// Thickness of the layer outside the skin that moves with it, mm: it holds the blurred skin
    /// edge of the CT. 0 switches it off and leaves that edge behind in the air.
    pub collar_mm: f64,
    /// Value of voxels that the tissue left, HU.
    pub air_hu: i16,
    /// Largest position error of the straight pieces that follow a quadratic displacement, mm.
    pub curve_tolerance_mm: f64,
    /// How values between voxels of the CT are found.
    pub interpolation: Interpolation,
    /// Where the volume of tissue shrinks to less than this share (det F), a voxel is the mean of
    /// several samples within it; 0 switches that off.
    pub supersample_below: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            fade_mm: None,
            collar_mm: 5.0,
            air_hu: -1000,
            curve_tolerance_mm: 0.02,
            interpolation: Interpolation::default(),
            supersample_below: 0.7,
        }
    }
}

impl Params {
    /// # Errors
    /// [`Error::Parameter`] for the first parameter that is out of range.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let within = |name, value: f64, low: f64, high: f64, need| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(Error::Parameter { name, value, need })
            }
        };
        within("fade_mm", self.fade_mm.unwrap_or(0.0), 0.0, 1e3, "0 to 1000 mm")?;
        within("collar_mm", self.collar_mm, 0.0, 20.0, "0 to 20 mm")?;
        within("supersample_below", self.supersample_below, 0.0, 1.0, "0 to 1")?;
        within("curve_tolerance_mm", self.curve_tolerance_mm, 1e-3, 1e3, "0.001 to 1000 mm")
    }
}

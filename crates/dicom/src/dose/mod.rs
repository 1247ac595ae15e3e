//! RT doses (PS3.3 A.18) in and out: a grid of absorbed dose.

mod planes;
mod read;
mod write;

pub use read::read_dose;
pub use write::{DoseInfo, write_dose};

use crate::data_set::DataSet;
use dicom_dictionary_std::tags;
use supine_space::Warning;
use supine_volume::Volume;

/// A dose on its own grid. The header names the patient: not for logs, hence no content in its
/// `Debug`.
#[derive(Clone)]
pub struct Dose {
    pub(crate) file: String,
    volume: Volume<f32>,
    pub(crate) header: DataSet,
    step_gy: f64,
    warnings: Vec<Warning>,
}

impl std::fmt::Debug for Dose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Dose({:?} voxels)", self.volume.grid().size())
    }
}

impl Dose {
    /// The dose, Gy; planes ascending along row direction x column direction.
    pub fn volume(&self) -> &Volume<f32> {
        &self.volume
    }

    /// The same, out of the object.
    pub fn into_volume(self) -> Volume<f32> {
        self.volume
    }

    /// Dose Grid Scaling: the step of the stored values, Gy.
    pub fn step_gy(&self) -> f64 {
        self.step_gy
    }

    /// Frame of Reference UID; empty when it has none.
    pub fn frame_of_reference_uid(&self) -> String {
        self.header.text(tags::FRAME_OF_REFERENCE_UID)
    }

    /// Dose Type (PHYSICAL or EFFECTIVE).
    pub fn dose_type(&self) -> String {
        self.header.text(tags::DOSE_TYPE)
    }

    /// Dose Summation Type (PLAN, BEAM, ...).
    pub fn summation_type(&self) -> String {
        self.header.text(tags::DOSE_SUMMATION_TYPE)
    }

    /// What a user must know before trusting it.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

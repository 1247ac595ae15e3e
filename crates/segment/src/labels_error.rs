//! Why supplied labels cannot be used.

use supine_space::Failure;

/// Below is air, or lung, HU. Chosen, not measured.
pub(crate) const AIR_HU: i16 = -500;

/// Why labels cannot be used with a CT.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LabelsError {
    /// Another size.
    #[error(
        "the labels have {labels:?} voxels, the CT {ct:?}: they are not on the CT's grid; \
         resample them to the CT first"
    )]
    Size {
        /// Voxels of the labels along i, j, k.
        labels: [usize; 3],
        /// Voxels of the CT.
        ct: [usize; 3],
    },
    /// Another place.
    #[error(
        "the voxels of the labels lie up to {off_mm:.2} mm beside the CT's: they are not on its \
         grid; resample them to the CT first"
    )]
    Grid {
        /// Largest distance of corresponding corners, mm.
        off_mm: f64,
    },
    /// One of the two is missing.
    #[error("the labels hold no {missing}; both soft tissue and chest wall are needed")]
    Missing {
        /// `soft tissue` or `chest wall`.
        missing: &'static str,
    },
    /// They fit when turned over.
    #[error(
        "the labels are mirrored: {share:.0} % of the soft tissue lies in air, {mirrored:.1} % \
         when {axes} are exchanged; check how they were saved"
    )]
    Mirrored {
        /// Share of the soft tissue in air, percent.
        share: f64,
        /// That of the mirrored labels, percent.
        mirrored: f64,
        /// Directions to exchange.
        axes: String,
    },
    /// Soft tissue where there is none.
    #[error(
        "{share:.0} % of the soft tissue lies in air or lung (below {AIR_HU} HU): the labels \
         belong to another CT, or their chest wall does not enclose the lungs"
    )]
    SoftTissueInAir {
        /// Share, percent.
        share: f64,
    },
    /// Chest wall where there is no patient.
    #[error(
        "{share:.0} % of the chest wall lies in the air around the patient: the labels belong to \
         another CT"
    )]
    ChestWallInAir {
        /// Share, percent.
        share: f64,
    },
}

impl LabelsError {
    /// The kind of failure: the labels cannot be used.
    pub fn kind(&self) -> Failure {
        Failure::Input
    }
}

//! What the CT alone tells of the voxels of a slice at the borders of muscle: kept, for no seed
//! changes it.

use crate::body::flag;
use crate::levels::Levels;
use crate::muscle::dense_mean;
use crate::plane::near;
use crate::scan::Scan;
use crate::smoothing::smoothed_rows;
use std::sync::OnceLock;

/// Smoothing that leaves an edge where it is and takes the noise of a sharp kernel, mm. Chosen, not
/// measured.
const SHARP_MM: f32 = 0.7;
/// A border that thins out to an edge has fat this near, mm: gland is thicker. Chosen, not
/// measured.
const THIN_MM: f32 = 4.0;
/// Its very edge has fat this near, mm. Chosen, not measured.
const THINNER_MM: f32 = 2.0;

/// Bits of a voxel.
pub(crate) mod tissue {
    /// Fat, or not the patient.
    pub(crate) const SOFT: u8 = 1;
    /// Fat is near.
    pub(crate) const THIN: u8 = 2;
    /// Fat is very near.
    pub(crate) const THINNER: u8 = 4;
    /// The dense tissue around is muscle by its mean.
    pub(crate) const MUSCLE: u8 = 8;
    /// There is dense tissue around.
    pub(crate) const DENSE_AROUND: u8 = 16;
}

/// Bits of [`tissue`] per voxel, made slice by slice when somebody asks.
pub(crate) struct SliceTissue {
    levels: Levels,
    /// So many HU under the level of muscle it still is muscle.
    below: f32,
    slices: Vec<OnceLock<Vec<u8>>>,
}

impl SliceTissue {
    /// Nothing is made yet.
    pub(crate) fn new(slices: usize, levels: Levels, below: f32) -> Self {
        Self { levels, below, slices: vec![OnceLock::new(); slices] }
    }

    /// Whether it is that of these levels.
    pub(crate) fn is_of(&self, levels: &Levels, below: f32) -> bool {
        self.levels == *levels && self.below == below
    }

    /// The bits of a slice.
    pub(crate) fn of(&self, scan: Scan<'_>, k: usize) -> &[u8] {
        self.slices[k].get_or_init(|| self.make(scan, k))
    }

    fn make(&self, scan: Scan<'_>, k: usize) -> Vec<u8> {
        let (frame, levels) = (scan.frame, self.levels);
        let (plane, ni) = (frame.plane(), frame.size[0]);
        let (spacing, sigma) =
            ([frame.spacing[0], frame.spacing[1]], SHARP_MM.max(0.5 * frame.pixel()));
        let image = smoothed_rows(scan.ct, frame, (k, scan.body.rows(frame, k)), sigma);
        let flags = scan.body.flags_slice(frame, k);
        let soft: Vec<bool> =
            (0..plane).map(|n| flags[n] & flag::BODY == 0 || image[n] <= levels.middle()).collect();
        let thin = near(&soft, ni, spacing, THIN_MM);
        let thinner = near(&soft, ni, spacing, THINNER_MM);
        let mean = dense_mean(scan, k, levels);
        let bits = |n: usize| {
            let bit = |on: bool, bit: u8| if on { bit } else { 0 };
            bit(soft[n], tissue::SOFT)
                | bit(thin[n], tissue::THIN)
                | bit(thinner[n], tissue::THINNER)
                | bit(levels.true_muscle(mean[n], self.below) > 0.5, tissue::MUSCLE)
                | bit(!mean[n].is_nan(), tissue::DENSE_AROUND)
        };
        (0..plane).map(bits).collect()
    }
}

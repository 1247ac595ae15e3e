//! Segmentations.

use super::context::CarryContext;
use crate::Error;
use std::path::Path;
use supine_dicom::{
    Segmentation, SegmentationInfo, SegmentationParams, write_carried_segmentation,
};
use supine_mesh::Deformation;
use supine_report::CarriedRegion;
use supine_space::{Grid, Progress, Warning};
use supine_volume::Volume;
use supine_warp::{Origins, Params, carry_mask};

/// Segments in the operating position.
#[derive(Debug)]
pub(crate) struct CarriedSegments {
    /// Their voxels, in the order of the segments.
    pub(crate) masks: Vec<Volume<bool>>,
    /// Their volumes.
    pub(crate) regions: Vec<CarriedRegion>,
}

impl CarriedSegments {
    pub(crate) fn bytes(&self) -> usize {
        self.masks.iter().map(|mask| mask.data().len()).sum()
    }
}

/// Segments on the voxels of a CT. `deformation` as the solver gave it.
///
/// # Errors
/// When the user stopped.
pub(crate) fn carry_segments(
    given: &Segmentation,
    grid: &Grid,
    deformation: &Deformation,
    progress: Progress<'_>,
) -> Result<CarriedSegments, Error> {
    let params = Params::default();
    // A voxel of a segment reaches so far beyond the faces of the mesh.
    let layer_mm = grid.spacing().norm().min(params.collar_mm);
    let origins = Origins::new(grid, deformation, &params, layer_mm, progress.part(0.0, 0.8))?;
    let mut carried = CarriedSegments { masks: Vec::new(), regions: Vec::new() };
    for segment in given.segments() {
        let mask = given.mask(segment.number);
        let moved = carry_mask(&mask, &origins, progress.part(0.8, 1.0))?;
        let [before_ml, after_ml] = [&mask, &moved].map(ml);
        carried.regions.push(CarriedRegion { name: segment.name.clone(), before_ml, after_ml });
        carried.masks.push(moved);
    }
    Ok(carried)
}

/// Volume of a mask, mL.
fn ml(mask: &Volume<bool>) -> f64 {
    let voxels = mask.data().iter().filter(|held| **held).count();
    voxels as f64 * mask.grid().voxel_volume() / 1000.0
}

/// Writes carried segments as a segmentation of the exported CT; what was written, and warnings.
///
/// # Errors
/// When there is no exported CT, they are of another patient, or the file cannot be written or does
/// not read back.
pub(crate) fn write_carried_segments(
    carried: &CarriedSegments,
    from: &Segmentation,
    (context, before): (&CarryContext, usize),
    path: &Path,
) -> Result<(SegmentationInfo, Vec<Warning>), Error> {
    let source = context.source()?;
    let version = env!("CARGO_PKG_VERSION");
    let params = SegmentationParams {
        series_description: context.description("segments"),
        automatic: true,
        algorithm: format!("carried by supine {version}"),
        clock: source.clock(),
        before,
        software_version: version.into(),
    };
    write_carried_segmentation(&carried.masks, from, source, &params, path).map_err(Error::Carried)
}

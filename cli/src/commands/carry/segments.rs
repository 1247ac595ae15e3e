//! DICOM segmentations.

use super::{Job, stopped, warped};
use crate::failure::Failure;
use supine_dicom::{SegmentationParams, read_segmentation, write_carried_segmentation};
use supine_space::Progress;
use supine_volume::Volume;
use supine_warp::{Origins, Params, carry_labels};

/// The segments, on the voxels of the CT, as a segmentation of the exported one.
pub(super) fn carry(job: &Job<'_>) -> Result<u8, Failure> {
    if !job.to_dicom() {
        return Err(Failure::usage(
            "a DICOM segmentation is carried into one: name a .dcm file (or save it as .seg.nrrd \
             first)",
        ));
    }
    let exported = job.exported()?;
    let grid = exported.ct.grid();
    let before = job.frame_before()?;
    let given = read_segmentation(job.what, grid, before.as_deref())?;
    let mut warnings = given.warnings().to_vec();
    let watch = |share| job.screen.share("carry", share);
    let (progress, params) = (Progress::new(&watch), Params::default());
    // A voxel of a segment reaches so far beyond the faces of the mesh.
    let layer_mm = grid.spacing().norm().min(params.collar_mm);
    let origins = Origins::new(grid, job.map(), &params, layer_mm, progress.part(0.0, 0.8))
        .map_err(warped)?;
    let (mut masks, mut rows) = (Vec::new(), Vec::new());
    let mut text = format!("{}: segments", job.args.out.display());
    for segment in given.segments() {
        let mask = given.mask(segment.number);
        let carried = carry_labels(&mask, &origins, progress.part(0.8, 1.0)).map_err(stopped)?;
        let [before_ml, after_ml] = [&mask, &carried].map(ml);
        let (number, name) = (segment.number, &segment.name);
        text += &format!("\n  {name}: {before_ml:.2} ml before, {after_ml:.2} ml after");
        rows.push(serde_json::json!({
            "number": number, "name": name, "before_ml": before_ml, "after_ml": after_ml,
        }));
        masks.push(carried);
    }
    let version = env!("CARGO_PKG_VERSION");
    let params = SegmentationParams {
        series_description: "DEFORMED segments [supine]".into(),
        automatic: true,
        algorithm: format!("carried by supine {version}"),
        clock: exported.source.clock(),
        software_version: version.into(),
    };
    let (written, more) =
        write_carried_segmentation(&masks, &given, &exported.source, &params, &job.args.out)?;
    warnings.extend(more);
    job.screen.warn_all(&warnings);
    let json = serde_json::json!({
        "kind": "segments", "out": job.args.out, "segments": rows,
        "instance_uid": written.instance_uid, "warnings": warnings,
    });
    job.screen.result(&json, &text);
    Ok(0)
}

/// Volume of a mask, mL.
fn ml(mask: &Volume<bool>) -> f64 {
    let voxels = mask.data().iter().filter(|held| **held).count();
    voxels as f64 * mask.grid().voxel_volume() / 1000.0
}

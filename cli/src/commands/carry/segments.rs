//! DICOM segmentations.

use super::Job;
use crate::failure::Failure;
use supine_pipeline::{RunError, carry_segments, write_carried_segments};
use supine_space::Progress;

/// The segments, on the voxels of the CT, as a segmentation of the exported one.
pub(super) fn carry(job: &Job<'_>) -> Result<u8, Failure> {
    if !job.to_dicom() {
        return Err(Failure::usage(
            "a DICOM segmentation is carried into one: name a .dcm file (or save it as .seg.nrrd \
             first)",
        ));
    }
    let company = job.company(job.ct()?.as_ref())?;
    let Some((ct, _)) = company.exported() else { return Err(RunError::NoSeries.into()) };
    let (given, mut warnings) = company.segmentation(job.what, ct.grid())?;
    let watch = |share| job.screen.share("carry", share);
    let carried = carry_segments(&given, ct.grid(), job.map(), Progress::new(&watch))?;
    let mut text = format!("{}: segments", job.args.out.display());
    let rows = given.segments().iter().zip(&carried.regions).map(|(segment, region)| {
        let (name, before, after) = (&region.name, region.before_ml, region.after_ml);
        text += &format!("\n  {name}: {before:.2} ml before, {after:.2} ml after");
        serde_json::json!({
            "number": segment.number, "name": name, "before_ml": before, "after_ml": after,
        })
    });
    let rows: Vec<_> = rows.collect();
    let (written, more) = write_carried_segments(&carried, &given, &company, &job.args.out)?;
    warnings.extend(more);
    job.screen.warn_all(&warnings);
    let json = serde_json::json!({
        "kind": "segments", "out": job.args.out, "segments": rows,
        "instance_uid": written.instance_uid, "warnings": warnings,
    });
    job.screen.result(&json, &text);
    Ok(0)
}

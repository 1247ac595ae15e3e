//! Contours.

use super::Job;
use crate::failure::Failure;
use supine_exchange::{NamedContours, read_contours, write_contours};
use supine_pipeline::{
    CarriedContours, carry_lines, carry_named_contours, closed_contours, write_carried_structures,
};
use supine_space::{Grid, Progress};

/// Contours of a CSV.
pub(super) fn carry_csv(job: &Job<'_>) -> Result<u8, Failure> {
    if job.to_dicom() {
        return Err(Failure::usage(
            "a structure set (.dcm) is made from a structure set: name a .csv file",
        ));
    }
    let given = read_contours(job.what)?;
    let carried = carry(job, &given, job.ct_for_grid()?.ct.grid())?;
    write_contours(&carried.structures, &job.args.out)?;
    tell(job, &given, &carried, &[], None);
    Ok(0)
}

/// A structure set: points and open lines of it come out in DICOM only.
pub(super) fn carry_structures(job: &Job<'_>) -> Result<u8, Failure> {
    let ct = job.ct()?;
    let company = job.company(ct.as_ref())?;
    let (structures, mut warnings) = company.structures(job.what)?;
    let (given, left_out) = closed_contours(&structures);
    warnings.extend(left_out);
    // An object's contours go on the slices of the CT that it belongs to.
    let exported = company.exported().filter(|_| job.to_dicom() || ct.is_none());
    let carried = match exported {
        Some((exported, _)) => carry(job, &given, exported.grid())?,
        None => carry(job, &given, job.ct_for_grid()?.ct.grid())?,
    };
    if !job.to_dicom() {
        for roi in structures.rois().iter().filter(|roi| !roi.lines.is_empty()) {
            let (name, n) = (&roi.name, roi.lines.len());
            warnings
                .push(format!("{name}: {n} points and open lines are left out of the .csv file"));
        }
        let drawn: Vec<NamedContours> =
            carried.structures.iter().filter(|s| !s.contours.is_empty()).cloned().collect();
        write_contours(&drawn, &job.args.out)?;
        tell(job, &given, &carried, &warnings, None);
        return Ok(0);
    }
    let lines = carry_lines(&structures, job.map())?;
    let written = write_carried_structures(&carried, lines, &structures, &company, &job.args.out)?;
    warnings.extend(written.warnings);
    tell(job, &given, &carried, &warnings, Some(&written.object.instance_uid));
    Ok(0)
}

/// All structures on the slices of a CT; those without contours stay so.
fn carry(job: &Job<'_>, given: &[NamedContours], grid: &Grid) -> Result<CarriedContours, Failure> {
    let watch = |share| job.screen.share("carry", share);
    Ok(carry_named_contours(given, grid, job.map(), Progress::new(&watch))?)
}

fn tell(
    job: &Job<'_>,
    given: &[NamedContours],
    carried: &CarriedContours,
    warnings: &[String],
    instance_uid: Option<&String>,
) {
    job.screen.warn_all(warnings);
    let mut text = format!("{}: contours", job.args.out.display());
    let rows = carried.moved.iter().map(|(n, facts)| {
        let NamedContours { name, contours } = &carried.structures[*n];
        let ([before_ml, after_ml], moved) = (facts.volume_ml, facts.moved_points > 0);
        text += &format!("\n  {name}: {before_ml:.2} ml before, {after_ml:.2} ml after");
        if !moved {
            text += " (not moved: as given)";
        }
        serde_json::json!({
            "name": name, "before_ml": before_ml, "after_ml": after_ml, "moved": moved,
            "max_displacement_mm": facts.max_displacement_mm,
            "contours": [given[*n].contours.len(), contours.len()],
        })
    });
    let rows: Vec<_> = rows.collect();
    let json = serde_json::json!({
        "kind": "contours", "out": job.args.out, "structures": rows,
        "instance_uid": instance_uid, "warnings": warnings,
    });
    job.screen.result(&json, &text);
}

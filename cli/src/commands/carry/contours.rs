//! Contours.

use super::dicom::Exported;
use super::{Job, dicom, warped};
use crate::failure::Failure;
use supine_dicom::{Structures, read_structures, write_structures};
use supine_exchange::{NamedContours, read_contours, write_contours};
use supine_space::Progress;
use supine_volume::Ct;
use supine_warp::{Params, carry_contours};

/// What became of the structures.
#[derive(Default)]
struct Carried {
    structures: Vec<NamedContours>,
    rows: Vec<serde_json::Value>,
    text: String,
}

/// Contours of a CSV.
pub(super) fn carry_csv(job: &Job<'_>) -> Result<u8, Failure> {
    if job.to_dicom() {
        return Err(Failure::usage(
            "a structure set (.dcm) is made from a structure set: name a .csv file",
        ));
    }
    let carried = carry(job, &read_contours(job.what)?, &job.ct_for_grid()?.ct)?;
    write_contours(&carried.structures, &job.args.out)?;
    tell(job, carried, vec![], None);
    Ok(0)
}

/// Closed planar contours of a structure set.
pub(super) fn carry_structures(job: &Job<'_>) -> Result<u8, Failure> {
    let structures = read_structures(job.what)?;
    let (mut warnings, mut given) = (Vec::new(), Vec::new());
    for roi in structures.rois() {
        let name = &roi.name;
        if roi.open_contours > 0 {
            let open = roi.open_contours;
            warnings.push(format!("{name}: {open} points and open lines are left out"));
        }
        let mut contours = roi.contours.clone();
        if !contours.is_empty() && contours.iter().all(|c| c.len() < 3) {
            warnings.push(format!("{name}: no contour has three corners; it is left empty"));
            contours.clear();
        }
        given.push(NamedContours { name: name.clone(), contours });
    }
    let frames: Vec<String> =
        structures.rois().iter().map(|r| r.frame_of_reference.clone()).collect();
    warnings.extend(job.same_frame(&frames)?);
    let exported = if job.to_dicom() { Some(job.exported()?) } else { None };
    // An object's contours go on the slices of the CT that it belongs to.
    let carried = match &exported {
        Some(exported) => carry(job, &given, &exported.ct)?,
        None => carry(job, &given, &job.ct_for_grid()?.ct)?,
    };
    let Some(exported) = exported else {
        let drawn: Vec<NamedContours> =
            carried.structures.iter().filter(|s| !s.contours.is_empty()).cloned().collect();
        write_contours(&drawn, &job.args.out)?;
        tell(job, carried, warnings, None);
        return Ok(0);
    };
    let uid = write(job, &structures, &carried, &exported, &mut warnings)?;
    tell(job, carried, warnings, Some(uid));
    Ok(0)
}

/// Writes the structure set of the exported CT; its SOP Instance UID.
fn write(
    job: &Job<'_>,
    structures: &Structures,
    carried: &Carried,
    exported: &Exported,
    warnings: &mut Vec<String>,
) -> Result<String, Failure> {
    let contours: Vec<_> = carried.structures.iter().map(|s| s.contours.clone()).collect();
    let params = dicom::params("structures", &exported.source);
    let written =
        write_structures(&contours, structures, &exported.source, &params, &job.args.out)?;
    warnings.extend(written.warnings);
    Ok(written.object.instance_uid)
}

/// All structures on the slices of a CT; those without contours stay so.
fn carry(job: &Job<'_>, given: &[NamedContours], ct: &Ct) -> Result<Carried, Failure> {
    let mut carried = Carried::default();
    for (n, structure) in given.iter().enumerate() {
        let watch = |share| job.screen.share("carry", share);
        let all = given.len() as f64;
        let progress = Progress::new(&watch).part(n as f64 / all, (n + 1) as f64 / all);
        let name = &structure.name;
        if structure.contours.is_empty() {
            carried.structures.push(structure.clone());
            continue;
        }
        let params = Params::default();
        let (contours, after) =
            carry_contours(&structure.contours, ct.grid(), job.map(), &params, progress).map_err(
                |error| {
                    let failure = warped(error);
                    Failure { message: format!("{name}: {}", failure.message), ..failure }
                },
            )?;
        let ([before_ml, after_ml], moved) = (after.volume_ml, after.moved_points > 0);
        carried.text += &format!("\n  {name}: {before_ml:.2} ml before, {after_ml:.2} ml after");
        if !moved {
            carried.text += " (not moved: as given)";
        }
        carried.rows.push(serde_json::json!({
            "name": name, "before_ml": before_ml, "after_ml": after_ml, "moved": moved,
            "max_displacement_mm": after.max_displacement_mm,
            "contours": [structure.contours.len(), contours.len()],
        }));
        carried.structures.push(NamedContours { name: name.clone(), contours });
    }
    Ok(carried)
}

fn tell(job: &Job<'_>, carried: Carried, warnings: Vec<String>, instance_uid: Option<String>) {
    job.screen.warn_all(&warnings);
    let text = format!("{}: contours{}", job.args.out.display(), carried.text);
    let json = serde_json::json!({
        "kind": "contours", "out": job.args.out, "structures": carried.rows,
        "instance_uid": instance_uid, "warnings": warnings,
    });
    job.screen.result(&json, &text);
}

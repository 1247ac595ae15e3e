//! Contours.

use super::{Job, warped};
use crate::failure::Failure;
use supine_dicom::read_structures;
use supine_exchange::{NamedContours, read_contours, write_contours};
use supine_space::Progress;
use supine_warp::{Params, carry_contours};

/// Contours of a CSV.
pub(super) fn carry_csv(job: &Job<'_>) -> Result<u8, Failure> {
    carry(job, &read_contours(job.what)?, vec![], &[])
}

/// Closed planar contours of a structure set.
pub(super) fn carry_structures(job: &Job<'_>) -> Result<u8, Failure> {
    let structures = read_structures(job.what)?;
    let (mut warnings, mut given, mut frames) = (Vec::new(), Vec::new(), Vec::new());
    for roi in structures.rois() {
        if roi.open_contours > 0 {
            let (name, open) = (&roi.name, roi.open_contours);
            warnings.push(format!("{name}: {open} points and open lines are left out"));
        }
        if !roi.contours.is_empty() {
            let contours = roi.contours.clone();
            given.push(NamedContours { name: roi.name.clone(), contours });
            frames.push(roi.frame_of_reference.as_str());
        }
    }
    carry(job, &given, warnings, &frames)
}

/// `frames`: UIDs of frames of reference, which must be that of the CT where both are known.
fn carry(
    job: &Job<'_>,
    given: &[NamedContours],
    mut warnings: Vec<String>,
    frames: &[&str],
) -> Result<u8, Failure> {
    let input = job.ct_for_grid()?;
    // A run's own CT has a new frame of reference; only the CT before deformation can be compared.
    let before = job.args.ct.as_ref().and(input.dicom.as_ref());
    if let Some((source, _)) = before {
        let own = source.frame_of_reference_uid();
        if frames.iter().any(|&f| !f.is_empty() && f != own) {
            return Err(Failure::input(format!(
                "{} was drawn in another frame of reference than that of the CT",
                job.what.display()
            )));
        }
    } else if !frames.is_empty() {
        warnings.push("the frame of reference was not compared with the CT's (--ct)".into());
    }
    let grid = input.ct.grid();
    let (mut carried, mut rows) = (Vec::new(), Vec::new());
    let mut text = format!("{}: contours", job.args.out.display());
    for (n, structure) in given.iter().enumerate() {
        let watch = |share| job.screen.share("carry", share);
        let all = given.len() as f64;
        let progress = Progress::new(&watch).part(n as f64 / all, (n + 1) as f64 / all);
        let name = &structure.name;
        let (contours, after) =
            carry_contours(&structure.contours, grid, job.map(), &Params::default(), progress)
                .map_err(|error| {
                    let failure = warped(error);
                    Failure { message: format!("{name}: {}", failure.message), ..failure }
                })?;
        let ([before_ml, after_ml], moved) = (after.volume_ml, after.moved_points > 0);
        text += &format!("\n  {name}: {before_ml:.2} ml before, {after_ml:.2} ml after");
        if !moved {
            text += " (not moved: as given)";
        }
        rows.push(serde_json::json!({
            "name": name, "before_ml": before_ml, "after_ml": after_ml, "moved": moved,
            "max_displacement_mm": after.max_displacement_mm,
            "contours": [structure.contours.len(), contours.len()],
        }));
        carried.push(NamedContours { name: name.clone(), contours });
    }
    write_contours(&carried, &job.args.out)?;
    job.screen.warn_all(&warnings);
    let json = serde_json::json!({
        "kind": "contours", "out": job.args.out, "structures": rows, "warnings": warnings,
    });
    job.screen.result(&json, &text);
    Ok(0)
}

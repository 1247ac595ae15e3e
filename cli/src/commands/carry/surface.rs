//! Closed surfaces.

use super::{Job, warped};
use crate::commands::mesh::surface;
use crate::failure::Failure;
use supine_exchange::write_surface;
use supine_space::Progress;
use supine_warp::{Params, carry_surface};

pub(super) fn carry(job: &Job<'_>) -> Result<u8, Failure> {
    let mut warnings = Vec::new();
    let given = surface(job.what, job.args.frame, &mut warnings)?;
    job.screen.warn_all(&warnings);
    let watch = |share| job.screen.share("carry", share);
    let (surface, carried) =
        carry_surface(&given, job.map(), &Params::default(), Progress::new(&watch))
            .map_err(warped)?;
    let out = &job.args.out;
    write_surface(&surface, out)?;
    let [before_ml, after_ml] = carried.volume_ml;
    let points = given.points().len();
    let json = serde_json::json!({
        "kind": "surface", "out": out, "before_ml": before_ml, "after_ml": after_ml,
        "points": points, "moved_points": carried.moved_points,
        "added_points": carried.added_points,
        "max_displacement_mm": carried.max_displacement_mm, "warnings": warnings,
    });
    let text = format!(
        "{}: surface, {} of {points} points moved, at most {:.2} mm; {before_ml:.2} ml before, \
         {after_ml:.2} ml after",
        out.display(),
        carried.moved_points,
        carried.max_displacement_mm
    );
    job.screen.result(&json, &text);
    Ok(0)
}

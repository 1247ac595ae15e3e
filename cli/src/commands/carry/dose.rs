//! Doses.

use super::Job;
use crate::failure::Failure;
use supine_dicom::{Dose, DoseInfo};
use supine_exchange::write_scalar;
use supine_pipeline::{CtInput, DOSE_NOTE, carry_with_totals, write_carried_dose};
use supine_space::Progress;
use supine_volume::Volume;
use supine_warp::DoseTotals;

const NO_CT: &str = "without --ct (the CT before deformation) the density of the tissue is not \
                     known: the total is by volume only";

/// A dose of a plain volume.
pub(super) fn carry(job: &Job<'_>, given: &Volume<f32>) -> Result<u8, Failure> {
    if job.to_dicom() {
        return Err(Failure::usage(
            "an RT dose (.dcm) names its plan, which a plain volume does not know: carry the RT \
             dose itself, or name a .nrrd or .nii.gz file",
        ));
    }
    let (carried, totals) = carried(job, given, job.ct()?.as_ref())?;
    let watch = |share| job.screen.share("export", share);
    write_scalar(&carried, &job.args.out, Progress::new(&watch))?;
    tell(job, [given, &carried], &totals, (None, vec![]));
    Ok(0)
}

/// A DICOM RT dose.
pub(super) fn carry_dicom(job: &Job<'_>) -> Result<u8, Failure> {
    let ct = job.ct()?;
    let company = job.company(ct.as_ref())?;
    let (dose, mut warnings) = company.dose(job.what)?;
    let given = dose.volume();
    let (carried, totals) = carried(job, given, ct.as_ref())?;
    if !job.to_dicom() {
        let watch = |share| job.screen.share("export", share);
        write_scalar(&carried, &job.args.out, Progress::new(&watch))?;
        tell(job, [given, &carried], &totals, (None, warnings));
        return Ok(0);
    }
    let written = write_carried_dose(&carried, &dose, &company, &job.args.out)?;
    warnings.extend(written.warnings.iter().cloned());
    tell(job, [given, &carried], &totals, (Some((&dose, &written)), warnings));
    Ok(0)
}

/// The dose in the operating position, on its own grid, with its totals.
fn carried(
    job: &Job<'_>,
    given: &Volume<f32>,
    ct: Option<&CtInput>,
) -> Result<(Volume<f32>, DoseTotals), Failure> {
    let watch = |share| job.screen.share("carry", share);
    let ct = ct.map(|input| &input.ct);
    Ok(carry_with_totals(given, ct, job.map(), Progress::new(&watch))?)
}

fn tell(
    job: &Job<'_>,
    [given, carried]: [&Volume<f32>; 2],
    totals: &DoseTotals,
    (dicom, doubts): (Option<(&Dose, &DoseInfo)>, Vec<String>),
) {
    let mut warnings = vec![DOSE_NOTE.to_owned()];
    if totals.energy_mj.is_none() {
        warnings.push(NO_CT.into());
    }
    warnings.extend(doubts);
    job.screen.warn_all(&warnings);
    let most = |dose: &Volume<f32>| dose.data().iter().copied().fold(f32::MIN, f32::max);
    let [before, after] = totals.volume_gy_ml;
    let mut text = format!(
        "{}: dose, at most {:.2} Gy before, {:.2} Gy after; integral {before:.1} Gy ml before, \
         {after:.1} Gy ml after",
        job.args.out.display(),
        most(given),
        most(carried)
    );
    if let Some([before, after]) = totals.energy_mj {
        text += &format!("; weighted with mass {before:.1} mJ before, {after:.1} mJ after");
    }
    let object = dicom.map(|(dose, written)| {
        serde_json::json!({
            "type": dose.dose_type(), "summation": dose.summation_type(),
            "instance_uid": written.object.instance_uid, "series_uid": written.object.series_uid,
            "step_gy": [dose.step_gy(), written.step_gy], "read_back_error_gy": written.error_gy,
        })
    });
    let json = serde_json::json!({
        "kind": "dose", "out": job.args.out, "max_gy": [most(given), most(carried)],
        "integral_gy_ml": totals.volume_gy_ml, "energy_mj": totals.energy_mj,
        "mass_g": totals.mass_g, "density": "1 + HU/1000 g/ml, at least 0", "dicom": object,
        "warnings": warnings,
    });
    job.screen.result(&json, &text);
}

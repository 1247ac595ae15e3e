//! Doses.

use super::{Job, stopped, warped};
use crate::failure::Failure;
use supine_exchange::write_scalar;
use supine_space::Progress;
use supine_volume::Volume;
use supine_warp::{Origins, Params, carry_dose, dose_totals};

const NOTE: &str = "the dose was carried with the tissue; it was not computed anew on the deformed \
                    anatomy";
const NO_CT: &str = "without --ct (the CT before deformation) the density of the tissue is not \
                     known: the total is by volume only";

pub(super) fn carry(job: &Job<'_>, given: &Volume<f32>) -> Result<u8, Failure> {
    let ct = job.ct()?;
    let watch = |share| job.screen.share("carry", share);
    let progress = Progress::new(&watch);
    let origins =
        Origins::new(given.grid(), job.map(), &Params::default(), 0.0, progress.part(0.0, 0.8))
            .map_err(warped)?;
    let carried = carry_dose(given, &origins, progress.part(0.8, 1.0)).map_err(stopped)?;
    let out = &job.args.out;
    let watch = |share| job.screen.share("export", share);
    write_scalar(&carried, out, Progress::new(&watch))?;
    let totals = dose_totals([given, &carried], &origins, ct.as_ref().map(|input| &input.ct));
    let mut warnings = vec![NOTE.to_owned()];
    if ct.is_none() {
        warnings.push(NO_CT.into());
    }
    job.screen.warn_all(&warnings);
    let most = |dose: &Volume<f32>| dose.data().iter().copied().fold(f32::MIN, f32::max);
    let [before, after] = totals.volume_gy_ml;
    let mut text = format!(
        "{}: dose, at most {:.2} Gy before, {:.2} Gy after; integral {before:.1} Gy ml before, \
         {after:.1} Gy ml after",
        out.display(),
        most(given),
        most(&carried)
    );
    if let Some([before, after]) = totals.energy_mj {
        text += &format!("; weighted with mass {before:.1} mJ before, {after:.1} mJ after");
    }
    let json = serde_json::json!({
        "kind": "dose", "out": out, "max_gy": [most(given), most(&carried)],
        "integral_gy_ml": totals.volume_gy_ml, "energy_mj": totals.energy_mj,
        "mass_g": totals.mass_g, "density": "1 + HU/1000 g/ml, at least 0", "warnings": warnings,
    });
    job.screen.result(&json, &text);
    Ok(0)
}

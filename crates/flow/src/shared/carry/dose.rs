//! Doses.

use super::context::{CarryContext, params};
use crate::Error;
use std::path::Path;
use supine_dicom::{Dose, DoseInfo, write_dose};
use supine_mesh::Deformation;
use supine_space::Progress;
use supine_volume::{Ct, Volume};
use supine_warp::{DoseTotals, Origins, Params, carry_dose, dose_totals};

/// What everyone who looks at a carried dose has to know.
pub(crate) const DOSE_NOTE: &str = "the dose was carried with the tissue; it was not computed anew on the deformed \
                             anatomy";

/// A dose (Gy) in the operating position, on its own grid, with its totals; `ct`, before deformation, gives the density
/// of the tissue. `deformation` as the solver gave it.
///
/// # Errors
/// When the user stopped.
pub(crate) fn carry_with_totals(
    given: &Volume<f32>,
    ct: Option<&Ct>,
    deformation: &Deformation,
    progress: Progress<'_>,
) -> Result<(Volume<f32>, DoseTotals), Error> {
    let origins =
        Origins::new(given.grid(), deformation, &Params::default(), 0.0, progress.part(0.0, 0.8))?;
    let carried = carry_dose(given, &origins, progress.part(0.8, 1.0))?;
    let totals = dose_totals([given, &carried], &origins, ct);
    Ok((carried, totals))
}

/// Writes a carried dose as an RT dose of the exported CT.
///
/// # Errors
/// When there is no exported CT, the dose is of another patient, or the file cannot be written or does not read back.
pub(crate) fn write_carried_dose(
    carried: &Volume<f32>,
    from: &Dose,
    (context, before): (&CarryContext, usize),
    path: &Path,
) -> Result<DoseInfo, Error> {
    let source = context.source()?;
    let params = params("dose", source, before);
    write_dose(carried, from, source, &params, context.registration(), path).map_err(Error::Carried)
}

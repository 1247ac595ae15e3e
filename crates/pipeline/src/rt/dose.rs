//! Doses.

use super::{Company, params};
use crate::RunError;
use std::path::Path;
use supine_dicom::{Dose, DoseInfo, write_dose};
use supine_mesh::{Displacement, TetMesh};
use supine_space::Progress;
use supine_volume::{Ct, Volume};
use supine_warp::{DoseTotals, Origins, Params, carry_dose, dose_totals};

/// What everyone who looks at a carried dose has to know.
pub const DOSE_NOTE: &str = "the dose was carried with the tissue; it was not computed anew on the deformed \
                             anatomy";

/// A dose (Gy) in the operating position, on its own grid, with its totals; `ct`, before deformation, gives the density
/// of the tissue. `map` is the mesh with the displacement as the solver gave it.
///
/// # Errors
/// When the displacement belongs to another mesh, or the user stopped.
pub fn carry_with_totals(
    given: &Volume<f32>,
    ct: Option<&Ct>,
    map: (&TetMesh, &Displacement),
    progress: Progress<'_>,
) -> Result<(Volume<f32>, DoseTotals), RunError> {
    let origins =
        Origins::new(given.grid(), map, &Params::default(), 0.0, progress.part(0.0, 0.8))?;
    let carried = carry_dose(given, &origins, progress.part(0.8, 1.0))?;
    let totals = dose_totals([given, &carried], &origins, ct);
    Ok((carried, totals))
}

/// Writes a carried dose as an RT dose of the exported CT.
///
/// # Errors
/// When there is no exported CT, the dose is of another patient, or the file cannot be written or does not read back.
pub fn write_carried_dose(
    carried: &Volume<f32>,
    from: &Dose,
    company: &Company,
    path: &Path,
) -> Result<DoseInfo, RunError> {
    let source = company.source()?;
    let params = params("dose", source);
    write_dose(carried, from, source, &params, company.registration(), path)
        .map_err(RunError::Carried)
}

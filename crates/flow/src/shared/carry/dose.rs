//! Doses.

use super::context::CarryContext;
use crate::Error;
use std::path::Path;
use supine_dicom::{Dose, DoseInfo, write_dose};
use supine_mesh::Deformation;
use supine_space::{Progress, Warning};
use supine_volume::{Ct, Volume};
use supine_warp::{
    BeyondGrid, CarriedDose, DoseTotals, Origins, Params, carry_dose, cell_mm, dose_totals,
};

/// The code of [`not_anew`].
pub(crate) const NOT_ANEW: &str = "dose-not-computed-anew";

/// What everyone who looks at a carried dose has to know.
pub(crate) fn not_anew() -> Warning {
    let text =
        "the dose was carried with the tissue; it was not computed anew on the deformed anatomy";
    Warning::new(NOT_ANEW, text)
}

/// What everyone who looks at a carried dose has to know: its grid is too small for the movement,
/// or it was no dose.
pub(crate) fn dose_doubts(given: &Volume<f32>, carried: &CarriedDose) -> Vec<Warning> {
    grid_too_small(carried).into_iter().chain(negative(given)).collect()
}

/// No dose is below 0; a difference of two is.
fn negative(given: &Volume<f32>) -> Option<Warning> {
    let least = given.data().iter().copied().fold(0.0, f32::min);
    let text = format!("the dose goes down to {least:.2} Gy: is it a difference of doses?");
    (least < 0.0).then(|| Warning::new("dose-negative", text))
}

fn grid_too_small(carried: &CarriedDose) -> Option<Warning> {
    let BeyondGrid { entered_ml, edge_gy, left_gy } = carried.beyond;
    let mut lost = Vec::new();
    if entered_ml > 0.0 {
        lost.push(format!(
            "{entered_ml:.2} ml of tissue that comes in over its edge have 0 Gy, for none was given there (beside it up to \
             {edge_gy:.1} Gy)"
        ));
    }
    if left_gy > 0.0 {
        lost.push(format!("tissue with up to {left_gy:.1} Gy leaves it and is not in the result"));
    }
    let text = format!(
        "the grid of the dose ends within tissue that moves: {}; export the dose on a larger grid",
        lost.join("; ")
    );
    (!lost.is_empty()).then(|| Warning::new("dose-grid-too-small", text))
}

/// A dose (Gy) in the operating position, on its own grid, with its totals; `ct`, before
/// deformation, tells tissue from air and gives its density. `deformation` as the solver gave it.
///
/// # Errors
/// When the user stopped.
pub(crate) fn carry_with_totals(
    given: &Volume<f32>,
    ct: Option<&Ct>,
    deformation: &Deformation,
    progress: Progress<'_>,
) -> Result<(CarriedDose, DoseTotals), Error> {
    let (grid, params) = (given.grid(), Params::default());
    let layer_mm = cell_mm(grid);
    let origins = Origins::new(grid, deformation, &params, layer_mm, progress.part(0.0, 0.8))?;
    let moved = carry_dose(given, ct, &origins, progress.part(0.8, 1.0))?;
    let totals = dose_totals([given, &moved.carried], &origins, ct);
    Ok((moved, totals))
}

/// Writes a carried dose as an RT dose of the exported CT.
///
/// # Errors
/// When there is no exported CT, the dose is of another patient, or the file cannot be written or
/// does not read back.
pub(crate) fn write_carried_dose(
    carried: &Volume<f32>,
    from: &Dose,
    (context, before): (&CarryContext, usize),
    path: &Path,
) -> Result<DoseInfo, Error> {
    let source = context.source()?;
    let params = context.params("dose", before)?;
    write_dose(carried, from, source, &params, context.registration(), path).map_err(Error::Carried)
}

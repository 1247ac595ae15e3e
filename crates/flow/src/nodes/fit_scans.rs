//! The scans to which the tissue is fitted.

use super::Law;
use crate::Error;
use crate::case_state::CaseState;
use crate::inputs::InputFile;
use serde::Serialize;
use supine_fem::RestState;

/// The scans of a case in which the tissue is fitted.
#[derive(Serialize, Clone)]
pub(crate) struct Scans {
    pub(crate) sitting: InputFile,
    pub(crate) supine: Option<InputFile>,
    pub(crate) landmarks: Option<InputFile>,
    pub(crate) unit: Option<&'static str>,
    /// How far the sitting patient is said to lean back, degrees.
    pub(super) lean_deg: f64,
    pub(super) states: Vec<RestState>,
    /// Whether other laws than that of the case are held against the scan.
    pub(super) laws: bool,
    /// The scan on the table, and how gravity pulls there: held against the laws too.
    pub(super) table: Option<(InputFile, Law)>,
}

impl Scans {
    /// Those of a case, if it has one of the sitting patient.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub(super) fn of(case_state: &CaseState) -> Result<Option<Self>, Error> {
        let case = &case_state.case;
        let of_case = case.scans.as_ref().and_then(|scans| Some((scans, scans.fit.as_ref()?)));
        let Some((scans, fit)) = of_case else { return Ok(None) };
        let file = |key, path: &Option<std::path::PathBuf>| {
            path.as_ref().map(|path| case_state.file(key, path)).transpose()
        };
        let asked = fit.laws && case.table.is_some();
        let table = scans.intraop.as_ref().filter(|_| asked).map(|intraop| {
            Ok::<_, Error>((case_state.file("scans.intraop", intraop)?, Law::of(case)?))
        });
        Ok(Some(Self {
            table: table.transpose()?,
            sitting: case_state.file("scans.sitting", &fit.sitting)?,
            supine: file("scans.supine", &fit.supine)?,
            landmarks: file("scans.landmarks", &scans.landmarks)?,
            unit: scans.unit,
            lean_deg: fit.lean_deg,
            states: fit.states.clone(),
            laws: fit.laws,
        }))
    }
}

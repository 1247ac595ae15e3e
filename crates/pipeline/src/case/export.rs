//! What leaves, as typed and checked.

use super::{CaseError, one_of, value};
use serde::Deserialize;
use supine_dicom::Policy;

/// What is asked of the DICOM objects of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExportWish {
    /// Whether they lack the patient (PS3.15 E.1).
    pub anonymise: bool,
    /// Whether registrations go with the series.
    pub registration: bool,
    /// Departures from what is safest.
    pub policy: Policy,
}

/// The table `export` of a case file.
#[derive(Deserialize, Default)]
pub(super) struct ExportFile {
    #[serde(default)]
    anonymise: bool,
    study: Option<String>,
    equipment: Option<String>,
    frame: Option<String>,
    registration: Option<bool>,
}

/// To be typed in full by who wants the source's frame of reference.
const CONFIRMED: &str = "source, although the breast has moved in it";

pub(super) fn wish(file: &ExportFile) -> Result<ExportWish, CaseError> {
    let study = [("source", false), ("new", true)];
    let equipment = [("supine", false), ("scanner", true)];
    let same_frame = match file.frame.as_deref() {
        None | Some("new") => false,
        Some(CONFIRMED) => true,
        Some("source") => {
            let reason = format!(
                "contours and plans of the original CT would then attach by themselves to a breast that \
                 is no longer there. If the system cannot do otherwise, write frame = \"{CONFIRMED}\""
            );
            return Err(value("export.frame", reason));
        }
        Some(other) => {
            return Err(value(
                "export.frame",
                format!("\"{other}\" is none of \"new\", \"source\""),
            ));
        }
    };
    if same_frame && file.registration == Some(true) {
        let reason = "a registration leads from one frame of reference to another, and \
                      `export.frame` asks for one alone";
        return Err(value("export.registration", reason));
    }
    Ok(ExportWish {
        anonymise: file.anonymise,
        registration: !same_frame && file.registration.unwrap_or(true),
        policy: Policy {
            new_study: one_of("export.study", file.study.as_deref(), &study)?,
            keep_equipment: one_of("export.equipment", file.equipment.as_deref(), &equipment)?,
            same_frame,
        },
    })
}

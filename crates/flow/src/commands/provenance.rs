//! `supine provenance`: the chain of a run for other programs.

use super::input;
use crate::Error;
use std::path::Path;
use supine_report::Summary;

/// The provenance of a finished run as W3C PROV-JSON.
///
/// # Errors
/// When the folder holds no summary, or one of another version.
pub fn provenance(run: &Path) -> Result<serde_json::Value, Error> {
    let folder = run.display();
    let json = crate::folder::summary_of(run).ok_or_else(|| {
        input(format!("{folder} holds no summary.json; name the folder of a finished run"))
    })?;
    let summary: Summary = serde_json::from_value(json).map_err(|_| {
        input(format!("{folder} was left by another version of this program; run its case again"))
    })?;
    Ok(supine_report::provenance(&summary))
}

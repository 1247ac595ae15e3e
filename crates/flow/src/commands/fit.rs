//! `supine fit`: the modulus of a case by its scans.

use super::run::{Change, spec};
use super::{Gather, input, messages, usage};
use crate::folder::RunFolder;
use crate::nodes::Fit as Node;
use crate::session::{Request, Start};
use crate::{Error, Observer};
use serde::Serialize;
use std::path::PathBuf;
use supine_report::{TissueFit, Warning};

/// What is asked.
#[derive(Clone, Debug)]
pub struct Fit {
    /// A case file, or the summary of a run.
    pub case: PathBuf,
    /// Changes of its values.
    pub changes: Vec<Change>,
    /// The folder of the run: what is made on the way is kept there for `supine run`.
    pub out: PathBuf,
    /// Replaces the finished result of another case.
    pub overwrite: bool,
    /// When and by which command it began.
    pub start: Option<Start>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct FitDone {
    /// The modulus in each rest state.
    pub fit: TissueFit,
    /// What the user must know.
    #[serde(serialize_with = "messages")]
    pub warnings: Vec<Warning>,
}

/// Fits the modulus of a case to its scans.
///
/// # Errors
/// When the case names no scan of the sitting patient, cannot be used, or a stage fails.
pub fn fit(given: &Fit, observer: &dyn Observer) -> Result<FitDone, Error> {
    let spec = spec(&given.case, &given.changes)?;
    spec.note_doubts(observer);
    spec.check_complete()?;
    if spec.case()?.fit_scans().is_none() {
        return Err(input(
            "the case names no scan of the sitting patient: add scans = { sitting = \"sitting.ply\" }",
        ));
    }
    let session = super::session(&spec)?;
    session.refuse_overlap(&given.out)?;
    let folder = RunFolder::open(&given.out)?.overwriting(given.overwrite);
    let session = session.with_folder(folder)?.with_start(given.start.clone());
    let gather = Gather::new(observer, &[]);
    let fitted = session.get::<Node>(&Request { observer: &gather, ..Request::default() })?;
    let fit = fitted.tissue().cloned().ok_or_else(|| usage("no scan was fitted"))?;
    Ok(FitDone { fit, warnings: gather.warnings() })
}

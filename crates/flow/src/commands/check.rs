//! `supine check`: whether a case can be run, and what a run would do.

use super::run::{Change, spec};
use crate::folder::FinishedRun;
use crate::{Error, NodeId};
use serde::Serialize;
use std::path::PathBuf;

/// What is asked.
#[derive(Clone, Debug)]
pub struct Check {
    /// A case file, or the summary of a run.
    pub case: PathBuf,
    /// Changes of its values.
    pub changes: Vec<Change>,
    /// The folder of a run, which is only looked at.
    pub out: Option<PathBuf>,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct CheckDone {
    /// The case file.
    pub case: PathBuf,
    /// The stages that a run into the folder would do, in their order, where one was named: all whose key is not that
    /// of the finished run in it.
    pub redone: Option<Vec<&'static str>>,
}

/// Checks the values of a case together, and that its files are there.
///
/// # Errors
/// Why the case cannot be run.
pub fn check(given: &Check) -> Result<CheckDone, Error> {
    let session = super::session(&spec(&given.case, &given.changes)?)?;
    session.case().check_complete()?;
    let run = given.out.as_deref().and_then(|out| FinishedRun::open(out).ok());
    let secret = run.as_ref().map(FinishedRun::secret).transpose()?.flatten();
    let left = run.and_then(|run| run.summary().ok()).map(|summary| summary.chain);
    let redone = session.redone(&left.unwrap_or_default(), secret)?;
    let redone = redone.into_iter().map(NodeId::name).collect();
    Ok(CheckDone { case: given.case.clone(), redone: given.out.is_some().then_some(redone) })
}

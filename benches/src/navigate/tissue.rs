//! The tissue of a run, as a session has it.

use anyhow::Result;
use std::path::Path;
use supine_flow::Request;
use supine_navigate::{Follower, Patient, Settings};
use supine_space::{Pose, Progress};

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The patient of a run.
pub(crate) fn patient(run: &Path, settings: &Settings) -> Result<Patient> {
    let request = Request::default();
    Ok(Patient::open(run, settings, threads(), request.observer)?)
}

/// Where the applicator is planned, and the number of tetrahedra.
pub(crate) fn planned(run: &Path, settings: &Settings) -> Result<(Pose, usize)> {
    let patient = patient(run, settings)?;
    Ok((patient.placed(settings)?, patient.tetrahedra()))
}

/// What a session solves with.
pub(crate) fn follower(run: &Path, settings: &Settings) -> Result<Follower> {
    Ok(patient(run, settings)?.follower(settings, Progress::none())?)
}

//! The Python package and batches beside single runs of the command line.

use super::{Bench, output};
use crate::python;
use anyhow::Result;
use std::process::Command;

const TEXT: &str = include_str!("scripting.md");

/// Text and tables: of `benches/scripting.py`.
pub(super) fn section(bench: &Bench<'_>) -> Result<String> {
    let house = bench.house;
    let (interpreter, wheel) = python::installed(house, "release", &crate::steps::run)?;
    let fixture = house.root.join("fixtures/patient/case.toml");
    let cohort = super::patients::cases(bench)?;
    let mut script = Command::new(interpreter);
    script
        .arg("-B")
        .arg(house.root.join("benches/scripting.py"))
        .arg("--supine")
        .arg(&bench.supine);
    script.arg("--case").arg(fixture).arg("--wheel").arg(wheel).arg("--cohort").args(cohort);
    Ok(String::from(TEXT) + &output(&mut script)?)
}

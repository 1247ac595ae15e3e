//! The wheel for Python, for any Linux with the C library of Debian 12 or later.

use super::Release;
use crate::python;
use crate::steps::run;
use anyhow::{Context, Result};
use std::process::Command;

/// A tumour's way from the first import to the answer, in an environment that holds the wheel and
/// what it asks for.
const TRIAL: &str = "import sys, warnings, supine; warnings.simplefilter('ignore'); \
                     session = supine.Session.read(sys.argv[1]); print(supine.__version__, session.tumour)";

/// `supine-VERSION-cp310-abi3-….whl`.
pub(super) fn build(release: &Release<'_>) -> Result<()> {
    let (_, wheel) = python::installed(release.house, "release", &run)?;
    let file = release.dist.join(wheel.file_name().context("a wheel has a name")?);
    std::fs::copy(&wheel, &file)?;
    super::made(&file)
}

/// Installs it into a new environment, with what it asks for.
pub(super) fn trial(release: &Release<'_>) -> Result<()> {
    let folder = release.folder("environment")?;
    run(Command::new("python3").args(["-m", "venv"]).arg(&folder))?;
    let python = folder.join("bin/python");
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.args(["--find-links"]).arg(&release.dist);
    run(pip.arg(format!("supine=={}", release.version)))?;
    let case = release.house.root.join("fixtures/patient/case.toml");
    run(Command::new(&python).args(["-c", TRIAL]).arg(case))
}

//! What is tested by pytest: the Python package, as the wheel that users install, and the workflow for clusters.

use crate::House;
use crate::readers::environment;
use crate::steps::run;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds the wheel and tests it: against the command line `binary`, which must be made in the same way.
///
/// # Errors
/// When it cannot be built, or a test fails.
pub(crate) fn test(house: &House, binary: &Path) -> Result<()> {
    // As the tests are built, so that what does not differ is not made again.
    let (python, _) = installed(house, "dev")?;
    let mut tests = Command::new(&python);
    tests.args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider"]);
    // Not from the folder of the sources: the package that is imported is the one that was installed.
    tests.arg(house.root.join("crates/python/tests")).current_dir(&house.target);
    run(tests.env("SUPINE", binary).env("PYTHONDONTWRITEBYTECODE", "1"))
}

/// Tests the workflow: Snakemake on this machine, by Slurm and by a stand-in for Kubernetes, on loopback alone.
///
/// # Errors
/// When its packages cannot be had, or a test fails.
pub(crate) fn workflow(house: &House, binary: &Path) -> Result<()> {
    let modules = "snakemake, pytest, snakemake_executor_plugin_slurm, snakemake_executor_plugin_kubernetes, \
                   snakemake_storage_plugin_fs";
    let python = environment(house, "workflow", modules)?;
    let mut tests = Command::new(python);
    tests.args(["-B", "-m", "pytest", "--quiet", "-p", "no:cacheprovider"]);
    tests.arg(house.root.join("tests/readers/workflow")).arg("--supine").arg(binary);
    run(tests.arg("--patient").arg(house.root.join("fixtures/patient")))
}

/// Builds the wheel by a profile of cargo and installs it; the Python that has it, and the wheel.
///
/// # Errors
/// When it cannot be built or installed.
pub(crate) fn installed(house: &House, profile: &str) -> Result<(PathBuf, PathBuf)> {
    let python = environment(house, "python", "numpy, mypy, pytest")?;
    let wheel = wheel(house, &python, profile)?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    run(Command::new(&python).args(pip).arg("--force-reinstall").arg(&wheel))?;
    Ok((python, wheel))
}

/// Builds the wheel by a profile of cargo.
///
/// # Errors
/// When it cannot be built.
fn wheel(house: &House, python: &Path, profile: &str) -> Result<PathBuf> {
    let out = house.target.join("wheels");
    if out.exists() {
        std::fs::remove_dir_all(&out).context("cannot remove the old wheels")?;
    }
    let mut build = Command::new(python);
    build.args(["-m", "maturin", "build", "--locked", "--profile", profile, "--out"]).arg(&out);
    build.arg("--interpreter").arg(python).current_dir(house.root.join("crates/python"));
    run(build.env("CARGO_TARGET_DIR", &house.target))?;
    let mut wheels = std::fs::read_dir(&out)?.map(|entry| Ok(entry?.path()));
    match (wheels.next(), wheels.next()) {
        (Some(wheel), None) => wheel,
        _ => bail!("{} should hold one wheel", out.display()),
    }
}

//! What is tested by pytest: the Python package, as the wheel that users install, and the workflow
//! for clusters.

use crate::House;
use crate::readers::Environment;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// What builds, installs and types the package.
pub(crate) const PACKAGE: Environment =
    Environment { name: "python", modules: "numpy, mypy, pytest" };
/// The engine of the workflow, with what it speaks to clusters by.
pub(crate) const WORKFLOW: Environment = Environment {
    name: "workflow",
    modules: "snakemake, pytest, snakemake_executor_plugin_slurm, snakemake_executor_plugin_kubernetes, \
              snakemake_storage_plugin_fs",
};

/// How commands are run: shown, or quietly.
pub(crate) type Runs<'a> = dyn Fn(&mut Command) -> Result<()> + 'a;

/// The tests of the installed package against the command line `binary`, which must be made in the
/// same way.
pub(crate) fn tests(house: &House, binary: &Path) -> Command {
    let mut tests = Command::new(PACKAGE.python(house));
    tests.args(["-m", "pytest"]).arg(house.root.join("crates/python/tests"));
    // Not from the folder of the sources: the package that is imported is the one that was
    // installed.
    tests.current_dir(&house.target).env("SUPINE", binary).env("PYTHONDONTWRITEBYTECODE", "1");
    tests
}

/// The tests of the workflow: Snakemake on this machine, by Slurm and by a stand-in for Kubernetes,
/// on loopback alone.
pub(crate) fn workflow(house: &House, binary: &Path) -> Command {
    let mut tests = Command::new(WORKFLOW.python(house));
    tests.args(["-B", "-m", "pytest"]).arg(house.root.join("tests/readers/workflow"));
    tests.arg("--supine").arg(binary).arg("--patient").arg(house.root.join("fixtures/patient"));
    tests
}

/// Builds the wheel by a profile of cargo and installs it; the Python that has it, and the wheel.
///
/// # Errors
/// When it cannot be built or installed.
pub(crate) fn installed(
    house: &House,
    profile: &str,
    run: &Runs<'_>,
) -> Result<(PathBuf, PathBuf)> {
    PACKAGE.install(house)?;
    let python = PACKAGE.python(house);
    let wheel = wheel(house, &python, profile, run)?;
    let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    run(Command::new(&python).args(pip).arg("--force-reinstall").arg(&wheel))?;
    Ok((python, wheel))
}

/// Builds the wheel by a profile of cargo.
///
/// # Errors
/// When it cannot be built.
fn wheel(house: &House, python: &Path, profile: &str, run: &Runs<'_>) -> Result<PathBuf> {
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

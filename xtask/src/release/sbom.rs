//! The bill of materials: every crate of the program for Linux, with version, licence and hash, as
//! CycloneDX.

use super::build::Platform;
use super::tools::CYCLONEDX;
use super::{Release, empty};
use crate::steps::run;
use anyhow::{Context, Result};
use std::process::Command;

/// `supine-VERSION.cdx.json`.
pub(super) fn write(release: &Release<'_>) -> Result<()> {
    let tool = CYCLONEDX.installed(release.house)?;
    // It writes beside every manifest of the workspace, so it is given a copy.
    let copy = empty(release.parts.join("sources"))?;
    let script = "git -C \"$1\" archive HEAD | tar --extract";
    run(Command::new("sh").args(["-c", script, "sh"]).arg(&release.house.root).current_dir(&copy))?;
    let mut bill = Command::new(tool);
    bill.current_dir(&copy).env("SOURCE_DATE_EPOCH", &release.epoch);
    bill.args(["cyclonedx", "--manifest-path", "cli/Cargo.toml", "--format", "json"]);
    bill.args(["--spec-version", "1.5", "--target", Platform::Linux.triple()]);
    run(bill.args(["--override-filename", "bill"]))?;
    let file = release.dist.join(format!("supine-{}.cdx.json", release.version));
    let bill =
        std::fs::read_to_string(copy.join("cli/bill.json")).context("no bill was written")?;
    // It names the project's own crates by their place on this machine.
    std::fs::write(&file, bill.replace(&copy.display().to_string(), "/supine"))?;
    super::made(&file)
}

//! The same commit gives the same bytes in another folder.

use super::build::{Platform, Site, build};
use super::{Release, empty};
use crate::steps::run;
use anyhow::{Context, Result, ensure};
use std::process::Command;

/// Builds the static program from a clone of the commit in a folder of another name and depth, from
/// nothing, and compares it with the one that was built here.
pub(super) fn check(release: &Release<'_>) -> Result<()> {
    let folder = empty(release.parts.join("elsewhere/deeper"))?;
    let (source, target) = (folder.join("clone"), folder.join("built"));
    let mut clone = Command::new("git");
    run(clone.args(["clone", "--quiet"]).arg(&release.house.root).arg(&source))?;
    let there = build(&Site { source: &source, target: &target }, Platform::Linux)?;
    let here = release.program(Platform::Linux);
    let read = |path| std::fs::read(path).context("make it first: `cargo xtask release linux`");
    let (here, there) = (read(&here)?, read(&there)?);
    let differ = here.iter().zip(&there).filter(|(a, b)| a != b).count();
    println!("{} bytes here, {} elsewhere, {differ} of them differ", here.len(), there.len());
    ensure!(here == there, "the program depends on where it is built");
    Ok(())
}

//! The archives for Linux and Windows: the same files in the same order with the same dates,
//! whoever packs them.

use super::build::Platform;
use super::{Release, papers, tools};
use crate::steps::run;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The licences of mingw-w64, as Debian ships them with its compiler.
const MINGW: &str = "/usr/share/doc/mingw-w64-x86-64-dev/copyright";

/// `supine-VERSION-x86_64-linux.tar.gz`.
pub(super) fn linux(release: &Release<'_>) -> Result<()> {
    let name = name(release, "linux");
    let folder = release.folder("linux")?;
    lay_out(release, Platform::Linux, &folder.join(&name), &["man", "completions"])?;
    let archive = linux_file(release);
    let mut tar = Command::new("tar");
    tar.current_dir(&folder).args(["--create", "--sort=name", "--format=gnu"]);
    tar.args(["--owner=0", "--group=0", "--numeric-owner", "--mode=u+w,go=u-w"]);
    tar.arg(format!("--mtime=@{}", release.epoch));
    // No name and no time in gzip's header either.
    tar.args(["--use-compress-program", "gzip --best --no-name", "--file"]).arg(&archive);
    run(tar.arg(&name))?;
    super::made(&archive)
}

/// `supine-VERSION-x86_64-windows.zip`.
pub(super) fn windows(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("zip", "zip")])?;
    let name = name(release, "windows");
    let folder = release.folder("windows")?;
    lay_out(release, Platform::Windows, &folder.join(&name), &["completions"])?;
    // The GNU linker adds the start-up code of mingw-w64.
    std::fs::copy(MINGW, folder.join(&name).join("MINGW-W64-LICENCES.txt")).context(MINGW)?;
    let archive = windows_file(release);
    if archive.exists() {
        std::fs::remove_file(&archive)?;
    }
    // A zip has local times, in the order in which files are named.
    let script = "find . -exec touch --no-dereference --date=@\"$1\" {} + \
                  && find . -type f | sort | zip --quiet -9 -X -D -@ \"$2\"";
    let mut zip = Command::new("sh");
    zip.args(["-c", script, "sh", &release.epoch]).arg(&archive);
    run(zip.current_dir(&folder).envs([("TZ", "UTC"), ("LC_ALL", "C")]))?;
    super::made(&archive)
}

pub(super) fn linux_file(release: &Release<'_>) -> PathBuf {
    release.dist.join(name(release, "linux") + ".tar.gz")
}

pub(super) fn windows_file(release: &Release<'_>) -> PathBuf {
    release.dist.join(name(release, "windows") + ".zip")
}

/// The name of an archive and of the folder in it.
fn name(release: &Release<'_>, system: &str) -> String {
    format!("supine-{}-x86_64-{system}", release.version)
}

/// The program and its papers in one folder.
fn lay_out(release: &Release<'_>, platform: Platform, to: &Path, papers: &[&str]) -> Result<()> {
    let from = papers::folder(release);
    papers::copy(&from.join("doc"), to)?;
    for folder in papers {
        papers::copy(&from.join(folder), &to.join(folder))?;
    }
    std::fs::copy(release.program(platform), to.join(platform.file()))?;
    Ok(())
}

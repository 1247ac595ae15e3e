//! `cargo xtask release --test`: each artefact on a clean system.
//!
//! A clean Debian 12 made by mmdebstrap takes the package; a root with no file but the program
//! takes the archive, which shows that it needs nothing; Wine takes the program for Windows. What
//! it costs is printed with each step.

use super::build::Platform;
use super::{Part, Release, archives, container, debian, empty, said, tools, wheel};
use crate::steps::{Steps, run};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::Command;

/// Debian's Wine for 64-bit programs, which is not on the path.
const WINE: &str = "/usr/lib/wine/wine64";
/// The exported series below a result.
const SERIES: &str = "ct";

pub(super) fn run_steps(release: &Release<'_>, parts: &[Part], steps: &mut Steps) {
    let wanted = |part| parts.is_empty() || parts.contains(&part);
    steps.run("checksums", || {
        run(Command::new("sha256sum").args(["--check", "SHA256SUMS"]).current_dir(&release.dist))
    });
    if wanted(Part::Linux) {
        steps.run("archive for Linux in an empty root", || linux(release));
    }
    if wanted(Part::Debian) {
        steps.run("package on a clean Debian 12", || package(release));
    }
    if wanted(Part::Container) {
        steps.run("container", || image(release));
    }
    if wanted(Part::Wheel) {
        steps.run("wheel in a new environment", || wheel::trial(release));
    }
    if wanted(Part::Windows) {
        steps.run("archive for Windows under Wine", || windows(release));
    }
}

/// Unpacks the archive into a root that holds nothing else, and runs the demo there.
fn linux(release: &Release<'_>) -> Result<()> {
    let root = release.folder("root-empty")?;
    let mut tar = Command::new("tar");
    tar.args(["--extract", "--strip-components=1", "--no-same-owner", "--file"]);
    run(tar.arg(archives::linux_file(release)).arg("--directory").arg(&root))?;
    let supine = |arguments: &[&str]| run(inside(&root).arg("/supine").args(arguments));
    supine(&["--version"])?;
    supine(&["demo", "--out", "/demo", "--no-progress"])?;
    sizes_of(&root.join("demo"))
}

/// Installs the package, and looks for what it promises.
fn package(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("mmdebstrap", "mmdebstrap")])?;
    let root = release.folder("root-debian")?;
    let mut strap = Command::new("mmdebstrap");
    // man-db looks for the manual pages; supine itself needs none of it.
    strap.args(["--quiet", "--variant=minbase", "--include=man-db", "bookworm"]);
    run(strap.arg(&root))?;
    std::fs::copy(debian::file(release), root.join("supine.deb"))?;
    let there = |arguments: &[&str]| run(inside(&root).args(arguments));
    there(&["dpkg", "--install", "/supine.deb"])?;
    there(&["supine", "--version"])?;
    there(&["supine", "demo", "--help"])?;
    there(&["man", "-w", "supine", "supine-run"])?;
    for file in debian::completions() {
        ensure!(root.join("usr/share").join(file).is_file(), "{file} is not there");
    }
    there(&["dpkg", "--purge", "supine"])?;
    ensure!(!root.join("usr/share/doc/supine").exists(), "purging leaves something");
    Ok(())
}

/// Runs the image as it is in its archive, by buildah in a chroot: that needs no more of the kernel
/// than root.
fn image(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("buildah", "buildah")])?;
    let archive = format!("oci-archive:{}", container::file(release).display());
    let mut from = container::buildah(release);
    let container = said(from.args(["from", "--quiet", &archive]), &release.parts)?;
    let mut version = container::buildah(release);
    version.args(["run", "--isolation", "chroot", &container, "/usr/bin/supine", "--version"]);
    let ran = run(&mut version);
    run(container::buildah(release).args(["rm", &container]))?;
    ran
}

/// Runs the Windows program on what Linux was given, and compares the deformed CTs.
fn windows(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("unzip", "unzip")])?;
    if !Path::new(WINE).is_file() {
        crate::debian::install(&["wine64"])?;
    }
    let folder = release.folder("wine")?;
    run(Command::new("unzip")
        .args(["-q"])
        .arg(archives::windows_file(release))
        .current_dir(&folder))?;
    let unpacked = folder.join(format!("supine-{}-x86_64-windows", release.version));
    let prefix = folder.join("prefix");
    // Rust's standard library takes random numbers from a library of Windows that Wine 8 has not.
    tools::debian(&[("x86_64-w64-mingw32-gcc", "gcc-mingw-w64-x86-64")])?;
    let mut stand_in = Command::new("x86_64-w64-mingw32-gcc");
    stand_in.args(["-shared", "-o"]).arg(unpacked.join("bcryptprimitives.dll"));
    stand_in.arg(release.house.root.join("xtask/release/wine/bcryptprimitives.c"));
    run(stand_in.arg("-ladvapi32"))?;
    let wine = |arguments: &[&str]| {
        let mut wine = Command::new(WINE);
        wine.current_dir(&unpacked).arg(Platform::Windows.file()).args(arguments);
        wine.env("SOURCE_DATE_EPOCH", &release.epoch);
        run(wine.env("WINEPREFIX", &prefix).env("WINEDEBUG", "-all").env_remove("DISPLAY"))
    };
    wine(&["--version"])?;
    wine(&["demo", "--out", "demo", "--no-progress"])?;
    wine(&["inspect", "demo/case/ct"])?;
    let there = unpacked.join("demo");
    let here = empty(folder.join("linux"))?;
    let mut demo = Command::new(release.program(Platform::Linux));
    // The series tells when it was made.
    demo.env("SOURCE_DATE_EPOCH", &release.epoch);
    run(demo.args(["demo", "--no-progress", "--out"]).arg(&here))?;
    let same = sums(&here.join(SERIES))? == sums(&there.join(SERIES))?;
    println!(
        "the deformed CT of Windows and of Linux: {}",
        if same { "equal" } else { "DIFFERENT" }
    );
    ensure!(same, "the deformed CT depends on the system");
    Ok(())
}

/// A command in another root.
fn inside(root: &Path) -> Command {
    let mut command = Command::new("chroot");
    command.arg(root);
    command
}

/// The sums of the files of a folder, by name.
fn sums(folder: &Path) -> Result<String> {
    let script = "find . -type f | LC_ALL=C sort | xargs sha256sum";
    said(Command::new("sh").args(["-c", script]), folder)
}

fn sizes_of(result: &Path) -> Result<()> {
    let report = result.join("report/index.html");
    let bytes = std::fs::metadata(&report).context("the demo left no report")?.len();
    println!("report: {bytes} bytes");
    Ok(())
}

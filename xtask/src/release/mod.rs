//! `cargo xtask release`: everything that is given to users, made into `target/dist`.
//!
//! One module per artefact; each takes what it ships from `build` (programs) and `papers` (manual
//! pages, completions, guides, licences). The only time that stands in anything is that of the
//! commit. See docs/RELEASING.md.

mod archives;
mod build;
mod container;
mod debian;
mod licences;
mod papers;
mod reproduce;
mod sbom;
mod sums;
pub(crate) mod tools;
mod trial;
mod wheel;

use crate::House;
use crate::steps::Steps;
use anyhow::{Context, Result, ensure};
use build::Platform;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What can be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Part {
    /// The static program for Linux, with its papers, as a tar.gz
    Linux,
    /// The program for Windows, as a zip
    Windows,
    /// The package for Debian 12
    Debian,
    /// What the programs are made of, as CycloneDX
    Sbom,
    /// The container image
    Container,
    /// The wheel for Python
    Wheel,
}

#[derive(clap::Args)]
pub(crate) struct Options {
    /// Only these parts; all of them where none is named
    #[arg(value_enum)]
    parts: Vec<Part>,
    /// Makes nothing: builds the commit once more in a clean folder elsewhere and compares the
    /// program with that of target/dist, byte for byte
    #[arg(long, conflicts_with = "parts")]
    check: bool,
    /// Makes nothing: installs what lies in target/dist into clean systems and tries it there;
    /// needs root
    #[arg(long)]
    test: bool,
}

/// What all parts share.
pub(crate) struct Release<'a> {
    house: &'a House,
    /// Where the artefacts go.
    dist: PathBuf,
    /// Where their contents are laid out first.
    parts: PathBuf,
    version: String,
    /// When the commit was made, seconds since 1970.
    epoch: String,
}

/// # Errors
/// When a step failed; every step was run.
pub(crate) fn release(house: &House, options: &Options) -> Result<()> {
    let release = Release::of(house)?;
    let mut steps = Steps::new();
    if options.check {
        steps.run("the same bytes elsewhere", || reproduce::check(&release));
    } else if options.test {
        trial::run_steps(&release, &options.parts, &mut steps);
    } else {
        release.make(&options.parts, &mut steps);
    }
    steps.finish()
}

impl<'a> Release<'a> {
    fn of(house: &'a House) -> Result<Self> {
        let release = Self {
            house,
            dist: house.target.join("dist"),
            parts: house.target.join("release-parts"),
            version: version(house)?,
            epoch: said(Command::new("git").args(["log", "-1", "--format=%ct"]), &house.root)?,
        };
        for folder in [&release.dist, &release.parts] {
            std::fs::create_dir_all(folder)?;
        }
        Ok(release)
    }

    fn make(&self, parts: &[Part], steps: &mut Steps) {
        let wanted = |part| parts.is_empty() || parts.contains(&part);
        // The static program writes the manual pages and completions of all others.
        let mut ready = false;
        steps.run("static Linux program and papers", || {
            build::program(self, Platform::Linux)?;
            papers::collect(self)?;
            ready = true;
            Ok(())
        });
        if !ready {
            // Nothing goes out with what lay there from another commit.
            return;
        }
        if wanted(Part::Linux) {
            steps.run("archive for Linux", || archives::linux(self));
        }
        if wanted(Part::Windows) {
            steps.run("program for Windows", || build::program(self, Platform::Windows).map(drop));
            steps.run("archive for Windows", || archives::windows(self));
        }
        if wanted(Part::Debian) {
            steps.run("Debian package", || debian::package(self));
        }
        if wanted(Part::Sbom) {
            steps.run("bill of materials", || sbom::write(self));
        }
        if wanted(Part::Container) {
            steps.run("container image", || container::image(self));
        }
        if wanted(Part::Wheel) {
            steps.run("wheel for Python", || wheel::build(self));
        }
        // Last: over all that lies there.
        steps.run("checksums", || sums::write(&self.dist));
    }

    /// Where a program was built.
    fn program(&self, platform: Platform) -> PathBuf {
        self.house.target.join(platform.triple()).join("shipped").join(platform.file())
    }

    /// An empty folder for the contents of a part.
    fn folder(&self, name: &str) -> Result<PathBuf> {
        empty(self.parts.join(name))
    }
}

/// A folder that is there and empty.
fn empty(folder: PathBuf) -> Result<PathBuf> {
    if folder.exists() {
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The version of the program.
fn version(house: &House) -> Result<String> {
    let metadata =
        cargo_metadata::MetadataCommand::new().no_deps().current_dir(&house.root).exec()?;
    let program = metadata.packages.iter().find(|package| package.name == "supine");
    Ok(program.context("no package supine")?.version.to_string())
}

/// What a command says on its standard output, without the end of the line.
fn said(command: &mut Command, folder: &Path) -> Result<String> {
    let out = command.current_dir(folder).output().with_context(|| format!("{command:?}"))?;
    ensure!(out.status.success(), "{command:?}: {}", String::from_utf8_lossy(&out.stderr));
    Ok(String::from_utf8(out.stdout)?.trim().to_owned())
}

/// Says what was made, and how large it is.
fn made(file: &Path) -> Result<()> {
    let bytes = std::fs::metadata(file).with_context(|| file.display().to_string())?.len();
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    println!("{name}: {:.1} MB ({bytes} bytes)", bytes as f64 / 1e6);
    Ok(())
}

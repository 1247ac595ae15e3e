//! Chores of the house, run as `cargo xtask NAME`.
//!
//! One variant of `Chore` and one module per chore; `steps` names, times and sums up what a chore
//! does, `readers` installs the independent readers that the conformance tests ask.
#![expect(
    clippy::print_stdout,
    clippy::print_stderr,
    clippy::disallowed_methods,
    reason = "a chore talks to the developer, times its steps and touches files under target/"
)]

mod check;
mod compiler;
mod debian;
mod fuzz;
mod meshers;
mod python;
mod readers;
mod release;
mod site;
mod solvers;
mod steps;
mod verify;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

/// Chores of the house.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Subcommand)]
enum Chore {
    /// Everything that must hold: format, lints, documentation, licences, all tests. Installs once
    /// what the independent readers need (apt packages, Python environments under target/).
    Test(check::Options),
    /// Only what `test` installs: the independent readers.
    Readers,
    /// Fuzzes the readers of foreign files; needs cargo-fuzz and a nightly compiler.
    Fuzz(fuzz::Options),
    /// Makes all that is given to users into target/dist; see docs/RELEASING.md.
    Release(release::Options),
    /// Makes the pages of docs/ into a site in target/site, and follows its links.
    Site,
    /// Runs the stages beside the peers, in one run; needs the reference data in
    /// ../shared.
    Bench {
        /// One stage alone
        #[arg(value_enum)]
        stage: Option<verify::Measured>,
    },
    /// Writes docs/VERIFICATION.md and docs/pictures from real runs; needs the developers'
    /// reference data in ../shared.
    Verify {
        /// Only these parts of the page
        #[arg(value_enum)]
        parts: Vec<verify::Part>,
    },
}

/// Where things are.
struct House {
    /// The folder of the workspace's Cargo.toml.
    root: PathBuf,
    /// Cargo's target folder.
    target: PathBuf,
}

impl House {
    /// The cargo that runs this chore.
    fn cargo(&self) -> OsString {
        std::env::var_os("CARGO").unwrap_or_else(|| OsString::from("cargo"))
    }

    fn find() -> Result<Self> {
        let metadata = cargo_metadata::MetadataCommand::new()
            .no_deps()
            .exec()
            .context("cargo metadata does not answer; run `cargo xtask` inside the repository")?;
        Ok(Self {
            root: metadata.workspace_root.into_std_path_buf(),
            target: metadata.target_directory.into_std_path_buf(),
        })
    }
}

fn chore() -> Result<()> {
    let arguments = Arguments::parse();
    let house = House::find()?;
    match arguments.chore {
        Chore::Test(options) => check::run_steps(&house, &options),
        Chore::Readers => readers::install(&house),
        Chore::Fuzz(options) => fuzz::fuzz(&house, &options),
        Chore::Release(options) => release::release(&house, &options),
        Chore::Site => site::build(&house),
        Chore::Bench { stage } => verify::bench(&house, stage),
        Chore::Verify { parts } => verify::verify(&house, &parts),
    }
}

fn main() -> ExitCode {
    match compiler::stand_in().and_then(|()| chore()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cargo xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

//! Programs that make artefacts: from Debian, or by `cargo install` into `target/tools`, once, in
//! the version given here.

use crate::House;
use crate::debian;
use crate::readers::on_path;
use crate::steps::{cargo, run};
use anyhow::{Result, ensure};
use std::path::PathBuf;

/// A program from crates.io.
pub(crate) struct Tool {
    package: &'static str,
    version: &'static str,
    features: &'static [&'static str],
}

/// Writes bills of materials.
pub(crate) const CYCLONEDX: Tool =
    Tool { package: "cargo-cyclonedx", version: "0.5.9", features: &[] };
/// Makes the site; without its server.
pub(crate) const MDBOOK: Tool = Tool {
    package: "mdbook",
    version: "0.5.4",
    features: &["--no-default-features", "--features", "search"],
};

impl Tool {
    /// The program; it is installed where it is not there in this version.
    ///
    /// # Errors
    /// When it cannot be compiled.
    pub(crate) fn installed(&self, house: &House) -> Result<PathBuf> {
        let root = house.target.join("tools").join(format!("{}-{}", self.package, self.version));
        let program = root.join("bin").join(self.package);
        // The folder bears the version, and cargo puts the program there last.
        if program.is_file() {
            return Ok(program);
        }
        println!("installing {} {}, once: {}", self.package, self.version, root.display());
        let mut install = cargo(&house.root);
        install.args(["install", "--locked", "--version", self.version]);
        install.args(self.features).arg("--root").arg(&root).arg(self.package);
        install.env("CARGO_TARGET_DIR", house.target.join("tools/build"));
        run(&mut install)?;
        ensure!(program.is_file(), "{} was installed but is not there", program.display());
        Ok(program)
    }
}

/// Sees that programs are there, each given with the Debian package that brings it.
///
/// # Errors
/// When one is missing and cannot be installed.
pub(crate) fn debian(programs: &[(&str, &str)]) -> Result<()> {
    let missing = programs.iter().filter(|(program, _)| !on_path(program));
    let packages: Vec<&str> = missing.map(|(_, package)| *package).collect();
    if packages.is_empty() { Ok(()) } else { debian::install(&packages) }
}

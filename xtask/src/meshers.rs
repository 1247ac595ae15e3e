//! The meshers under licences of their own: what they need from Debian, and their tests.

use crate::readers::{install_debian, on_path};
use crate::steps::run;
use anyhow::{Result, bail};
use std::path::Path;
use std::process::Command;

/// A file of each Debian package that the features need, and the package.
const HEADERS: [(&str, &str); 2] = [
    ("/usr/include/CGAL/make_mesh_3.h", "libcgal-dev"),
    ("/usr/include/tetgen.h", "libtet1.5-dev"),
];
/// What cargo is told to switch both on.
const FEATURES: &str = "supine-tetrahedralise-cgal/cgal,supine-tetrahedralise-tetgen/tetgen,\
                        supine-flow/cgal,supine-flow/tetgen,supine/cgal,supine/tetgen";
/// The tests of what they compile. The whole workspace is named and these tests picked from it, so that
/// cargo resolves all other crates as it did before and compiles none of them again.
const TESTS: [&str; 6] = ["--test", "layer", "--test", "worker", "--test", "meshers"];

/// Installs what is missing.
///
/// # Errors
/// When a package or a C++ compiler is missing and cannot be installed; the message says what to do by
/// hand.
pub(crate) fn install() -> Result<()> {
    let missing = HEADERS.iter().filter(|(header, _)| !Path::new(header).is_file());
    let mut packages: Vec<&str> = missing.map(|(_, package)| *package).collect();
    if !on_path("c++") {
        packages.push("g++");
    }
    if packages.is_empty() {
        println!("the Debian packages of the other meshers are installed");
        return Ok(());
    }
    install_debian(&packages)?;
    if let Some((header, package)) = HEADERS.iter().find(|(header, _)| !Path::new(header).is_file())
    {
        bail!("{package} was installed but brought no {header}");
    }
    Ok(())
}

/// Lints and tests what the features compile. `cargo` starts a cargo in the root of the repository.
pub(crate) fn test(cargo: impl Fn() -> Command, lints: bool) -> Result<()> {
    let workspace = ["--workspace", "--features", FEATURES];
    if lints {
        let mut clippy = cargo();
        clippy.arg("clippy").args(workspace).args(["--all-targets", "--", "-D", "warnings"]);
        run(&mut clippy)?;
    }
    let mut test = cargo();
    test.arg("test").args(workspace).args(TESTS).arg("--no-fail-fast");
    run(&mut test)
}

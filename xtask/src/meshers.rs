//! The meshers under licences of their own: what they need from Debian, and what compiles and tests
//! them.

use crate::debian;
use anyhow::Result;
use std::path::Path;
use std::process::Command;

/// A file of each Debian package that the features need, and the package.
pub(crate) const HEADERS: [(&str, &str); 2] = [
    ("/usr/include/CGAL/make_mesh_3.h", "libcgal-dev"),
    ("/usr/include/tetgen.h", "libtet1.5-dev"),
];
/// What the features compile otherwise than without them, and what is tested with them.
pub(crate) const PACKAGES: [&str; 3] =
    ["supine-tetrahedralise-cgal", "supine-tetrahedralise-tetgen", "supine"];
/// What cargo is told to switch both on.
const FEATURES: &str = "supine-tetrahedralise-cgal/cgal,supine-tetrahedralise-tetgen/tetgen,\
                        supine/cgal,supine/tetgen";

/// Installs what is missing.
///
/// # Errors
/// When a package is missing and cannot be installed; the message says what to do by hand.
pub(crate) fn install() -> Result<()> {
    let missing = HEADERS.iter().filter(|(header, _)| !Path::new(header).is_file());
    let packages: Vec<&str> = missing.map(|(_, package)| *package).collect();
    if packages.is_empty() { Ok(()) } else { debian::install(&packages) }
}

/// The tests of what the features compile.
pub(crate) fn tests(mut cargo: Command) -> Command {
    with_features(cargo.arg("test"));
    cargo.args(["--test", "layer", "--test", "worker", "--test", "meshers"]);
    cargo
}

fn with_features(cargo: &mut Command) {
    PACKAGES.iter().for_each(|package| {
        cargo.args(["--package", package]);
    });
    cargo.args(["--features", FEATURES]);
}

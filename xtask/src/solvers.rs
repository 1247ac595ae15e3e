//! The finite-element programs that `cargo xtask bench mechanics` runs beside ours.

use crate::debian;
use anyhow::{Result, ensure};
use std::process::{Command, Stdio};

/// The Python that Debian's packages belong to.
pub(crate) const PYTHON: &str = "/usr/bin/python3";
const PACKAGE: &str = "python3-dolfinx";

/// Installs dolfinx from Debian if it is missing; felupe comes with an environment under target/.
///
/// # Errors
/// When it is missing and cannot be installed; the message says what to do by hand.
pub(crate) fn install() -> Result<()> {
    if answers() {
        return Ok(());
    }
    debian::install(&[PACKAGE])?;
    ensure!(answers(), "{PACKAGE} was installed, but {PYTHON} cannot import dolfinx");
    Ok(())
}

fn answers() -> bool {
    let mut import = Command::new(PYTHON);
    import.args(["-c", "import dolfinx"]).stdout(Stdio::null()).stderr(Stdio::null());
    import.status().is_ok_and(|status| status.success())
}

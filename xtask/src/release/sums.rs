//! SHA256SUMS: what a release consists of, and what is signed.

use anyhow::Result;
use std::path::Path;
use std::process::Command;

const FILE: &str = "SHA256SUMS";

/// Writes the sums of all files of a folder; `sha256sum --check SHA256SUMS` there holds them
/// against it.
pub(super) fn write(dist: &Path) -> Result<()> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(dist)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        // Signatures, and the list itself.
        if !name.starts_with(FILE) {
            names.push(name);
        }
    }
    names.sort();
    let sums = super::said(Command::new("sha256sum").arg("--").args(&names), dist)? + "\n";
    print!("{sums}");
    std::fs::write(dist.join(FILE), sums)?;
    Ok(())
}

//! What goes with the programs: manual pages, completions, guides, licences.

use super::build::Platform;
use super::{Release, empty, licences};
use crate::steps::run;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Shells, with the file that each looks for.
pub(super) const SHELLS: [(&str, &str); 4] = [
    ("bash", "supine.bash"),
    ("zsh", "_supine"),
    ("fish", "supine.fish"),
    ("powershell", "_supine.ps1"),
];

/// Pages of the root that are shipped as they are.
const PAGES: [&str; 4] = ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE"];

/// The licences of all crates that the programs hold.
pub(super) const THIRD_PARTY: &str = "THIRD-PARTY-LICENCES.txt";

/// Makes `man`, `completions` and `doc` in the folder [`folder`]; the programs of other systems are
/// given the same.
pub(super) fn collect(release: &Release<'_>) -> Result<()> {
    let papers = empty(folder(release))?;
    let program = release.program(Platform::Linux);
    run(Command::new(&program).args(["man", "--out"]).arg(papers.join("man")))?;
    let completions = empty(papers.join("completions"))?;
    for (shell, file) in SHELLS {
        let out = Command::new(&program).args(["completions", shell]).output()?;
        ensure!(out.status.success(), "no completions for {shell}");
        std::fs::write(completions.join(file), out.stdout)?;
    }
    let doc = empty(papers.join("doc"))?;
    for page in PAGES {
        std::fs::copy(release.house.root.join(page), doc.join(page)).context(page)?;
    }
    // All pages with their pictures, so that links between them hold without a network.
    copy(&release.house.root.join("docs"), &doc.join("docs"))?;
    licences::write(release, &doc.join(THIRD_PARTY))
}

pub(super) fn folder(release: &Release<'_>) -> PathBuf {
    release.parts.join("papers")
}

/// Copies a folder with all that is below it.
pub(super) fn copy(from: &Path, to: &Path) -> Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from).with_context(|| from.display().to_string())? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default();
        if path.is_dir() {
            copy(&path, &to.join(name))?;
        } else {
            std::fs::copy(&path, to.join(name))?;
        }
    }
    Ok(())
}

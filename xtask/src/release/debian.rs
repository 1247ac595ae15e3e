//! The package for Debian 12. It holds the static program, so it depends on nothing.

use super::build::Platform;
use super::papers::{self, THIRD_PARTY};
use super::{Release, said, tools};
use crate::steps::run;
use anyhow::{Context, Result};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where each shell of Debian looks for completions: the file of the papers, and its place.
const COMPLETIONS: [(&str, &str); 3] = [
    ("supine.bash", "bash-completion/completions/supine"),
    ("_supine", "zsh/vendor-completions/_supine"),
    ("supine.fish", "fish/vendor_completions.d/supine.fish"),
];

/// `supine_VERSION-1_amd64.deb`, judged by lintian.
pub(super) fn package(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("dpkg-deb", "dpkg"), ("lintian", "lintian")])?;
    let root = release.folder("debian")?;
    lay_out(release, &root)?;
    let control = control(release, &root)?;
    put(&root.join("DEBIAN/control"), &control)?;
    let sums = "find usr -type f -print0 | LC_ALL=C sort -z | xargs -0 md5sum > DEBIAN/md5sums";
    run(Command::new("sh").args(["-c", sums]).current_dir(&root))?;
    run(Command::new("chmod").args(["--recursive", "u=rwX,go=rX"]).arg(&root))?;
    let file = file(release);
    let mut build = Command::new("dpkg-deb");
    build.args(["--root-owner-group", "-Zxz", "--build"]).arg(&root).arg(&file);
    run(build.env("SOURCE_DATE_EPOCH", &release.epoch))?;
    super::made(&file)?;
    let lint = ["--allow-root", "--info", "--fail-on", "error,warning"];
    run(Command::new("lintian").args(lint).arg(&file))
}

pub(super) fn file(release: &Release<'_>) -> PathBuf {
    release.dist.join(format!("supine_{}-1_amd64.deb", release.version))
}

/// The files of the package below `usr`.
fn lay_out(release: &Release<'_>, root: &Path) -> Result<()> {
    let papers = papers::folder(release);
    let share = root.join("usr/share");
    let program = root.join("usr/bin/supine");
    std::fs::create_dir_all(root.join("usr/bin"))?;
    std::fs::copy(release.program(Platform::Linux), &program)?;
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755))?;
    papers::copy(&papers.join("man"), &share.join("man/man1"))?;
    for (file, place) in COMPLETIONS {
        put(&share.join(place), &std::fs::read_to_string(papers.join("completions").join(file))?)?;
    }
    let doc = share.join("doc/supine");
    papers::copy(&papers.join("doc"), &doc)?;
    std::fs::copy(doc.join("CHANGELOG.md"), doc.join("changelog"))?;
    for text in ["LICENSE-MIT", "LICENSE-APACHE"] {
        // They stand in `copyright`.
        std::fs::remove_file(doc.join(text))?;
    }
    let date = said(Command::new("date").args(["-u", "-R", "-d", &dated(release)]), root)?;
    let changes = form(release, "changelog")?.replace("@DATE@", &date);
    put(&doc.join("changelog.Debian"), &(changes + "\n"))?;
    let licence = std::fs::read_to_string(release.house.root.join("LICENSE-MIT"))?;
    put(
        &doc.join("copyright"),
        &form(release, "copyright")?.replace("@MIT@", &indented(&licence)),
    )?;
    put(&share.join("lintian/overrides/supine"), &form(release, "overrides")?)?;
    // As Debian has it, without name and time.
    let zip = "gzip --best --no-name man/man1/* doc/supine/changelog* doc/supine/\"$1\"";
    run(Command::new("sh").args(["-c", zip, "sh", THIRD_PARTY]).current_dir(&share))
}

/// Completions below `/usr/share`.
pub(super) fn completions() -> impl Iterator<Item = &'static str> {
    COMPLETIONS.into_iter().map(|(_, place)| place)
}

fn dated(release: &Release<'_>) -> String {
    format!("@{}", release.epoch)
}

fn control(release: &Release<'_>, root: &Path) -> Result<String> {
    let size =
        said(Command::new("du").args(["--summarize", "--apparent-size", "-k", "usr"]), root)?;
    let size = size.split_whitespace().next().context("du says nothing")?;
    Ok(form(release, "control")?.replace("@SIZE@", size))
}

/// One of the files in `xtask/release/debian`, with the version filled in.
fn form(release: &Release<'_>, name: &str) -> Result<String> {
    let path = release.house.root.join("xtask/release/debian").join(name);
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    Ok(text.replace("@VERSION@", &release.version))
}

/// A text as a field of a Debian control file: each line begins with a blank, an empty one is a
/// point.
fn indented(text: &str) -> String {
    let lines =
        text.trim().lines().map(|l| if l.is_empty() { " .".into() } else { format!(" {l}") });
    lines.collect::<Vec<String>>().join("\n")
}

fn put(path: &Path, text: &str) -> Result<()> {
    std::fs::create_dir_all(path.parent().context("a file lies in a folder")?)?;
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_licence_is_a_field() {
        assert_eq!(super::indented("One\n\ntwo\n"), " One\n .\n two");
    }
}

//! The container image: the static program alone, run by nobody.

use super::build::Platform;
use super::{Release, papers, tools};
use crate::steps::run;
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::Command;

/// Pages that belong to the program wherever it goes.
const PAGES: [&str; 4] =
    ["LICENSE-MIT", "LICENSE-APACHE", papers::THIRD_PARTY, "docs/LIMITATIONS.md"];

/// `supine-VERSION-x86_64-oci.tar`: an OCI archive, for `podman load`, `docker load` and `skopeo
/// copy`.
pub(super) fn image(release: &Release<'_>) -> Result<()> {
    tools::debian(&[("buildah", "buildah")])?;
    let context = release.folder("container")?;
    std::fs::copy(release.program(Platform::Linux), context.join("supine"))?;
    let doc = context.join("doc");
    std::fs::create_dir_all(&doc)?;
    for page in PAGES {
        let name = page.rsplit('/').next().context("a page has a name")?;
        std::fs::copy(papers::folder(release).join("doc").join(page), doc.join(name))?;
    }
    let name = format!("supine:{}", release.version);
    let mut build = buildah(release);
    build.args(["build", "--isolation", "chroot", "--timestamp", &release.epoch, "--tag", &name]);
    build.arg("--file").arg(release.house.root.join("xtask/release/Containerfile"));
    run(build.arg(&context))?;
    let file = file(release);
    if file.exists() {
        std::fs::remove_file(&file)?;
    }
    run(buildah(release).args(["push", &name, &format!("oci-archive:{}:{name}", file.display())]))?;
    super::made(&file)
}

pub(super) fn file(release: &Release<'_>) -> PathBuf {
    release.dist.join(format!("supine-{}-x86_64-oci.tar", release.version))
}

/// buildah with a store of its own below target/, which needs nothing of the kernel.
pub(super) fn buildah(release: &Release<'_>) -> Command {
    let mut buildah = Command::new("buildah");
    buildah.args(["--storage-driver", "vfs", "--root"]).arg(release.parts.join("images"));
    buildah.arg("--runroot").arg(release.parts.join("images-run"));
    buildah
}
